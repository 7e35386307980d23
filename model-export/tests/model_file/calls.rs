//! What holds for an add-on whatever is called, in whatever order, with whatever numbers.

use impromptu_firmware::{
    AddOn, Cap, Caps, Lanes,
    adapter::Inference,
    guard::GuardSettings,
    model::{DEFAULT_OUTPUTS, Interpolation, Model},
    network::Scratch,
};
use proptest::prelude::*;

use crate::{
    adapter::violent,
    fixture::{Numbers, table},
};

const CAPACITY: usize = 128;
type Cart<'m> = AddOn<'m, 2, 2, 2, CAPACITY>;
/// Narrower than the models' own.
const CAPS: Caps<'_> = Caps { channels: &[Cap { limit: 0.3, rate: 4.0 }, Cap { limit: 0.8, rate: 10.0 }], sums: &[] };

/// A call of an add-on in flight.
#[derive(Clone, Debug)]
enum Call {
    /// Reference ticks without a call between them.
    Gap(i32),
    Switch(Lanes),
    /// Ticks with a measurement of these bits.
    Measured([u32; 2], u8),
    /// The trajectory goes on somewhere else.
    Jump(f32),
    /// Samples from so many ticks ahead on are replaced.
    Replan(i32),
    /// The trajectory is forgotten.
    Clear,
    /// Another model, or none.
    Load(Option<bool>),
    Restart,
    Rearm,
    Guard(bool),
    Age(u16),
    Standing(u16),
    /// These measured channels have noise, and may stand for so many ticks.
    Noise(u8, u16),
    Airborne(bool),
    /// An inference that nobody asked for.
    Deliver(i32, u32),
    /// Ticks as they should be.
    Ticks(u8),
}

