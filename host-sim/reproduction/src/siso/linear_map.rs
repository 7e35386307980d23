//! Ridge regression on the rows that the network learns from: the map which it has to beat.
//!
//! *in* rows and a penalty; *out* weights and an intercept; *never* a fit of rows that do not determine it; *source* Hoerl and Kennard 1970.

use nalgebra::{DMatrix, DVector};

use crate::siso::{FeatureSet, Module, Moment, Rows, normal_equations::solve};

/// A linear map of features.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearMap {
    /// One for each feature.
    pub weights: DVector<f64>,
    /// Output for features of zero.
    pub intercept: f64,
}

impl LinearMap {
    /// The map with the least mean squared error; `penalty` is relative to the mean variance of the features. `None` if the rows do not
    /// determine it.
    pub fn fit(rows: &Rows, penalty: f64) -> Option<Self> {
        let (inputs, targets) = (&rows.inputs, &rows.targets);
        let means = DVector::from_iterator(inputs.ncols(), inputs.column_iter().map(|column| column.mean()));
        let centred = DMatrix::from_fn(inputs.nrows(), inputs.ncols(), |row, column| inputs[(row, column)] - means[column]);
        let mean = targets.mean();
        let mut gram = centred.tr_mul(&centred);
        let added = penalty * gram.trace() / gram.nrows() as f64;
        gram.iter_mut().step_by(centred.ncols() + 1).for_each(|diagonal| *diagonal += added);
        let weights = solve(gram, &centred.tr_mul(&targets.add_scalar(-mean)))?;
        let intercept = mean - weights.dot(&means);
        Some(Self { weights, intercept })
    }

    /// Output of features.
    pub fn output(&self, inputs: &[f64]) -> f64 {
        self.intercept + self.weights.iter().zip(inputs).map(|(weight, input)| weight * input).sum::<f64>()
    }

    /// The map as the module of a loop.
    pub fn module<'a>(&'a self, set: &'a FeatureSet) -> impl Module<f64> + 'a {
        move |moment: &Moment<'_, f64>| self.output(&set.inputs(moment)) + set.base(moment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_law_is_found_exactly_and_a_penalty_shrinks_it() {
        let rows: Vec<(Vec<f64>, f64)> = (0..40)
            .map(|row| {
                let inputs = vec![libm::sin(f64::from(row)), libm::cos(f64::from(row * row)), 3.0 + f64::from(row % 7)];
                let target = 2.0 + inputs[0] - 3.0 * inputs[1] + 0.5 * inputs[2];
                (inputs, target)
            })
            .collect();
        let rows = Rows::new(&rows);
        let map = LinearMap::fit(&rows, 0.0).unwrap();
        assert!((map.output(&[1.0, 1.0, 1.0]) - 0.5).abs() < 1e-10);
        assert!(LinearMap::fit(&rows, 10.0).unwrap().weights.norm() < map.weights.norm());
        let constant = Rows::new(&vec![(vec![1.0, 1.0], 1.0); 5]);
        assert!(LinearMap::fit(&constant, 0.0).is_none());
    }
}
