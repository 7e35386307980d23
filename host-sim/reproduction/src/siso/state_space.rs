//! Linear systems x(t+1) = A x(t) + b u(t), y(t) = c x(t).
//!
//! *in* A, b, c; *out* relative degree, poles, zeros, DC gain, transfer function, and the system as a [`Plant`] in f32 or f64; *never* a
//! relative degree beyond the order (there is none for a system without input); *source* Zhou 2017, equation (1) and the definition below it.

use impromptu_diagnosis::transfer_function::TransferFunction;
use nalgebra::{Complex, DMatrix, DVector, RowDVector};

use crate::siso::{Plant, Scalar};

/// Why three matrices are no system.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SystemError {
    /// Shapes do not fit together.
    #[error("A has {a} numbers, b {b} and c {c}; a system of order n needs n², n and n")]
    Shape {
        /// Numbers in A.
        a: usize,
        /// Numbers in b.
        b: usize,
        /// Numbers in c.
        c: usize,
    },
    /// A NaN or an infinity.
    #[error("a coefficient is not finite")]
    NotFinite,
    /// The output never follows the reference.
    #[error("the reference never reaches the output (c A^(k-1) b = 0 up to the order): an add-on can do nothing")]
    NoRelativeDegree,
}

/// A discrete-time system of one reference and one output.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace<T: Scalar = f64> {
    a: DMatrix<T>,
    b: DVector<T>,
    c: RowDVector<T>,
    relative_degree: usize,
}

/// Markov parameters below this share of the largest one are rounding, not a path from reference to output.
const NEGLIGIBLE: f64 = 1e-12;

impl StateSpace {
    /// A system from A (row by row), b and c.
    ///
    /// # Errors
    /// If shapes do not fit, numbers are not finite, or the output does not depend on the reference.
    pub fn new(a: &[f64], b: &[f64], c: &[f64]) -> Result<Self, SystemError> {
        let order = b.len();
        if order == 0 || a.len() != order * order || c.len() != order {
            return Err(SystemError::Shape { a: a.len(), b: b.len(), c: c.len() });
        }
        if a.iter().chain(b).chain(c).any(|value| !value.is_finite()) {
            return Err(SystemError::NotFinite);
        }
        let mut system = Self {
            a: DMatrix::from_row_slice(order, order, a),
            b: DVector::from_column_slice(b),
            c: RowDVector::from_row_slice(c),
            relative_degree: 0,
        };
        let markov = system.markov(order);
        let largest = markov.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        let first = markov.iter().position(|value| value.abs() > largest * NEGLIGIBLE).ok_or(SystemError::NoRelativeDegree)?;
        system.relative_degree = first + 1;
        Ok(system)
    }

    /// The first `count` Markov parameters c b, c A b, c A² b, …: the response to a pulse, from the step after it.
    pub fn markov(&self, count: usize) -> Vec<f64> {
        let mut state = self.b.clone();
        (0..count)
            .map(|_| {
                let output = (&self.c * &state)[0];
                state = &self.a * &state;
                output
            })
            .collect()
    }

    /// Eigenvalues of A, by falling magnitude.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.transfer_function().poles()
    }

    /// Zeros of the transfer function, by falling magnitude.
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        self.transfer_function().zeros()
    }

    /// Whether all zeros lie inside of the unit circle: the inverse is stable (Insight 1b).
    pub fn is_minimum_phase(&self) -> bool {
        self.zeros().iter().all(|zero| zero.norm() < 1.0)
    }

    /// Output over a constant reference, in the long run.
    pub fn dc_gain(&self) -> f64 {
        self.transfer_function().gain()
    }

    /// The transfer function, by the method of Leverrier and Faddeev for the denominator and the Markov parameters for the numerator.
    pub fn transfer_function(&self) -> TransferFunction {
        let order = self.order();
        let mut denominator = vec![1.0];
        let mut product = DMatrix::identity(order, order);
        for step in 1..=order {
            let next = &self.a * &product;
            let coefficient = -next.trace() / step as f64;
            denominator.push(coefficient);
            product = next + DMatrix::identity(order, order) * coefficient;
        }
        let markov = self.markov(order);
        // Numerator power n-k of z: sum of denominator coefficients times Markov parameters; zero below the relative degree.
        let numerator = (self.relative_degree..=order)
            .map(|power| (0..power).map(|lag| denominator[lag] * markov[power - 1 - lag]).sum())
            .collect();
        TransferFunction { dead_time: self.relative_degree, numerator, denominator, offset: 0.0 }
    }

    /// The same system with coefficients rounded to `T`.
    pub fn cast<T: Scalar>(&self) -> StateSpace<T> {
        StateSpace { a: self.a.map(T::of), b: self.b.map(T::of), c: self.c.map(T::of), relative_degree: self.relative_degree }
    }
}

impl<T: Scalar> StateSpace<T> {
    /// Smallest r with c A^(r-1) b not zero: samples from a change of the reference to its effect on the output.
    pub fn relative_degree(&self) -> usize {
        self.relative_degree
    }

    /// c A^r (n numbers) and c A^(r-1) b: how the output in r samples depends on state and reference.
    pub fn output_ahead(&self) -> (RowDVector<T>, T) {
        let mut row = self.c.clone();
        for _ in 1..self.relative_degree {
            row = &row * &self.a;
        }
        let gain = (&row * &self.b)[0];
        (&row * &self.a, gain)
    }
}

impl<T: Scalar> Plant<T> for StateSpace<T> {
    fn order(&self) -> usize {
        self.b.len()
    }

    fn output(&self, state: &[T]) -> T {
        self.c.iter().zip(state).fold(T::of(0.0), |sum, (weight, value)| sum + *weight * *value)
    }

    fn advance(&self, state: &mut [T], reference: T) {
        let next = &self.a * DVector::from_column_slice(state) + &self.b * reference;
        state.copy_from_slice(next.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::fixtures;

    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-9 * (1.0 + expected.abs())
    }

    #[test]
    fn the_papers_systems_have_the_poles_zeros_gains_and_relative_degree_that_it_states() {
        for (system, zero, gain) in
            [(fixtures::minimum_phase(), 0.2, 16.0 / 7.0), (fixtures::non_minimum_phase(), 1.002, -18.0 / 7.0)]
        {
            let transfer = system.transfer_function();
            assert_eq!((system.relative_degree(), transfer.dead_time, transfer.order()), (1, 1, 2));
            assert!(close(system.poles()[0].re, 0.5) && close(system.poles()[1].re, 0.3));
            assert!(close(system.zeros()[0].re, zero), "{:?}", system.zeros());
            assert!(close(system.dc_gain(), gain), "{}", system.dc_gain());
            assert_eq!(system.is_minimum_phase(), zero < 1.0);
        }
    }

    #[test]
    fn a_chain_of_delays_has_its_length_as_relative_degree_and_no_input_has_none() {
        let chain = StateSpace::new(&[0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &[0.0, 0.0, 2.0], &[1.0, 0.0, 0.0]).unwrap();
        assert_eq!((chain.relative_degree(), chain.dc_gain()), (3, 2.0));
        assert!(chain.zeros().is_empty());
        assert!(StateSpace::new(&[0.5], &[0.0], &[1.0]).is_err());
    }
}
