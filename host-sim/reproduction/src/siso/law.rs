//! The exact laws that a network should learn.
//!
//! *in* a linear system; *out* modules that give y(t+r) = y_d(t+r); *never* a division by zero: a [`StateSpace`] has c A^(r-1) b ≠ 0;
//! *source* Zhou 2017, equations (4) and (9): state-space and transfer-function law, in f32 or f64.

use impromptu_diagnosis::transfer_function::TransferFunction;
use nalgebra::RowDVector;

use crate::siso::{Module, Moment, Scalar, StateSpace};

/// u = (y_d(t+r) - c A^r x) / (c A^(r-1) b).
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpaceLaw<T: Scalar> {
    row: RowDVector<T>,
    gain: T,
    relative_degree: usize,
}

impl<T: Scalar> StateSpaceLaw<T> {
    /// The law of a system, with its coefficients computed in `T`.
    pub fn new(system: &StateSpace<T>) -> Self {
        let (row, gain) = system.output_ahead();
        Self { row, gain, relative_degree: system.relative_degree() }
    }
}

impl<T: Scalar> Module<T> for StateSpaceLaw<T> {
    fn reference(&self, moment: &Moment<'_, T>) -> T {
        let free = self.row.iter().zip(moment.state).fold(T::of(0.0), |sum, (weight, value)| sum + *weight * *value);
        (moment.desired(self.relative_degree as i64) - free) / self.gain
    }
}

/// β_{n-r} u(t) = y_d(t+r) + α_{n-1} y_d(t+r-1) + … + α_0 y_d(t+r-n) - β_{n-r-1} u(t-1) - … - β_0 u(t-n+r). It sees no state.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunctionLaw<T: Scalar> {
    numerator: Vec<T>,
    denominator: Vec<T>,
    relative_degree: usize,
}

impl<T: Scalar> TransferFunctionLaw<T> {
    /// The law of a transfer function without offset, whose dead time is its relative degree.
    pub fn new(transfer: &TransferFunction) -> Self {
        let round = |values: &[f64]| values.iter().map(|value| T::of(*value)).collect();
        Self {
            numerator: round(&transfer.numerator),
            denominator: round(&transfer.denominator),
            relative_degree: transfer.dead_time,
        }
    }
}

impl<T: Scalar> Module<T> for TransferFunctionLaw<T> {
    fn reference(&self, moment: &Moment<'_, T>) -> T {
        let ahead = self.relative_degree as i64;
        let desired = self.denominator.iter().enumerate();
        let desired = desired.fold(T::of(0.0), |sum, (lag, weight)| sum + *weight * moment.desired(ahead - lag as i64));
        let past = self.numerator.iter().enumerate().skip(1);
        past.fold(desired, |sum, (lag, weight)| sum - *weight * moment.reference(-(lag as i64))) / self.numerator[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{Start, fixtures, simulate};
    use proptest::prelude::*;

    fn desired<T: Scalar>(sample: i64) -> T {
        T::of(fixtures::test_trajectory(sample as f64 * fixtures::PERIOD))
    }

    #[test]
    fn both_exact_laws_track_the_minimum_phase_system_to_rounding_in_f64_and_f32() {
        let (system, samples) = (fixtures::minimum_phase(), fixtures::test_samples(fixtures::PERIOD));
        let transfer = system.transfer_function();
        let wide = simulate(&system, &StateSpaceLaw::new(&system), &desired, &Start::rest(), samples);
        assert!(wide.tracking_rms(0) < 1e-15, "{}", wide.tracking_rms(0));
        let wide = simulate(&system, &TransferFunctionLaw::new(&transfer), &desired, &Start::rest(), samples);
        assert!(wide.tracking_rms(0) < 1e-15, "{}", wide.tracking_rms(0));
        let narrow = system.cast::<f32>();
        let run = simulate(&narrow, &StateSpaceLaw::new(&narrow), &desired, &Start::rest(), samples);
        assert!((1e-9..2e-7).contains(&run.tracking_rms(0)), "{}", run.tracking_rms(0));
        let run = simulate(&narrow, &TransferFunctionLaw::new(&transfer), &desired, &Start::rest(), samples);
        assert!((1e-9..4e-7).contains(&run.tracking_rms(0)), "{}", run.tracking_rms(0));
    }

    #[test]
    fn the_exact_law_loses_the_non_minimum_phase_system_within_16_thousand_samples_in_f64_and_6_thousand_in_f32() {
        let system = fixtures::non_minimum_phase();
        let wide = simulate(&system, &StateSpaceLaw::new(&system), &desired, &Start::rest(), 20_000);
        let narrow = system.cast::<f32>();
        let narrow = simulate(&narrow, &StateSpaceLaw::new(&narrow), &desired, &Start::rest(), 20_000);
        let lost = (wide.first_error_above(1.0), narrow.first_error_above(1.0));
        assert!(matches!(lost, (Some(13_000..=17_000), Some(4_000..=6_500))), "{lost:?}");
    }

    proptest! {
        #[test]
        fn the_state_space_law_removes_any_initial_error_in_r_samples(first in -5.0..5.0f64, second in -5.0..5.0f64) {
            for system in [fixtures::minimum_phase(), fixtures::position_and_difference(1.0)] {
                let start = Start { state: vec![first, second], ..Start::rest() };
                let run = simulate(&system, &StateSpaceLaw::new(&system), &desired, &start, 50);
                prop_assert!(run.tracking_rms(system.relative_degree()) < 1e-13);
            }
        }
    }
}
