//! Ridge regression on the rows that the network learns from: the map which it has to beat.
//!
//! *in* rows and a penalty; *out* weights and an intercept; *never* a fit of rows that do not determine it; *source* Hoerl and Kennard 1970.

use impromptu_diagnosis::{cholesky::Factor, least_squares::Regression};
use nalgebra::{DMatrix, DVector};

use crate::siso::{FeatureSet, Module, Moment, Rows};

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
        let differences = DMatrix::from_fn(targets.len(), 1, |row, _| targets[row] - mean);
        let mut regression = Regression::of_table(&centred, &differences);
        let added = penalty * regression.gram.trace() / centred.ncols() as f64;
        regression.penalise(|_| added);
        let weights = Factor::in_blocks(regression.gram)?.solve(&regression.cross.column(0));
        if !weights.iter().all(|weight| weight.is_finite()) {
            return None;
        }
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
