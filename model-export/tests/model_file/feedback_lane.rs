//! The feedback lane in the adapter and by itself.

use impromptu_firmware::{
    AddOn,
    adapter::Lanes,
    feedback::AxisState,
    guard::GuardSettings,
    model::{Model, Output},
    network::Scratch,
};
use impromptu_model_export::{
    Description, Precision,
    description::{AuthorityDescription, LaneDescription},
    encode,
};
use proptest::prelude::*;

use crate::fixture::{CAPS, description, lane, table};

const CAPACITY: usize = 32;

fn lane_only(lane: LaneDescription, delay_s: f32) -> (Description, Vec<u8>) {
    let mut description = description(0);
    description.timing.measurement_delay_s = delay_s;
    description.outputs = vec![Output { channel: 0, limit: 10.0, slew: 10.0 }];
    description.feedback_lane = Some(lane);
    let bytes = encode(&description, None, Precision::Float, &[]).unwrap();
    (description, bytes)
}

/// Corrections of the position reference at each tick.
fn corrections(
    lane: LaneDescription,
    delay_s: f32,
    ticks: i32,
    desired: impl Fn(i32) -> [f32; 2],
    measured: impl Fn(i32) -> [f32; 2],
) -> Vec<f32> {
    let (description, bytes) = lane_only(lane, delay_s);
    let model = Model::from_bytes(&bytes).unwrap();
    let mut add_on = AddOn::<2, 2, 2, CAPACITY>::new(&model, &table(&description), 100.0, &CAPS).unwrap();
    add_on.set_guard(GuardSettings::OFF);
    add_on.switch(Lanes { network: false, feedback: true });
    add_on.clear(-16);
    (-16..0).for_each(|tick| add_on.push(desired(tick)).unwrap());
    let step = |tick| {
        add_on.push(desired(tick)).unwrap();
        add_on.step(tick, &measured(tick), &mut Scratch::new());
        add_on.report().correction[0]
    };
    (0..ticks).map(step).collect()
}

/// Steps of one axis with these position errors, engaged, everything applied.
fn outputs(lane: LaneDescription, errors: impl IntoIterator<Item = [f32; 2]>) -> Vec<f32> {
    let (_, bytes) = lane_only(lane, 0.0);
    let model = Model::from_bytes(&bytes).unwrap();
    let lane = model.feedback().unwrap();
    let axis = &lane.axes()[0];
    let mut state = AxisState::EMPTY;
    let step = |errors| {
        let output = state.step(lane, axis, errors, 1.0, 0.01, true);
        state.applied(lane, output);
        output
    };
    errors.into_iter().map(step).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// What comes out is never more than both clamps, whatever comes in.
    #[test]
    fn outputs_are_bounded(
        errors in proptest::collection::vec(any::<[u32; 2]>(), 1..60),
        coefficients in proptest::collection::vec(-1e3f32..1e3, 8),
        integral in prop::sample::select(vec![0.0f32, 1e-30, -0.5, 50.0, -1e6]),
        repeats in 1usize..20,
    ) {
        let lane = lane([coefficients[..4].to_vec(), coefficients[4..].to_vec()], vec![0.2, -0.1, 0.0, 0.1], integral);
        let bound = lane.axes[0].fast_limit + lane.axes[0].integral_limit;
        let errors = errors.iter().map(|bits| bits.map(f32::from_bits)).cycle().take(errors.len() * repeats);
        for output in outputs(lane, errors) {
            prop_assert!(output.abs() <= bound, "{output}");
        }
    }

    /// A lane of one lag is a PD, to the bit.
    #[test]
    fn one_lag_is_a_pd(kp in -2f32..2.0, kd in -1f32..1.0, e in -1f32..1.0, v in -1f32..1.0, y in -3f32..3.0) {
        let mut pd = lane([vec![-kp], vec![-kd]], vec![0.0], 0.0);
        pd.axes[0].fast_limit = 100.0;
        let measured = [y + e, v];
        let found = corrections(pd, 0.0, 2, |_| [y, 0.0], |_| measured);
        let expected = -kp * (measured[0] - y) - kd * v;
        prop_assert_eq!(found[0].to_bits(), (expected + 0.0).to_bits());
        prop_assert_eq!(found[1], expected);
    }
}

