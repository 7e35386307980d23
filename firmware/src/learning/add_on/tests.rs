use super::*;
use crate::learning::{Limits, Probe, draw::draw, response::Filter};
use proptest::prelude::*;

const RATE: f32 = 100.0;
const LIMITS: Limits = Limits { scale: 1.0, correction: 0.6, feedback: 0.3, rate: 20.0 };

fn settings(response: Option<Response>) -> AxisSettings {
    AxisSettings { response, limits: LIMITS, probe: Probe { size: 0.05, seconds: 4.0 } }
}

fn truth(axis: usize) -> Response {
    Response::second_order(1.0, [6.0, 9.0][axis], 0.7, 0.02, RATE).unwrap()
}

/// A machine of two axes, each a second-order loop that lags, with noise.
struct Machine {
    filters: [Filter; 2],
    references: [[f32; 4]; 2],
    seed: u32,
}

impl Machine {
    fn new() -> Self {
        Self { filters: [Filter::default(); 2], references: [[0.0; 4]; 2], seed: 5 }
    }

    fn measured(&mut self) -> [Option<Measured>; 2] {
        core::array::from_fn(|axis| {
            let response = truth(axis);
            let value = self.filters[axis].step(&response, self.references[axis][response.delay()]);
            Some(Measured { value: value + 1e-3 * draw(&mut self.seed), rate: None })
        })
    }

    fn gets(&mut self, references: [f32; 2]) {
        for (line, reference) in self.references.iter_mut().zip(references) {
            line.rotate_right(1);
            line[0] = reference;
        }
    }
}

/// At rest until a tick, then in motion.
fn desired(from: i32) -> impl Fn(i32) -> [f32; 2] {
    move |tick| {
        let t = (tick - from).max(0) as f32 / RATE;
        let ramp = t.min(1.0);
        [ramp * (1.1 * t).sin(), ramp * 0.7 * (0.3 * t).cos() * (1.7 * t).sin()]
    }
}

/// Flies a number of ticks from a tick on: mean square of the error.
fn fly(
    add_on: &mut LearningAddOn<2>,
    machine: &mut Machine,
    ticks: core::ops::Range<i32>,
    desired: impl Fn(i32) -> [f32; 2],
) -> f32 {
    let count = ticks.len() as f32;
    let mut sum = 0.0;
    for tick in ticks {
        let measured = machine.measured();
        let [a, b] = desired(tick);
        sum += [a, b].iter().zip(&measured).map(|(d, m)| (d - m.unwrap().value).powi(2)).sum::<f32>() / count;
        let [x, y] = add_on.step(tick, &desired, &measured, true);
        machine.gets([a + x, b + y]);
    }
    sum
}

/// Commissions and learns for a minute.
fn learned() -> (LearningAddOn<2>, Machine, f32) {
    let (mut add_on, mut machine) = (LearningAddOn::new(&[settings(None); 2], RATE, 0.0).unwrap(), Machine::new());
    add_on.commission();
    fly(&mut add_on, &mut machine, 0..1200, |_| [0.0; 2]);
    let Progress { phase, commissioned, problem, .. } = add_on.progress();
    assert_eq!((phase, commissioned, problem), (Phase::Learning, 1.0, None));
    fly(&mut add_on, &mut machine, 1200..7200, desired(1400));
    let left = fly(&mut add_on, &mut machine, 7200..8200, desired(1400));
    (add_on, machine, left)
}

#[test]
fn it_measures_learns_and_holds() {
    let bare = {
        let mut add_on = LearningAddOn::new(&[settings(None); 2], RATE, 0.0).unwrap();
        fly(&mut add_on, &mut Machine::new(), 1300..8200, desired(1400))
    };
    let (mut add_on, mut machine, left) = learned();
    assert!(left < 0.01 * bare, "{left} of {bare}");
    for axis in 0..2 {
        let (found, truth) = (add_on.response(axis).unwrap(), truth(axis));
        assert!((found.lag() / truth.lag() - 1.0).abs() < 0.15 && (found.gain() - 1.0).abs() < 0.15, "{found:?} {truth:?}");
    }
    add_on.hold().unwrap();
    let weights = add_on.learned(0);
    let held = fly(&mut add_on, &mut machine, 8200..9200, desired(1400));
    assert!(held < 0.01 * bare && add_on.learned(0) == weights, "{held}");
    add_on.stop();
    let stopped = fly(&mut add_on, &mut machine, 9200..10_200, desired(1400));
    assert!(stopped > 0.3 * bare && add_on.correction() == [0.0; 2], "{stopped}");
}

