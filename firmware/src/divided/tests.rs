use super::*;
use crate::{
    caps::Cap,
    format::{Channel, EndRule},
    lanes::Lanes,
    math::sin_cos,
};
use proptest::prelude::*;

const MODEL: &[u8] = include_bytes!("../../examples/one_axis.impromptu");
const ANGLE: Channel<'_> = Channel { name: "angle", unit: "rad", frame: "output shaft", end: EndRule::Hold };
const SIGNALS: Channels<'_> = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };
const CAPS: Caps<'_> = Caps { channels: &[Cap { limit: 0.5, rate: 20.0 }], sums: &[] };
/// Rate of the model, Hz.
const RATE: f32 = 500.0;
/// Samples of the trajectory.
const PREVIEW: usize = 128;

type Servo<'m> = Divided<'m, 1, 1, 1, PREVIEW>;

fn divided<'m>(model: &'m Model<'m>, ticks: u16) -> Box<Servo<'m>> {
    let mut divided = Box::new(Servo::empty());
    divided.load(model, SIGNALS, RATE * f32::from(ticks), &CAPS).unwrap();
    divided
}

/// What is desired at a time of the loop, and of a machine that is some way behind.
fn desired(seconds: f32) -> f32 {
    0.8 - 0.8 * sin_cos(3.0 * seconds).1
}

/// Of each tick what is desired, the reference, and what the add-on itself corrects.
fn flown(ticks: u16, count: i32, lanes: impl Fn(f32) -> Lanes) -> Vec<[f32; 3]> {
    let model = Model::from_bytes(MODEL).unwrap();
    let mut divided = divided(&model, ticks);
    let mut scratch = Scratch::new();
    let seconds = |tick: i32| tick as f32 / (RATE * f32::from(ticks));
    let mut flight = Vec::new();
    for tick in 0..count {
        while divided.next_tick() <= tick + divided.ahead() {
            divided.push([desired(seconds(divided.next_tick()))]).unwrap();
        }
        divided.add_on_mut().switch(lanes(seconds(tick)));
        let now = desired(seconds(tick));
        let [reference] = divided.step(tick, &[now], &[desired(seconds(tick) - 0.05)], &mut scratch);
        flight.push([now, reference, divided.add_on().report().correction[0]]);
    }
    flight
}

#[test]
fn one_tick_to_a_tick_is_the_add_on_to_the_bit() {
    let model = Model::from_bytes(MODEL).unwrap();
    let mut plain = Box::new(AddOn::<1, 1, 1, PREVIEW>::new(&model, SIGNALS, RATE, &CAPS).unwrap());
    let mut scratch = Scratch::new();
    let lanes = |seconds: f32| if (0.2..2.0).contains(&seconds) { Lanes::BOTH } else { Lanes::NONE };
    let ahead = model.card().preview_span().1 as i32 + 1;
    for (tick, [_, reference, _]) in (0..).zip(flown(1, 1500, lanes)) {
        let seconds = |tick: i32| tick as f32 / RATE;
        while plain.next_tick() <= tick + ahead {
            plain.push([desired(seconds(plain.next_tick()))]).unwrap();
        }
        plain.switch(lanes(seconds(tick)));
        let [expected] = plain.step(tick, &[desired(seconds(tick) - 0.05)], &mut scratch);
        assert_eq!(expected.to_bits(), reference.to_bits(), "tick {tick}");
    }
}

#[test]
fn it_is_desired_to_the_bit_while_the_lanes_are_off_and_again_when_they_have_faded() {
    let acting = |seconds: f32| if (0.5..1.5).contains(&seconds) { Lanes::BOTH } else { Lanes::NONE };
    for ticks in [2, 4, 7] {
        let count = 4 * RATE as i32 * i32::from(ticks);
        let flight = flown(ticks, count, acting);
        let same = |part: &[[f32; 3]]| part.iter().all(|[now, reference, _]| now.to_bits() == reference.to_bits());
        assert!(same(&flight[..count as usize / 9]), "{ticks}: before");
        assert!(!same(&flight[count as usize / 4..count as usize / 3]), "{ticks}: nothing is corrected");
        assert!(same(&flight[3 * count as usize / 4..]), "{ticks}: after");
    }
}

