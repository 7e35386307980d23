//! The guard in the adapter: each lane trips alone, and the baseline's bits are left.

use impromptu_firmware::{
    adapter::{Adapter, Lanes},
    guard::{GuardSettings, Trip, Trips},
    model::Model,
    network::Scratch,
    preview::{EndRule, Preview},
};
use impromptu_model_export::{
    Description,
    description::{MonitorAxisDescription, MonitorDescription},
};
use proptest::prelude::*;

use crate::fixture::{CAPS, constant_model, description, lane, table};

const CAPACITY: usize = 64;

/// What a tick of [`fly`] gave.
struct Tick {
    desired: [f32; 2],
    reference: [f32; 2],
    correction: [f32; 2],
    trips: Trips,
    acting: Lanes,
}

/// A loop whose measured position follows a correction of the position at once and for one monitor tick of ten reference ticks.
fn guarded() -> Description {
    let mut description = description(1);
    description.timing.fade_s = 0.2;
    description.feedback_lane = Some(lane([vec![-0.5], vec![0.0]], vec![0.0], 0.0));
    let axis = MonitorAxisDescription { error: (0, 0), inputs: vec![0], taps: vec![vec![1.0]] };
    description.monitor = Some(MonitorDescription { divisor: 10, validated_rms: 0.01, axes: vec![axis] });
    description
}

/// What the application does at a tick.
struct Doing {
    desired: [f32; 2],
    measured: [f32; 2],
    lanes: Lanes,
    age: u16,
}

/// Flies a model whose network always asks for `correction`.
fn fly(
    description: Description,
    correction: [f32; 2],
    settings: GuardSettings,
    ticks: i32,
    doing: impl Fn(i32) -> Doing,
) -> Vec<Tick> {
    fly_told(description, correction, settings, ticks, doing, |_, _| ())
}

