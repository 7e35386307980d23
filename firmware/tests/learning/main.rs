//! A servo with friction learns from nothing, while it runs, what its loop needs.
//!
//! *in* unseen smooth motions, and whole days of them; *out* the error that is left; *never* a model; *source* the servo of
//! the pilot of learning in flight: PD behind a delay, viscous and Coulomb friction, a slow random disturbance.

mod day;

use impromptu_firmware::learning::{Learner, Limits, Measured, Parts, Response};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const HZ: usize = 100;
const LIMITS: Limits = Limits { scale: 1.0, correction: 1.0, feedback: 0.3, rate: 40.0 };

struct Servo {
    random: Xoshiro256PlusPlus,
    angle: f64,
    speed: f64,
    disturbance: f64,
    line: [f64; 21],
    /// Of its position gain.
    strength: f64,
}

impl Servo {
    fn new(seed: u64) -> Self {
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            angle: 0.0,
            speed: 0.0,
            disturbance: 0.0,
            line: [0.0; 21],
            strength: 1.0,
        }
    }

    /// A normal number, as the sum of twelve uniform ones.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.random.random_range(-0.5..0.5)).sum()
    }

    fn measured(&mut self) -> (f32, f32) {
        let (angle, speed) = (1e-3 * self.normal(), 1e-2 * self.normal());
        ((self.angle + angle) as f32, (self.speed + speed) as f32)
    }

    /// 10 ms towards a reference.
    fn run(&mut self, reference: f64) {
        const H: f64 = 1e-3;
        for _ in 0..10 {
            self.line.rotate_right(1);
            self.line[0] = reference;
            self.disturbance += -H / 0.4 * self.disturbance + 0.5 * (2.0 * H / 0.4f64).sqrt() * self.normal();
            let torque = (60.0 * self.strength * (self.line[20] - self.angle) - 9.0 * self.speed).clamp(-40.0, 40.0);
            self.speed += H * (torque - 2.0 * self.speed - 1.5 * (self.speed / 0.02).tanh() + self.disturbance);
            self.angle += H * self.speed;
        }
    }
}

/// A sum of five sines of 0.1 to 1.2 Hz, of 1.5 rad, from rest.
fn motion(seed: u64, seconds: usize) -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let tones: Vec<[f64; 3]> = (0..5)
        .map(|_| {
            let hz = random.random_range(0.1f64.ln()..1.2f64.ln()).exp();
            [hz, random.random_range(0.3..1.0) / hz, random.random_range(0.0..std::f64::consts::TAU)]
        })
        .collect();
    let at = |t: f64| tones.iter().map(|[hz, size, phase]| size * (std::f64::consts::TAU * hz * t + phase).sin()).sum::<f64>();
    let ramp = |t: f64| t.min(1.0).powi(2) * (3.0 - 2.0 * t.min(1.0));
    let times = (0..seconds * HZ).map(|tick| tick as f64 / HZ as f64);
    let values: Vec<f64> = times.map(|t| (at(t) - at(0.0)) * ramp(t)).collect();
    let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    values.iter().map(|value| 1.5 * value / most).collect()
}

/// RMS error of a run, rad.
fn fly(seed: u64, desired: &[f64], learner: Option<&mut Learner>, parts: Parts) -> f64 {
    fly_on(Servo::new(seed), desired, learner, parts, parts)
}

/// [`fly`] of this servo, with parts that learn and parts that act.
fn fly_on(mut servo: Servo, desired: &[f64], learner: Option<&mut Learner>, learn: Parts, act: Parts) -> f64 {
    let (mut sum, mut learner) = (0.0, learner);
    if let Some(learner) = &mut learner {
        // The servo is a new one.
        learner.release();
        learner.start(desired[0] as f32);
    }
    for (tick, goal) in desired.iter().enumerate() {
        sum += (servo.angle - goal).powi(2);
        let (angle, speed) = servo.measured();
        let around = |offset: i32| desired[(tick as i32 + offset).clamp(0, desired.len() as i32 - 1) as usize] as f32;
        let correction = match &mut learner {
            Some(learner) => learner.step(around, Some(Measured { value: angle, rate: Some(speed) }), learn, act),
            None => 0.0,
        };
        servo.run(goal + f64::from(correction));
    }
    (sum / desired.len() as f64).sqrt()
}

