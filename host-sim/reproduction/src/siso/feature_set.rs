//! Inputs and output of the module, as data: the firmware's features, evaluated in any float.
//!
//! *in* a list of firmware [`Feature`]s and a [`Moment`]; *out* one number each; *never* another meaning than the firmware's: in
//! f32 both evaluators give the same bits; *source* Zhou 2017, Insight 2 (two feature sets) and Insight 3 (difference learning).
//!
//! Signals: desired channel 0 is y_d, measured channels are the states, reference channel 0 is u; offsets are samples.

use impromptu_firmware::features::{Feature, Relative, Source};

use crate::siso::{Moment, Scalar};

/// What a network reads, and from where its output is counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureSet {
    /// Inputs, in the network's order.
    pub features: Vec<Feature>,
    /// Added to the network's output to make the reference.
    pub output: Relative,
}

fn feature(source: Source, channel: usize, offset: i64) -> Feature {
    Feature { source, channel: channel as u8, offset: offset as i16, relative: Relative::Nothing }
}

impl FeatureSet {
    /// {x(t), y_d(t+r)}, n + 1 of them.
    pub fn state_space(order: usize, relative_degree: usize) -> Self {
        let states = (0..order).map(|channel| feature(Source::Measured, channel, 0));
        Self::absolute(states.chain([feature(Source::Desired, 0, relative_degree as i64)]))
    }

    /// {y_d(t+r) … y_d(t+r-n), u(t-1) … u(t-n+r)}, 2n - r + 1 of them.
    pub fn transfer_function(order: usize, relative_degree: usize) -> Self {
        let (order, ahead) = (order as i64, relative_degree as i64);
        let desired = (0..=order).map(|lag| feature(Source::Desired, 0, ahead - lag));
        Self::absolute(desired.chain((1..=order - ahead).map(|lag| feature(Source::Reference, 0, -lag))))
    }

    /// {y_d(t+from) … y_d(t+to)} every `step` samples: it sees neither state nor past.
    pub fn window(from: i64, to: i64, step: usize) -> Self {
        Self::absolute((from..=to).step_by(step.max(1)).map(|offset| feature(Source::Desired, 0, offset)))
    }

    fn absolute(features: impl IntoIterator<Item = Feature>) -> Self {
        Self { features: features.into_iter().collect(), output: Relative::Nothing }
    }

    /// Difference learning: y_d(t) is subtracted from desired outputs, past references, the first state and the network's output.
    #[must_use]
    pub fn difference(mut self) -> Self {
        for feature in &mut self.features {
            if feature.source != Source::Measured || feature.channel == 0 {
                feature.relative = Relative::Desired(0);
            }
        }
        self.output = Relative::Desired(0);
        self
    }

    /// Largest number of samples by which a feature looks ahead.
    pub fn preview(&self) -> usize {
        let ahead = self.features.iter().filter(|feature| feature.source == Source::Desired).map(|feature| feature.offset);
        ahead.max().unwrap_or(0).max(0) as usize
    }

    /// Largest number of samples by which a feature looks back.
    pub fn history(&self) -> usize {
        self.features.iter().map(|feature| -feature.offset).max().unwrap_or(0).max(0) as usize
    }

    /// The features' values.
    pub fn inputs<T: Scalar>(&self, moment: &Moment<'_, T>) -> Vec<T> {
        self.features.iter().map(|feature| value(feature, moment) - origin(feature.relative, moment)).collect()
    }

    /// The features' values as the microcontroller computes them: of signals rounded to f32.
    pub fn narrow_inputs<T: Scalar>(&self, moment: &Moment<'_, T>) -> Vec<f32> {
        let narrow = |value: T| value.wide() as f32;
        let features = self.features.iter();
        features.map(|feature| narrow(value(feature, moment)) - narrow(origin(feature.relative, moment))).collect()
    }

    /// What is added to the network's output.
    pub fn base<T: Scalar>(&self, moment: &Moment<'_, T>) -> T {
        origin(self.output, moment)
    }
}

fn value<T: Scalar>(feature: &Feature, moment: &Moment<'_, T>) -> T {
    match feature.source {
        Source::Desired => moment.desired(feature.offset.into()),
        Source::Measured => moment.state(feature.channel.into()),
        Source::Reference => moment.reference(feature.offset.into()),
    }
}

fn origin<T: Scalar>(relative: Relative, moment: &Moment<'_, T>) -> T {
    match relative {
        Relative::Nothing => T::of(0.0),
        Relative::Desired(_) => moment.desired(0),
        Relative::Measured(channel) => moment.state(channel.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use impromptu_firmware::features::{Signals, evaluate};
    use proptest::prelude::*;

    struct Firmware<'a>(&'a Moment<'a, f32>);

    impl Signals for Firmware<'_> {
        fn desired(&self, tick: i32, _: usize) -> f32 {
            (self.0.desired)(tick.into())
        }

        fn measured(&self, _: i32, channel: usize) -> f32 {
            self.0.state(channel)
        }

        fn reference(&self, tick: i32, _: usize) -> f32 {
            self.0.reference(i64::from(tick) - self.0.sample)
        }
    }

    #[test]
    fn the_sets_have_as_many_features_as_insight_2_counts() {
        for (order, relative_degree) in [(2, 1), (2, 2), (5, 3)] {
            assert_eq!(FeatureSet::state_space(order, relative_degree).features.len(), order + 1);
            assert_eq!(FeatureSet::transfer_function(order, relative_degree).features.len(), 2 * order - relative_degree + 1);
        }
    }

    proptest! {
        #[test]
        fn the_firmware_evaluates_the_same_features_to_the_same_bits(
            state in proptest::collection::vec(-9.0..9.0f32, 2), past in proptest::collection::vec(-9.0..9.0f32, 6),
            phase in 0.0..6.0f32
        ) {
            let desired = |sample: i64| phase + (sample * sample) as f32 * 0.3;
            let moment = Moment { sample: 6, state: &state, references: &past, desired: &desired };
            for set in [FeatureSet::state_space(2, 1), FeatureSet::transfer_function(3, 1), FeatureSet::window(-2, 8, 2)] {
                for set in [set.clone(), set.difference()] {
                    let mut flown = vec![0.0; set.features.len()];
                    evaluate(&set.features, &Firmware(&moment), 6, 1, &mut flown);
                    prop_assert_eq!(flown, set.inputs(&moment));
                }
            }
        }

        #[test]
        fn difference_learning_is_translation_invariant(
            shift in -50.0..50.0f64, velocity in -2.0..2.0f64, position in -3.0..3.0f64
        ) {
            let set = FeatureSet::state_space(2, 2).difference();
            let plain = |sample: i64| 0.1 * sample as f64;
            let shifted = |sample: i64| plain(sample) + shift;
            let state = [[position, velocity], [position + shift, velocity]];
            let at = |state: &[f64; 2], desired: &dyn Fn(i64) -> f64| {
                let moment = Moment { sample: 4, state, references: &[], desired };
                (set.inputs(&moment), set.base(&moment))
            };
            let ((inputs, base), (moved, moved_base)) = (at(&state[0], &plain), at(&state[1], &shifted));
            prop_assert!(inputs.iter().zip(&moved).all(|(a, b)| (a - b).abs() < 1e-12));
            prop_assert!((moved_base - base - shift).abs() < 1e-12);
        }
    }
}