/// [`fly`] in which the application tells the adapter something before each tick.
fn fly_told(
    description: Description,
    correction: [f32; 2],
    settings: GuardSettings,
    ticks: i32,
    doing: impl Fn(i32) -> Doing,
    tell: impl Fn(&mut Adapter<'_, 2, 2, 2>, i32),
) -> Vec<Tick> {
    let bytes = constant_model(description.clone(), correction);
    let model = Model::from_bytes(&bytes).unwrap();
    let mut adapter: Adapter<'_, 2, 2, 2> = Adapter::new(&model, &table(&description), 100.0, &CAPS, CAPACITY).unwrap();
    adapter.set_guard(settings);
    let mut preview = Preview::<2, CAPACITY>::new([EndRule::Hold, EndRule::Zero], 0);
    (0..20).for_each(|tick| preview.push(doing(tick).desired));
    (0..ticks)
        .map(|tick| {
            preview.push(doing(tick + 20).desired);
            let Doing { desired, measured, lanes, age } = doing(tick);
            adapter.switch(lanes);
            adapter.set_age(age);
            tell(&mut adapter, tick);
            let reference = adapter.step(tick, &preview, &measured, &mut Scratch::new());
            let correction = [adapter.correction()[0], adapter.correction()[1]];
            Tick { desired, reference, correction, trips: adapter.trips(), acting: adapter.guard().unwrap().allowed(lanes) }
        })
        .collect()
}

fn calm(lanes: Lanes) -> Doing {
    Doing { desired: [1.0, 0.0], measured: [1.0, 0.0], lanes, age: 0 }
}

fn only(trip: Trip, lanes: [u16; 2]) -> Trips {
    let mut trips = Trips::default();
    (trips.network[trip.index()], trips.feedback[trip.index()]) = lanes.into();
    trips
}

fn bits(values: [f32; 2]) -> [u32; 2] {
    values.map(f32::to_bits)
}

#[test]
fn a_good_flight_trips_nothing() {
    let flight = fly(guarded(), [0.1, 0.0], GuardSettings::default(), 600, |_| calm(Lanes::BOTH));
    // The loop is where it is desired to be with the correction, so it would not be without.
    assert_eq!(flight[599].trips, Trips::default());
    assert_eq!(flight[599].correction[0], 0.1);
}

/// One bad sample is one missed sample.
#[test]
fn a_measurement_that_is_no_number_costs_nothing_for_as_long_as_a_missing_one() {
    let good = |_: i32| Doing { measured: [1.0, 0.0], ..calm(Lanes::BOTH) };
    let bad = |tick: i32| Doing { measured: if (100..110).contains(&tick) { [f32::NAN, 0.0] } else { [1.0, 0.0] }, ..good(tick) };
    let description = Description { monitor: None, ..guarded() };
    let without = fly(description.clone(), [0.1, 0.0], GuardSettings::default(), 200, good);
    let with = fly(description, [0.1, 0.0], GuardSettings::default(), 200, bad);
    for (with, without) in with.iter().zip(&without) {
        assert_eq!((bits(with.reference), with.trips), (bits(without.reference), Trips::default()));
    }
}

#[test]
fn measurements_that_are_no_numbers_for_long_take_both_lanes_off_once_and_back_after_the_hold_time() {
    let doing =
        |tick: i32| Doing { measured: if (90..110).contains(&tick) { [f32::NAN, 0.0] } else { [1.0, 0.0] }, ..calm(Lanes::BOTH) };
    // What the network would do meanwhile is no evidence here.
    let description = Description { monitor: None, ..guarded() };
    let flight = fly(description, [0.1, 0.0], GuardSettings::default(), 500, doing);
    // Older than 0.1 s.
    assert_eq!(flight[99].trips, Trips::default());
    assert_eq!(flight[100].acting, Lanes::NONE);
    for tick in &flight[140..300] {
        assert_eq!(bits(tick.reference), bits(tick.desired));
    }
    // The last bad one was at tick 109: two seconds are over at tick 309.
    assert_eq!((flight[308].acting, flight[309].acting), (Lanes::NONE, Lanes::BOTH));
    assert_eq!(flight[499].trips, only(Trip::NotFinite, [1, 1]));
    assert_eq!(flight[499].correction[0], 0.1);
}

/// The measurement of a tick, in which noise never repeats, but new only each `period` ticks, and never again from `end` on.
fn sampled(tick: i32, period: i32, end: i32) -> f32 {
    let last = tick.min(end) / period * period;
    1.0 + 1e-3 * (last as f32 * 0.7).sin()
}

#[test]
fn what_has_noise_and_stands_still_is_old_if_the_application_says_so() {
    let flight = |period: i32, channels: &[usize]| {
        let doing = |tick: i32| Doing { measured: [sampled(tick, period, 200), 0.0], ..calm(Lanes::BOTH) };
        let description = Description { monitor: None, ..guarded() };
        let tell = |adapter: &mut Adapter<'_, 2, 2, 2>, tick: i32| {
            if tick == 0 {
                adapter.expect_noise(channels.iter().copied(), period as u16);
            }
        };
        fly_told(description, [0.1, 0.0], GuardSettings::default(), 300, doing, tell)
    };
    for period in [1, 10] {
        let stated = flight(period, &[0]);
        assert_eq!(stated[200].trips, Trips::default(), "new each {period} ticks");
        let found = stated.iter().position(|tick| tick.acting == Lanes::NONE);
        assert!(found.is_some_and(|tick| (201..=230).contains(&tick)), "{found:?}");
        assert_eq!(stated[299].trips, only(Trip::Stale, [1, 1]));
        // Where nothing is stated, or only of a channel that there is not, what stands still may be at rest.
        for channels in [&[][..], &[7]] {
            assert_eq!(flight(period, channels)[299].trips, Trips::default());
        }
    }
    // A channel that does not move does not hide behind one that does.
    let doing = |tick: i32| Doing { measured: [sampled(tick, 1, 200), tick as f32], ..calm(Lanes::BOTH) };
    let tell = |adapter: &mut Adapter<'_, 2, 2, 2>, tick: i32| {
        if tick == 0 {
            adapter.expect_noise([0], 1);
        }
    };
    let flight = fly_told(Description { monitor: None, ..guarded() }, [0.1, 0.0], GuardSettings::default(), 300, doing, tell);
    assert_eq!(flight[299].trips, only(Trip::Stale, [1, 1]));
}

