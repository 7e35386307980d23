//! Transfer functions in z.
//!
//! *in* numerator and denominator; *out* poles, zeros, DC gain, relative degree; *never* a denominator that is not monic (those of
//! [`StateSpace`](crate::siso::StateSpace) are); *source* Zhou 2017, equation (8).

use impromptu_diagnosis::polynomial;
use nalgebra::Complex;

/// (β_{n-r} z^{n-r} + … + β_0) / (zⁿ + α_{n-1} z^{n-1} + … + α_0), highest power first.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    /// β_{n-r} … β_0, the first one not zero.
    pub numerator: Vec<f64>,
    /// 1, α_{n-1} … α_0.
    pub denominator: Vec<f64>,
}

impl TransferFunction {
    /// n.
    pub fn order(&self) -> usize {
        self.denominator.len() - 1
    }

    /// r.
    pub fn relative_degree(&self) -> usize {
        self.denominator.len() - self.numerator.len()
    }

    /// Roots of the denominator, by falling magnitude.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        polynomial::roots(&self.denominator)
    }

    /// Roots of the numerator, by falling magnitude.
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        polynomial::roots(&self.numerator)
    }

    /// The value at z = 1.
    pub fn dc_gain(&self) -> f64 {
        self.numerator.iter().sum::<f64>() / self.denominator.iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use crate::siso::{StateSpace, fixtures};

    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-9 * (1.0 + expected.abs())
    }

    #[test]
    fn the_papers_systems_have_the_poles_zeros_gains_and_relative_degree_that_it_states() {
        for (system, zero, gain) in
            [(fixtures::minimum_phase(), 0.2, 16.0 / 7.0), (fixtures::non_minimum_phase(), 1.002, -18.0 / 7.0)]
        {
            let transfer = system.transfer_function();
            assert_eq!((system.relative_degree(), transfer.relative_degree(), transfer.order()), (1, 1, 2));
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