#[test]
fn what_was_kept_goes_on_after_a_power_cut() {
    let (add_on, ..) = learned();
    let mut bytes = [0xff; Kept::length(2) + 40];
    let length = add_on.keep(7, &mut bytes).unwrap().len();
    assert_eq!(length, Kept::length(2));
    let mut next = LearningAddOn::new(&[settings(None); 2], RATE, 0.0).unwrap();
    assert_eq!(next.recall(8, &bytes), Err(NotKept::Other));
    assert_eq!(next.learn(), Err(Problem::Unknown { axis: 0 }));
    next.recall(7, &bytes).unwrap();
    next.learn().unwrap();
    assert_eq!((next.learned(1), next.progress().learned_s), (add_on.learned(1), add_on.progress().learned_s));
    // As well as if the power had not been cut.
    let left = |mut add_on: LearningAddOn<2>| {
        let mut machine = Machine::new();
        fly(&mut add_on, &mut machine, 0..500, |_| [0.0; 2]);
        fly(&mut add_on, &mut machine, 500..1500, desired(600))
    };
    let (recalled, uncut) = (left(next), left(add_on.clone()));
    assert!((recalled / uncut - 1.0).abs() < 0.02, "{recalled} {uncut}");
    let mut other = LearningAddOn::new(&[settings(None)], RATE, 0.0).unwrap();
    assert_eq!(other.recall(7, &bytes), Err(NotKept::Axes { found: 2 }));
    let mut faster = LearningAddOn::new(&[settings(None); 2], 200.0, 0.0).unwrap();
    assert_eq!(faster.recall(7, &bytes), Err(NotKept::Other));
    assert!(add_on.keep(7, &mut [0; Kept::length(2) - 1]).is_none());
    assert!(faster.keep(7, &mut [0; Kept::length(2)]).is_none());
}

#[test]
fn refusals_name_their_reason_and_leave_the_phase_before() {
    let given = settings(Response::second_order(1.0, 6.0, 0.7, 0.02, RATE));
    let run = |move_at: i32, moving: bool, dropped: i32| {
        let (mut add_on, mut machine) = (LearningAddOn::new(&[given; 2], RATE, 0.0).unwrap(), Machine::new());
        add_on.learn().unwrap();
        add_on.commission();
        for tick in (0..6000).filter(|tick| *tick != dropped) {
            let measured = machine.measured();
            let offsets = add_on.step(tick, desired(move_at), &measured, moving);
            machine.gets(core::array::from_fn(|axis| desired(move_at)(tick)[axis] + offsets[axis]));
        }
        let Progress { phase, problem, .. } = add_on.progress();
        assert_eq!(phase, Phase::Learning);
        problem
    };
    assert_eq!(run(100_000, true, -1), None);
    assert_eq!(run(100_000, false, -1), Some(Problem::Grounded));
    assert_eq!(run(0, true, -1), Some(Problem::Moving));
    assert_eq!(run(400, true, -1), Some(Problem::Moving));
    assert_eq!(run(100_000, true, 400), Some(Problem::Gap));
    // A machine that does not answer.
    let mut add_on = LearningAddOn::new(&[settings(None); 2], RATE, 0.0).unwrap();
    assert_eq!(add_on.hold(), Err(Problem::Unknown { axis: 0 }));
    add_on.commission();
    for tick in 0..2000 {
        add_on.step(tick, |_| [0.0; 2], &[Some(Measured { value: 1e-4 * (tick % 7) as f32, rate: None }); 2], true);
    }
    assert!(matches!(add_on.progress().problem, Some(Problem::Unfit { why: crate::learning::Unfit::Noisy, .. })));
    assert_eq!(add_on.progress().phase, Phase::Off);
}

#[test]
fn settings_that_no_loop_has_are_refused() {
    let good = settings(None);
    assert!(LearningAddOn::new(&[good], RATE, 0.0).is_some());
    let large = AxisSettings { probe: Probe { size: 0.7, seconds: 4.0 }, ..good };
    assert!(LearningAddOn::new(&[large], RATE, 0.0).is_none(), "the steps are larger than corrections may be");
    for odd in [f32::NAN, -1.0, f32::INFINITY] {
        assert!(LearningAddOn::new(&[good], odd, 0.0).is_none());
        assert!(LearningAddOn::new(&[good], RATE, odd).is_none());
    }
    assert!(LearningAddOn::<0>::new(&[], RATE, 0.0).is_none());
}

