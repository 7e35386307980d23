//! What learns an axis, from C: a servo is commissioned, learned and gone on with after a power cut, with the bits of Rust.

use impromptu_firmware::learning::{AHEAD, AxisSettings, Kept, LearningAddOn, Limits, Measured, Phase, Probe, Progress};

use super::{answered_everywhere, floats};

const RATE: f32 = 100.0;
const LIMITS: Limits = Limits { scale: 1.0, correction: 0.5, feedback: 0.3, rate: 20.0 };
const PROBE: Probe = Probe { size: 0.05, seconds: 4.0 };
/// Ticks before and after the power cut; the motion begins at this one.
const TICKS: [u32; 2] = [3_000, 1_000];
const MOTION: i32 = 1_400;
const IDENTITY: u32 = 77;

fn desired(tick: i32) -> f32 {
    let t = (tick - MOTION).max(0) as f32 / RATE;
    t.min(1.0) * (0.8 * (1.3 * t).sin() + 0.4 * (2.9 * t).sin())
}

/// A servo that lags behind its reference by a second-order system, in small steps.
#[derive(Default)]
struct Servo {
    angle: f32,
    speed: f32,
}

impl Servo {
    fn run(&mut self, reference: f32) {
        for _ in 0..10 {
            self.speed += 1e-3 * (60.0 * (reference - self.angle) - 9.0 * self.speed);
            self.angle += 1e-3 * self.speed;
        }
    }
}

/// What the C program reads, and what it must answer.
fn script() -> (Vec<u8>, Vec<u8>) {
    let axis = AxisSettings { response: None, limits: LIMITS, probe: PROBE };
    let (mut script, mut answers) = (Vec::new(), Vec::new());
    floats(&mut script, &[RATE, 0.0]);
    script.extend(0u32.to_le_bytes());
    let Limits { scale, correction, feedback, rate } = LIMITS;
    floats(&mut script, &[0.0, 0.0, 0.0, 0.0, scale, correction, feedback, rate, PROBE.size, PROBE.seconds]);
    script.extend(IDENTITY.to_le_bytes());
    script.extend(TICKS.map(u32::to_le_bytes).as_flattened());

    let mut servo = Servo::default();
    let mut fly = |add_on: &mut LearningAddOn<1>, ticks: std::ops::Range<i32>, script: &mut Vec<u8>, answers: &mut Vec<u8>| {
        let mut square = 0.0;
        let count = ticks.len() as f32;
        for tick in ticks {
            // The rate of change is measured every other second, else it is derived.
            let rate = if tick / 100 % 2 == 0 { servo.speed } else { f32::NAN };
            floats(script, &[desired(tick + AHEAD), servo.angle, rate]);
            let measured = Measured { value: servo.angle, rate: Some(rate).filter(|rate| rate.is_finite()) };
            let [correction] = add_on.step(tick, |tick| [desired(tick)], &[Some(measured)], true);
            floats(answers, &[correction]);
            square += (servo.angle - desired(tick)).powi(2) / count;
            servo.run(desired(tick) + correction);
        }
        square.sqrt()
    };
    let [first, second] = TICKS.map(|ticks| ticks as i32);
    let mut add_on = LearningAddOn::new(&[axis], RATE, 0.0).unwrap();
    add_on.commission();
    fly(&mut add_on, 0..first, &mut script, &mut answers);
    let Progress { phase, commissioned, learned_s, share, forgotten, problem } = add_on.progress();
    assert_eq!((phase, problem), (Phase::Learning, None));
    let response = add_on.response(0).unwrap();
    answers.extend([2u32, 0].map(u32::to_le_bytes).as_flattened());
    floats(&mut answers, &[commissioned, learned_s, share]);
    answers.extend(u32::from(forgotten).to_le_bytes());
    let [correction] = add_on.correction();
    floats(&mut answers, &[correction, response.gain(), response.turn() * RATE, response.lag() / RATE]);
    answers.extend((AHEAD as u32).to_le_bytes());
    let mut kept = [0; Kept::length(1)];
    answers.extend(add_on.keep(IDENTITY, &mut kept).unwrap());

    // What is before the first sample that is pushed is held.
    let mut next = LearningAddOn::new(&[axis], RATE, 0.0).unwrap();
    next.recall(IDENTITY, &kept).unwrap();
    next.learn().unwrap();
    floats(&mut script, &(first..first + AHEAD).map(desired).collect::<Vec<_>>());
    let held = |tick: i32| desired(tick.max(first));
    let mut square = 0.0;
    for tick in first..first + second {
        floats(&mut script, &[desired(tick + AHEAD), servo.angle, servo.speed]);
        let measured = Measured { value: servo.angle, rate: Some(servo.speed) };
        let [correction] = next.step(tick, |tick| [held(tick)], &[Some(measured)], true);
        floats(&mut answers, &[correction]);
        square += (servo.angle - desired(tick)).powi(2);
        servo.run(desired(tick) + correction);
    }
    let bare = 0.15;
    let left = (square / second as f32).sqrt();
    assert!(left < 0.5 * bare, "after the power cut: {left} rad");
    (script, answers)
}

#[test]
fn a_c_program_learns_with_the_bits_of_rust_here_and_on_the_emulated_board() {
    let (script, expected) = script();
    answered_everywhere("c-learner", "learner.c", &script, &expected, |_| ());
}
