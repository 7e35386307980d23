//! The add-on that a prediction is about: a linear window over the desired output, learned from a log.
//!
//! *in* a log, a window; *out* references for a desired output; *never* a state or a past reference as input, so that it stays bounded
//! whatever the zeros; *source* Zhou 2017, Insight 1 and Section V (difference learning), with y_d over a window in the place of the state.

use serde::Serialize;

use crate::{least_squares::Regression, record::Segment};

/// Which desired outputs the add-on sees, in ticks from now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Window {
    /// Ticks back.
    pub past: usize,
    /// Ticks ahead.
    pub preview: usize,
}

/// What inputs and output are relative to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Features {
    /// To the desired output now: difference learning. Needs a gain of one.
    Relative,
    /// To nothing.
    Absolute,
}

/// A trained add-on.
#[derive(Clone, Debug, PartialEq)]
pub struct AddOn {
    window: Window,
    features: Features,
    /// From the past to the preview, then the constant.
    weights: Vec<f64>,
}

/// Penalty of the ridge regression, relative to a column's mean square.
const PENALTY: f64 = 1e-7;

impl AddOn {
    /// Learns, row by row, which reference was in force when the measured output went along the window. `None` if the log is too short.
    pub fn fit<'a>(segments: impl IntoIterator<Item = &'a Segment>, window: Window, features: Features) -> Option<Self> {
        let columns = window.past + window.preview + 2;
        let mut regression = Regression::new(columns, 1);
        let mut row = vec![0.0; columns];
        let mut rows = 0;
        for Segment { reference, measured } in segments {
            for tick in window.past..measured.len().saturating_sub(window.preview) {
                let origin = if features == Features::Relative { measured[tick] } else { 0.0 };
                for (cell, value) in row.iter_mut().zip(&measured[tick - window.past..=tick + window.preview]) {
                    *cell = value - origin;
                }
                row[columns - 1] = 1.0;
                regression.push(&row, &[reference[tick] - origin]);
                rows += 1;
            }
        }
        let solution = (rows > 2 * columns).then(|| regression.solve(PENALTY))??;
        Some(Self { window, features, weights: solution.coefficients.iter().copied().collect() })
    }

    /// References for a desired output, which keeps its first and last value outside of its ends.
    pub fn references(&self, desired: &[f64]) -> Vec<f64> {
        let last = desired.len().saturating_sub(1);
        let constant = self.weights[self.weights.len() - 1];
        (0..desired.len())
            .map(|tick| {
                let origin = if self.features == Features::Relative { desired[tick] } else { 0.0 };
                let taps = self.weights.iter().take(self.window.past + self.window.preview + 1).enumerate();
                let inside = |index: usize| desired[(tick + index).saturating_sub(self.window.past).min(last)] - origin;
                origin + constant + taps.map(|(index, weight)| weight * inside(index)).sum::<f64>()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn log(gain: f64) -> Segment {
        // The loop answers two ticks later.
        let reference: Vec<f64> = (0..300).map(|tick| (f64::from(tick * tick % 97) / 30.0).sin()).collect();
        let measured = (0..300usize).map(|tick| gain * reference[tick.saturating_sub(2)]).collect();
        Segment { reference, measured }
    }

    proptest! {
        #[test]
        fn difference_learning_does_not_know_where_it_is(shift in -100.0f64..100.0) {
            let add_on = AddOn::fit(&[log(1.0)], Window { past: 2, preview: 4 }, Features::Relative).unwrap();
            let desired: Vec<f64> = (0..50).map(|tick| f64::from(tick % 11)).collect();
            let moved: Vec<f64> = desired.iter().map(|value| value + shift).collect();
            for (here, there) in add_on.references(&desired).iter().zip(add_on.references(&moved)) {
                prop_assert!((here + shift - there).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_pure_delay_with_a_gain_is_inverted() {
        let add_on = AddOn::fit(&[log(2.0)], Window { past: 2, preview: 4 }, Features::Absolute).unwrap();
        let desired: Vec<f64> = (0..50).map(|tick| f64::from(tick % 11)).collect();
        for (tick, found) in add_on.references(&desired).iter().enumerate().take(40) {
            assert!((found - desired[tick + 2] / 2.0).abs() < 1e-3);
        }
    }
}