#[test]
fn on_the_ground_no_lane_acts_integrates_learns_or_trips_and_in_the_air_they_fade_in() {
    // A vehicle that does not follow, a lane that integrates, and a measurement that is too old meanwhile.
    let mut description = guarded();
    description.feedback_lane = Some(lane([vec![-0.5], vec![0.0]], vec![0.0], 0.5));
    let doing = |tick: i32| {
        let ground = tick < 400;
        Doing { measured: [if ground { 0.8 } else { 1.0 }, 0.0], age: if ground { 50 } else { 0 }, ..calm(Lanes::BOTH) }
    };
    let tell = |adapter: &mut Adapter<'_, 2, 2, 2>, tick: i32| adapter.set_airborne(tick >= 400);
    let flight = fly_told(description.clone(), [0.1, 0.0], GuardSettings::default(), 500, doing, tell);
    for tick in &flight[..400] {
        assert_eq!((bits(tick.reference), tick.trips), (bits(tick.desired), Trips::default()));
    }
    // From there on as a flight that begins there, but for the errors of the last ticks on the ground, which the lane remembers.
    let fresh = fly(description, [0.1, 0.0], GuardSettings::default(), 100, |_| calm(Lanes::BOTH));
    for (tick, fresh) in flight[410..].iter().zip(&fresh[10..]) {
        assert!((tick.correction[0] - fresh.correction[0]).abs() < 2e-3, "{:?} {:?}", tick.correction, fresh.correction);
        assert_eq!(tick.trips, Trips::default());
    }
}

#[test]
fn each_lane_trips_alone() {
    // The network's correction moves the loop away from where it is desired to be.
    let away = |tick: i32| Doing {
        measured: [1.0 + if tick < 200 { 0.1 } else { 0.0 }, 0.0],
        ..calm(Lanes { network: true, feedback: false })
    };
    let flight = fly(guarded(), [0.1, 0.0], GuardSettings::default(), 200, away);
    assert_eq!(flight[199].trips, only(Trip::Counterfactual, [1, 0]));
    // The feedback lane's correction does.
    let swing = |tick: i32| Doing { measured: [1.0 - if (tick / 20) % 2 == 0 { 0.1 } else { -0.1 }, 0.0], ..calm(Lanes::BOTH) };
    let mut description = guarded();
    // Of the opposite sign: the measured swing is what the lane makes.
    description.feedback_lane = Some(lane([vec![0.5], vec![0.0]], vec![0.0], 0.0));
    description.monitor.as_mut().unwrap().axes[0].taps = vec![vec![2.0]];
    let flight = fly(description, [0.0, 0.0], GuardSettings::default(), 200, swing);
    assert_eq!(flight[199].trips, only(Trip::Counterfactual, [0, 1]));
    // Features outside of the box concern the network.
    let far = |tick: i32| Doing {
        desired: [if tick < 100 { 0.0 } else { 10.0 * (tick - 99) as f32 }, 0.0],
        measured: [if tick < 100 { 0.0 } else { 10.0 * (tick - 99) as f32 }, 0.0],
        ..calm(Lanes::BOTH)
    };
    let mut description = guarded();
    description.monitor = None;
    let flight = fly(description, [0.1, 0.0], GuardSettings::default(), 200, far);
    assert_eq!(flight[199].trips, only(Trip::Envelope, [1, 0]));
    assert_eq!(flight[199].acting, Lanes { network: false, feedback: true });
}