/// Where much is desired, or where the loop has strayed, the fast clamp shrinks by 1 / (1 + v²); it comes back as the peak
/// decays.
#[test]
fn authority_falls_with_what_is_desired_and_with_the_error() {
    let cautious = |error_scale| {
        let mut p = lane([vec![-100.0], vec![0.0]], vec![0.0], 0.0);
        p.axes[0].fast_limit = 1.0;
        p.authority = AuthorityDescription { channels: vec![1], scale: 2.0, error_scale, decay: 0.5 };
        p
    };
    let shrunk = |v: f32| 1.0 / (1.0 + v * v);
    // A desired velocity of 4 for one tick, twice the scale; the measurement is 0.1 below what is desired all the time.
    let pulse = |tick: i32| [0.0, if tick == 5 { 4.0 } else { 0.0 }];
    let found = corrections(cautious(f32::MAX), 0.0, 30, pulse, |tick| [-0.1, pulse(tick)[1]]);
    for (tick, v) in [(4, 0.0), (5, 4.0), (6, 2.0), (7, 1.0), (25, 0.0)] {
        assert!((found[tick] - shrunk(v)).abs() < 1e-4, "{tick}: {} against {}", found[tick], shrunk(v));
    }
    // An error of twice the scale for one tick, then a tenth of it.
    let found = corrections(cautious(0.5), 0.0, 30, |_| [0.0; 2], |tick| [if tick == 5 { -1.0 } else { -0.1 }, 0.0]);
    for (tick, v) in [(4, 0.04), (5, 4.0), (6, 2.0), (25, 0.04)] {
        assert!((found[tick] - shrunk(v)).abs() < 1e-4, "{tick}: {} against {}", found[tick], shrunk(v));
    }
    // Errors beyond all numbers leave next to nothing, and not for ever.
    let found = corrections(cautious(0.5), 0.0, 60, |_| [0.0; 2], |tick| [if tick == 5 { 3.4e38 } else { -0.1 }, 0.0]);
    assert!(found[5].abs() < 1e-6 && found[6].abs() < 1e-6 && found[50] > 0.9, "{found:?}");
}

/// A ramp that is tracked perfectly and measured late has no error, and one that lags has its lag.
#[test]
fn errors_are_taken_at_the_time_of_the_measurement() {
    for delay in [0.0f32, 1.0, 2.4, 3.999] {
        let late = |extra: f32| {
            let mut p = lane([vec![-1.0], vec![0.0]], vec![0.0], 0.0);
            p.axes[0].fast_limit = 1.0;
            let desired = |tick: i32| [0.02 * tick as f32, 2.0];
            corrections(p, 0.01 * delay, 100, desired, |tick| [0.02 * (tick as f32 - delay) - extra, 2.0])
        };
        assert!(late(0.0).iter().all(|correction| correction.abs() < 2e-6), "{delay}");
        assert!(late(0.25).iter().all(|correction| (correction - 0.25).abs() < 2e-6), "{delay}");
    }
}

#[test]
fn the_integral_stops_at_its_clamp_and_comes_back_at_once() {
    let integrator = || {
        let mut lane = lane([vec![0.0], vec![0.0]], vec![0.0], -1.0);
        lane.axes[0].integral_limit = 0.1;
        lane
    };
    let pushed = |error: f32, ticks| std::iter::repeat_n([error, 0.0], ticks);
    // 0.05 m for 10 s: five times what the clamp holds.
    let found = outputs(integrator(), pushed(0.05, 1000).chain(pushed(-0.05, 300)));
    assert!((found[100] + 0.05).abs() < 1e-4, "a second of 5 cm: {}", found[100]);
    assert_eq!(found[999], -0.1);
    // 0.1 m at 0.05 m/s: back at zero after two seconds, whatever the time at the clamp.
    assert!(found[1200].abs() < 1e-3, "{}", found[1200]);
    // A single wrong measurement winds nothing up either.
    let found = outputs(integrator(), pushed(0.0, 5).chain(pushed(1e30, 1)).chain(pushed(-0.05, 250)));
    assert_eq!(found[6], -0.1);
    assert!(found[6 + 201].abs() < 1e-3, "{}", found[207]);
}

/// Nor does an error that adds up to infinity: a lane without an integral keeps none.
#[test]
fn endless_errors_leave_numbers() {
    for integral in [0.0, -1e-30, -1.0] {
        let found = outputs(lane([vec![-1.0], vec![0.0]], vec![0.0], integral), std::iter::repeat_n([3e38, 0.0], 2000));
        assert!(found.iter().all(|output| output.abs() <= 0.15), "{integral}: {:?}", found.last());
    }
}

/// The past outputs count as applied: what a limit took away is known to the lane.
#[test]
fn limited_outputs_enter_the_lags_as_applied() {
    let mut description = description(0);
    description.outputs = vec![Output { channel: 0, limit: 0.02, slew: 1.0 }];
    let mut memory = lane([vec![-1.0], vec![0.0]], vec![-0.5], 0.0);
    memory.axes[0].fast_limit = 1.0;
    description.feedback_lane = Some(memory);
    let bytes = encode(&description, None, Precision::Float, &[]).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    let mut add_on = AddOn::<2, 2, 2, CAPACITY>::new(&model, &table(&description), 100.0, &CAPS).unwrap();
    add_on.switch(Lanes::BOTH);
    let mut step = |tick, error| {
        add_on.push([0.0, 0.0]).unwrap();
        add_on.step(tick, &[error, 0.0], &mut Scratch::new());
        add_on.report().correction[0]
    };
    assert_eq!(step(0, -0.1), 0.02);
    // -0.5 times the 0.02 that were applied, not the 0.1 that were wanted.
    assert!((step(1, 0.0) + 0.01).abs() < 1e-7);
}