#[test]
fn between_two_of_its_ticks_the_correction_is_ramped_by_its_slew_to_what_the_add_on_found() {
    let slew = Model::from_bytes(MODEL).unwrap().card().outputs[0].slew.min(20.0 / RATE);
    for ticks in [2u16, 4, 9] {
        let flight = flown(ticks, 2000 * i32::from(ticks), |_| Lanes::BOTH);
        let corrections: Vec<f32> = flight.iter().map(|[now, reference, _]| reference - now).collect();
        let most = corrections.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
        // A reference of 1.6 is known to 1e-7.
        assert!(most > 0.0 && most <= slew / f32::from(ticks) + 1e-6, "{ticks}: {most}");
        let last = usize::from(ticks) - 1;
        for (tick, [_, _, found]) in flight.iter().enumerate().filter(|(tick, _)| tick % usize::from(ticks) == last) {
            assert!((corrections[tick] - found).abs() < 1e-6, "{ticks}: tick {tick}: {} {found}", corrections[tick]);
        }
    }
}

#[test]
fn a_rate_that_is_no_multiple_is_refused_by_its_own_number_and_nothing_changes() {
    let model = Model::from_bytes(MODEL).unwrap();
    let mut add_on = divided(&model, 4);
    for rate in [1300.0, 400.0, 0.0, -500.0, f32::NAN, f32::INFINITY, 501.0 * RATE * 2.0] {
        let refusal = add_on.load(&model, SIGNALS, rate, &CAPS).unwrap_err();
        assert!(matches!(refusal, Refusal::Rate { model: RATE, application } if application.to_bits() == rate.to_bits()));
    }
    assert_eq!((add_on.divisor(), add_on.next_tick()), (4, 0));
    assert!(add_on.load(&model, SIGNALS, 1999.9, &CAPS).is_ok() && add_on.divisor() == 4);
}

#[test]
fn whatever_is_desired_and_measured_the_reference_is_a_number_and_begins_where_the_machine_is() {
    let model = Model::from_bytes(MODEL).unwrap();
    let mut add_on = divided(&model, 4);
    add_on.add_on_mut().switch(Lanes::BOTH);
    let mut scratch = Scratch::new();
    let first = add_on.step(0, &[f32::NAN], &[0.25], &mut scratch);
    assert_eq!(first, [0.25]);
    assert_eq!(add_on.step(1, &[0.5], &[0.25], &mut scratch), [0.5]);
    for (tick, wrong) in (2..).zip([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::NAN]) {
        assert_eq!(add_on.step(tick, &[wrong], &[wrong], &mut scratch), [0.5]);
    }
}

#[test]
fn samples_are_asked_for_at_every_kth_tick_also_of_a_trajectory_that_begins_later() {
    let model = Model::from_bytes(MODEL).unwrap();
    let mut add_on = divided(&model, 4);
    add_on.push([0.1]).unwrap();
    assert_eq!(add_on.next_tick(), 4);
    add_on.clear(9);
    assert_eq!(add_on.next_tick(), 12);
    add_on.clear(-5);
    assert_eq!(add_on.next_tick(), -4);
    add_on.push([0.1]).unwrap();
    add_on.truncate(-7);
    assert_eq!(add_on.next_tick(), -4);
}

proptest! {
    /// Also where ticks are left out, or the next values come too early: never a change beyond the slew's share of a tick. In
    /// order it ends where it should.
    #[test]
    fn a_ramp_never_jumps_and_ends_where_it_should(
        ticks in 1u16..20, slew in 1e-3f32..1.0,
        steps in prop::collection::vec((-1.0f32..1.0, 1u16..25), 1..40)
    ) {
        let mut ramp = Interpolator::<1>::new(ticks);
        let (mut target, mut last, mut late) = (0.0f32, 0.0f32, false);
        for (step, length) in steps {
            target += step * slew * if late { 0.0 } else { 0.999 };
            ramp.towards([target], &[slew]);
            for _ in 0..length {
                let [value] = ramp.advance();
                let most = slew / f32::from(ticks);
                prop_assert!((value - last).abs() <= most * 1.001 + 1e-6, "{} beyond {}", value - last, most);
                last = value;
            }
            late = length < ticks;
            prop_assert!(late || (last - target).abs() <= 1e-4 * slew + 1e-5, "{last} {target}");
        }
    }

    #[test]
    fn each_tick_of_the_slower_rate_is_due_once(ticks in 1u16..50, tick in -100_000i32..100_000) {
        let ramp = Interpolator::<1>::new(ticks);
        match ramp.due(tick) {
            Some(slow) => prop_assert_eq!(slow * i32::from(ticks), tick),
            None => prop_assert!(tick % i32::from(ticks) != 0),
        }
    }
}