fn call() -> impl Strategy<Value = Call> {
    let lanes = (any::<bool>(), any::<bool>()).prop_map(|(network, feedback)| Lanes { network, feedback });
    prop_oneof![
        (0i32..200).prop_map(Call::Gap),
        lanes.prop_map(Call::Switch),
        (any::<[u32; 2]>(), 1u8..20).prop_map(|(bits, ticks)| Call::Measured(bits, ticks)),
        (-3f32..3.0).prop_map(Call::Jump),
        (-20i32..80).prop_map(Call::Replan),
        Just(Call::Clear),
        any::<Option<bool>>().prop_map(Call::Load),
        Just(Call::Restart),
        Just(Call::Rearm),
        any::<bool>().prop_map(Call::Guard),
        any::<u16>().prop_map(Call::Age),
        any::<u16>().prop_map(Call::Standing),
        (any::<u8>(), 0u16..20).prop_map(|(channels, ticks)| Call::Noise(channels, ticks)),
        any::<bool>().prop_map(Call::Airborne),
        (-3i32..3, any::<u32>()).prop_map(|(ahead, bits)| Call::Deliver(ahead, bits)),
        (1u8..60).prop_map(Call::Ticks),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// A flight has the same bits from every tick on.
    #[test]
    fn the_first_tick_may_have_any_number(
        seed in any::<u64>(), first in any::<i32>(), wrap in 0i32..150, linear in any::<bool>()
    ) {
        let interpolation = if linear { Interpolation::Linear } else { Interpolation::Hold };
        let (description, bytes) = violent(seed, interpolation);
        let model = Model::from_bytes(&bytes).unwrap();
        // Every other flight goes over the largest number.
        let first = if first % 2 == 0 { first } else { i32::MAX - wrap };
        let mut add_ons = [0, first].map(|first| {
            let mut add_on = Cart::new(&model, &table(&description), 100.0, &CAPS).unwrap();
            add_on.clear(first);
            add_on.switch(Lanes::BOTH);
            add_on
        });
        let (mut numbers, mut scratch) = (Numbers(seed), Scratch::new());
        let mut push = |add_ons: &mut [Cart<'_>; 2]| {
            let sample = [numbers.next(), numbers.next()];
            add_ons.iter_mut().for_each(|add_on| add_on.push(sample).unwrap());
        };
        (0..60).for_each(|_| push(&mut add_ons));
        let mut measure = Numbers(seed ^ 2);
        for tick in 0..200 {
            push(&mut add_ons);
            let measured = [measure.next(), measure.next()];
            let [here, there] = &mut add_ons;
            let there = there.step(first.wrapping_add(tick), &measured, &mut scratch);
            let here = here.step(tick, &measured, &mut scratch);
            prop_assert_eq!(here.map(f32::to_bits), there.map(f32::to_bits), "tick {}", tick);
        }
    }

    /// No call makes the correction larger than the application lets it be, or faster; the reference is always a number.
    #[test]
    fn no_call_moves_the_correction_beyond_the_applications_bounds(
        seed in any::<u64>(), first in any::<i32>(), calls in prop::collection::vec(call(), 1..60)
    ) {
        let files = [Interpolation::Linear, Interpolation::Hold].map(|interpolation| violent(seed, interpolation));
        let models = files.each_ref().map(|(_, bytes)| Model::from_bytes(bytes).unwrap());
        let signals = table(&files[0].0);
        let mut add_on = Cart::new(&models[0], &signals, 100.0, &CAPS).unwrap();
        add_on.clear(first);
        let (mut numbers, mut scratch) = (Numbers(seed), Scratch::new());
        let (mut tick, mut place, mut last) = (first, 0.0f32, [0.0f32; 2]);
        for call in calls {
            let (mut measured, mut ticks) = (None, 1);
            match call {
                Call::Gap(gap) => tick = tick.wrapping_add(gap),
                Call::Switch(lanes) => add_on.switch(lanes),
                Call::Measured(bits, count) => (measured, ticks) = (Some(bits.map(f32::from_bits)), count),
                Call::Jump(by) => place += by,
                Call::Replan(ahead) => add_on.truncate(tick.wrapping_add(ahead)),
                Call::Clear => add_on.clear(tick),
                Call::Load(Some(which)) => add_on.load(&models[usize::from(which)], &signals, 100.0, &CAPS).unwrap(),
                Call::Load(None) => add_on.bypass(&signals).unwrap(),
                Call::Restart => add_on.restart(tick),
                Call::Rearm => add_on.rearm(),
                Call::Guard(on) => add_on.set_guard(if on { GuardSettings::default() } else { GuardSettings::OFF }),
                Call::Age(age) => add_on.set_age(age),
                Call::Standing(ticks) => add_on.set_standing(ticks),
                Call::Noise(channels, ticks) => add_on.expect_noise((0..8).filter(|bit| channels >> bit & 1 == 1), ticks),
                Call::Airborne(airborne) => add_on.set_airborne(airborne),
                Call::Deliver(ahead, bits) => add_on.deliver(Inference {
                    tick: tick.wrapping_add(ahead),
                    outputs: [f32::from_bits(bits); DEFAULT_OUTPUTS],
                }),
                Call::Ticks(count) => ticks = count,
            }
            for _ in 0..ticks {
                if !add_on.has_trajectory() || add_on.next_tick().wrapping_sub(tick) < 0 {
                    add_on.clear(tick);
                }
                while add_on.next_tick().wrapping_sub(tick) < 40 && add_on.push([place, 0.3 * numbers.next()]).is_ok() {}
                let desired = add_on.desired(tick);
                let sample = measured.unwrap_or([place + 0.2 * numbers.next(), numbers.next()]);
                let reference = add_on.step(tick, &sample, &mut scratch);
                for ((reference, desired), (last, cap)) in reference.iter().zip(desired).zip(last.iter_mut().zip(CAPS.channels)) {
                    let correction = reference - desired;
                    let rounding = 1e-5;
                    prop_assert!(correction.abs() <= cap.limit + rounding, "{call:?} at {tick}: {correction}");
                    let change = (correction - *last).abs();
                    prop_assert!(change <= cap.rate / 100.0 + rounding, "{call:?} at {tick}: {last} to {correction}");
                    *last = correction;
                }
                tick = tick.wrapping_add(1);
            }
        }
    }
}