/// Mean square of the error of a loop that sags and has another feedback, which takes slow errors away: what is left when the
/// preview part has learned for half a minute.
fn beside_another(told: bool) -> f32 {
    let given = [0, 1].map(|axis| settings(Some(truth(axis))));
    let (mut add_on, mut machine) = (LearningAddOn::new(&given, RATE, 0.0).unwrap(), Machine::new());
    add_on.switch(Parts::PREVIEW, Parts::PREVIEW);
    add_on.learn().unwrap();
    let (desired, mut other, mut sum) = (desired(100), [0.0f32; 2], 0.0);
    for tick in 0..4000 {
        let measured = machine.measured();
        let wanted = desired(tick);
        if told {
            (0..2).for_each(|axis| add_on.tell_other(axis, other[axis]));
        }
        let corrections = add_on.step(tick, &desired, &measured, true);
        for (other, (wanted, measured)) in other.iter_mut().zip(wanted.iter().zip(&measured)) {
            let error = wanted - measured.unwrap().value;
            *other = (*other + 0.02 * error).clamp(-0.4, 0.4);
            sum += if tick >= 3000 { error * error } else { 0.0 };
        }
        machine.gets(core::array::from_fn(|axis| wanted[axis] + corrections[axis] + other[axis] - 0.2));
    }
    sum / 1000.0
}

#[test]
fn another_feedback_is_no_part_of_the_loop() {
    let [told, untold] = [true, false].map(beside_another);
    println!("{told} told, {untold} not");
    assert!(told < 0.5 * untold, "{told} told, {untold} not");
}

#[derive(Clone, Debug)]
enum Call {
    Steps(u16, bool),
    Gap(i32),
    Commission,
    Learn,
    Hold,
    Stop,
    Forget,
    Recall,
}

fn calls() -> impl Strategy<Value = Vec<Call>> {
    let call = prop_oneof![
        8 => (1u16..400, prop::bool::weighted(0.9)).prop_map(|(count, moving)| Call::Steps(count, moving)),
        1 => any::<i32>().prop_map(Call::Gap),
        2 => Just(Call::Commission),
        1 => Just(Call::Learn),
        1 => Just(Call::Hold),
        1 => Just(Call::Stop),
        1 => Just(Call::Forget),
        1 => Just(Call::Recall),
    ];
    prop::collection::vec(call, 1..24)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever is called, and whatever is measured and desired: within the limits, by the rate limit but for the steps of a
    /// probe and where the machine is not moved, and finite.
    #[test]
    fn corrections_are_bounded_whatever_is_called(
        calls in calls(), from in any::<i32>(),
        odd in prop::collection::vec((any::<[f32; 2]>(), prop::array::uniform2(-2f32..2.0)), 1..30)
    ) {
        let (kept, _, _) = learned();
        let mut bytes = [0; Kept::length(2)];
        kept.keep(1, &mut bytes).unwrap();
        let given = settings(Response::second_order(1.0, 6.0, 0.7, 0.02, RATE));
        let mut add_on = LearningAddOn::new(&[given; 2], RATE, 0.0).unwrap();
        let (mut tick, mut before) = (from, [0.0f32; 2]);
        for call in calls {
            match call {
                Call::Steps(count, moving) => for _ in 0..count {
                    let at = |tick: i32| odd[tick.rem_euclid(odd.len() as i32) as usize];
                    let (any, sane) = at(tick);
                    let calm = tick & 1024 == 0;
                    let desired = |tick: i32| if calm { [0.0; 2] } else { at(tick).1 };
                    let measured = if tick % 13 == 0 { any } else { sane };
                    let measured = measured.map(|value| (tick % 11 != 0).then_some(Measured { value, rate: None }));
                    let probing = add_on.progress().phase == Phase::Commissioning;
                    if tick % 17 == 0 {
                        add_on.tell_other(1, any[0]);
                    }
                    let now = add_on.step(tick, desired, &measured, moving);
                    let jumps = probing || !moving || add_on.progress().phase == Phase::Commissioning;
                    for (now, before) in now.iter().zip(before) {
                        prop_assert!(now.abs() <= LIMITS.correction);
                        let slow = (now - before).abs() <= 1.001 * LIMITS.rate / RATE;
                        prop_assert!(jumps || slow || before.abs() == 0.05, "{before} {now}");
                    }
                    before = now;
                    tick = tick.wrapping_add(1);
                },
                Call::Gap(ticks) => {
                    tick = tick.wrapping_add(ticks);
                }
                Call::Commission => add_on.commission(),
                Call::Learn => drop(add_on.learn()),
                Call::Hold => drop(add_on.hold()),
                Call::Stop => add_on.stop(),
                Call::Forget => add_on.forget(),
                Call::Recall => drop(add_on.recall(1, &bytes)),
            }
        }
    }
}