#[test]
fn old_measurements_and_lasting_limits_trip() {
    let old = |tick: i32| Doing { age: if tick < 100 { 10 } else { 11 }, ..calm(Lanes::BOTH) };
    let flight = fly(guarded(), [0.1, 0.0], GuardSettings::default(), 120, old);
    assert_eq!((flight[99].trips, flight[119].trips), (Trips::default(), only(Trip::Stale, [1, 1])));
    // A network that asks for twice the limit.
    let mut description = guarded();
    description.monitor = None;
    description.feedback_lane = None;
    description.features.truncate(1);
    let mut tight = description.clone();
    tight.outputs[0].slew = 1e-4;
    let flight = fly(tight, [0.4, 0.0], GuardSettings::default(), 300, |_| calm(Lanes::BOTH));
    assert_eq!(flight[299].trips.by_lane(), [1, 0]);
    assert_eq!(flight[299].trips, only(Trip::Saturated, [1, 0]));
    let off = fly(description, [0.4, 0.0], GuardSettings::OFF, 300, |tick| Doing {
        age: 1000,
        measured: [f32::NAN; 2],
        ..calm(if tick > 5 { Lanes::BOTH } else { Lanes::NONE })
    });
    assert_eq!(off[299].trips, Trips::default());
}

#[test]
fn what_the_evidence_speaks_against_again_and_again_stays_off_until_it_is_armed() {
    // The loop swings whenever the lane acts, and is calm half a second later.
    let mut description = guarded();
    description.feedback_lane = Some(lane([vec![0.5], vec![0.0]], vec![0.0], 0.0));
    description.monitor.as_mut().unwrap().axes[0].taps = vec![vec![2.0]];
    let lanes = |tick: i32| if (2500..2510).contains(&tick) { Lanes::NONE } else { Lanes { network: false, feedback: true } };
    let doing = |tick: i32| Doing { measured: [1.0 - if (tick / 20) % 2 == 0 { 0.1 } else { -0.1 }, 0.0], ..calm(lanes(tick)) };
    let flight = fly(description, [0.0, 0.0], GuardSettings { hold_s: 1.0, ..GuardSettings::default() }, 3000, doing);
    assert_eq!(flight[2400].trips, only(Trip::Counterfactual, [0, 3]));
    assert!(!flight[2499].acting.feedback && flight[2515].acting.feedback);
    assert!(flight[2999].trips.by_lane()[1] > 3);
}

/// A lane that is 20 cm per metre of error, its clamps at 5 cm, in a loop that goes to and fro by a metre.
#[test]
fn a_lane_that_swings_between_its_clamps_is_off_for_good_and_one_that_is_slow_or_small_is_not() {
    let feedback = Lanes { network: false, feedback: true };
    let fly = |half: i32, amplitude: f32| {
        // Without the response of the loop there is no evidence.
        let description = Description { monitor: None, ..guarded() };
        let side = move |tick: i32| if (tick / half) % 2 == 0 { amplitude } else { -amplitude };
        let lanes = move |tick: i32| if (900..910).contains(&tick) { Lanes::NONE } else { feedback };
        let doing = move |tick: i32| Doing { measured: [1.0 + side(tick), 0.0], ..calm(lanes(tick)) };
        fly(description, [0.0, 0.0], GuardSettings::default(), 1100, doing)
    };
    let swinging = fly(6, 1.0);
    assert_eq!(swinging[100].trips, only(Trip::Oscillation, [0, 1]), "within a second");
    assert_eq!(swinging[850].trips, only(Trip::Oscillation, [0, 1]), "longer than the hold time");
    let (tick, off) = (&swinging[850], Lanes { network: false, feedback: false });
    assert_eq!((tick.acting, bits(tick.reference)), (off, bits(tick.desired)));
    // Switched off and on again.
    assert!(swinging[915].acting.feedback && swinging[1099].trips.by_lane()[1] == 2);
    // At one clamp for long, and never near both.
    for calm in [fly(50, 1.0), fly(6, 0.05)] {
        assert_eq!(calm[850].trips, Trips::default());
    }
}