/// Reductions, %, of 30 strokes one after another; the feedback part joins from the second on.
fn reductions(response: Response) -> Vec<f64> {
    let mut learner = Learner::new(response, HZ as f32, 0.0, LIMITS).unwrap();
    (0..30)
        .map(|stroke| {
            let desired = motion(100 + stroke, 18);
            let baseline = fly(stroke, &desired, None, Parts::NONE);
            let feedback = stroke > 0;
            let error = fly(stroke, &desired, Some(&mut learner), Parts { preview: true, feedback });
            100.0 * (1.0 - error / baseline)
        })
        .collect()
}

fn guessed() -> Learner {
    Learner::new(Response::second_order(1.0, 7.75, 0.71, 0.02, HZ as f32).unwrap(), HZ as f32, 0.0, LIMITS).unwrap()
}

#[test]
fn minutes_at_rest_wind_nothing_up() {
    let mut learner = guessed();
    (0..4).for_each(|stroke| {
        fly(stroke, &motion(100 + stroke, 18), Some(&mut learner), Parts::BOTH);
    });
    let desired = motion(104, 18);
    let before = fly(4, &desired, Some(&mut learner.clone()), Parts::BOTH);
    let rest = fly(5, &[0.4; 600 * HZ], Some(&mut learner), Parts::BOTH);
    assert!(rest < 0.41, "{rest}");
    let after = fly(4, &desired, Some(&mut learner), Parts::BOTH);
    assert!(after < 1.2 * before, "{after} after, {before} before");
}

/// What is ahead would make the servo set out before the step: that is worse than to be late.
#[test]
fn no_step_is_run_ahead_of() {
    let mut learner = guessed();
    (0..4).for_each(|stroke| {
        fly(stroke, &motion(100 + stroke, 18), Some(&mut learner), Parts::BOTH);
    });
    // The last tick is that of the step.
    let correction = |size: f64| {
        let mut learner = learner.clone();
        let desired: Vec<f64> = (0..=4 * HZ).map(|tick| if tick < 4 * HZ { 0.0 } else { size }).collect();
        fly(6, &desired, Some(&mut learner), Parts::BOTH);
        learner.correction()
    };
    let corrections = [0.2, 0.5, 1.0, -1.0].map(correction);
    for other in corrections {
        assert!((other - corrections[0]).abs() < 1e-3, "{corrections:?}");
    }
}

#[test]
fn a_loop_that_sags_is_followed() {
    let sagged = |stroke: u64| Servo { strength: 1.0 - 0.01 * stroke as f64, ..Servo::new(stroke) };
    let left = |stroke: u64, learner: &mut Learner, learn: Parts| {
        let desired = motion(200 + stroke % 2, 18);
        let baseline = fly_on(sagged(stroke), &desired, None, Parts::NONE, Parts::NONE);
        100.0 * (1.0 - fly_on(sagged(stroke), &desired, Some(learner), learn, Parts::BOTH) / baseline)
    };
    let mut learner = guessed();
    (0..6).for_each(|stroke| {
        left(stroke, &mut learner, Parts::BOTH);
    });
    let mut frozen = learner.clone();
    (6..29).for_each(|stroke| {
        left(stroke, &mut learner, Parts::BOTH);
    });
    let (learns, stays) = (left(29, &mut learner, Parts::BOTH), left(29, &mut frozen, Parts::NONE));
    println!("a gain of 0.71: learning on {learns:.1} %, not {stays:.1} %");
    assert!(learns > 97.0 && 100.0 - learns < 0.7 * (100.0 - stays), "{learns} {stays}");
}

#[test]
fn a_servo_learns_from_nothing_and_from_a_response_that_is_wrong() {
    let mut guessed = None;
    for (name, gain, frequency, delay) in [
        ("as guessed from its gains", 1.0, 7.75, 0.02),
        ("gain x2", 2.0, 7.75, 0.02),
        ("100 ms later", 1.0, 7.75, 0.12),
        ("half as fast", 1.0, 3.9, 0.02),
    ] {
        let response = Response::second_order(gain, frequency, 0.71, delay, HZ as f32).unwrap();
        let found = reductions(response);
        let later = &found[4..];
        let (mean, worst) = (later.iter().sum::<f64>() / later.len() as f64, later.iter().copied().fold(f64::MAX, f64::min));
        println!("{name}: first strokes {:.1?}, from the fifth on {mean:.1} / {worst:.1} %", &found[..4]);
        let guessed = *guessed.get_or_insert(mean);
        assert!(mean >= 95.0 && worst >= 80.0 && mean >= guessed - 3.0, "{name}: {mean} / {worst}");
    }
}