#[test]
fn inferences_that_come_too_late_trip_the_network_alone_until_they_are_in_time() {
    let description = Description { monitor: None, ..guarded() };
    let bytes = constant_model(description.clone(), [0.1, 0.0]);
    let model = Model::from_bytes(&bytes).unwrap();
    let mut adapter: Adapter<'_, 2, 2, 2> = Adapter::new(&model, &table(&description), 100.0, &CAPS, CAPACITY).unwrap();
    adapter.switch(Lanes::BOTH);
    adapter.defer();
    let mut preview = Preview::<2, CAPACITY>::new([EndRule::Hold, EndRule::Zero], 0);
    (0..20).for_each(|_| preview.push([1.0, 0.0]));
    let mut seen = Vec::new();
    for tick in 0..800 {
        preview.push([1.0, 0.0]);
        let in_time = !(200..400).contains(&tick);
        if let Some(job) = adapter.begin(tick, &preview, &[1.0, 0.0]).filter(|_| in_time) {
            adapter.deliver(job.run(model.network().unwrap(), &mut Scratch::new()));
        }
        let reference = adapter.finish(tick, &preview, &[1.0, 0.0]);
        seen.push((reference[0], adapter.trips(), adapter.guard().unwrap().allowed(Lanes::BOTH)));
    }
    let late = GuardSettings::default().late_in_a_row as usize;
    // Sub-rate ticks of ten reference ticks; the first late one is missed a reference tick later at the soonest.
    assert_eq!(seen[200 + 10 * (late - 1)].1, Trips::default());
    assert_eq!(seen[201 + 10 * late].1, only(Trip::Late, [1, 0]));
    assert_eq!((seen[399].0, seen[399].2), (1.0, Lanes { network: false, feedback: true }));
    assert_eq!((seen[799].0, seen[799].1, seen[799].2), (1.1, only(Trip::Late, [1, 0]), Lanes::BOTH));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Any bits as measurements and ages: finite corrections, at most one trip of a lane in a hold time, and the baseline's bits
    /// where no lane may act and the fade is over.
    #[test]
    fn whatever_comes_in_a_lane_trips_at_most_once_in_a_hold_time(
        raw in proptest::collection::vec(any::<[u32; 2]>(), 16),
        small in proptest::collection::vec(-0.3f32..0.3, 16),
        bad in any::<u32>(),
        period in 3i32..40,
        ages in proptest::collection::vec(0u16..13, 8),
        correction in -0.5f32..0.5,
    ) {
        let doing = |tick: i32| {
            let at = (tick / period).rem_euclid(16) as usize;
            let damaged = (bad >> at) & 1 == 1 && tick % 5 == 0;
            let measured = if damaged { raw[at].map(f32::from_bits) } else { [1.0 + small[at], small[15 - at]] };
            Doing { measured, age: ages[at % 8], ..calm(Lanes::BOTH) }
        };
        let settings = GuardSettings { hold_s: 0.5, ..GuardSettings::default() };
        let flight = fly(guarded(), [correction, 0.1], settings, 900, doing);
        prop_assert!(flight.iter().all(|tick| tick.correction.iter().all(|value| value.is_finite())));
        for lane in 0..2 {
            let trips = |at: usize| flight[at].trips.by_lane()[lane];
            let times: Vec<usize> = (1..flight.len()).filter(|&at| trips(at) > trips(at - 1)).collect();
            prop_assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= 50), "{times:?}");
        }
        // 15 ticks of handing over and the slew's longest way.
        for window in flight.windows(40) {
            if window.iter().all(|tick| tick.acting == Lanes::NONE) {
                let last = &window[39];
                prop_assert_eq!(bits(last.reference), bits(last.desired));
            }
        }
    }
}
