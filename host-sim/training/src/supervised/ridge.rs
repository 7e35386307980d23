//! Ridge regression in closed form: the linear map that the network has to beat, and the skip which it refines.
//!
//! With inputs standardised to s, labels y and row weights w of mean 1, the coefficients minimise
//! `mean(w · |y - intercept - B s|²) + penalty · |B|²` (Hoerl and Kennard, "Ridge regression", 1970). The intercept is not
//! penalised: it is the mean of the labels. Normal equations are summed up in f64, block by block.

use super::dataset::{Dataset, moments};
use impromptu_diagnosis::{cholesky::Factor, least_squares::Regression};
use impromptu_model_export::float_network::FloatNetwork;
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Rows that are brought into one matrix product: a block of 150 columns has 600 KB and stays in the cache.
const BLOCK_ROWS: usize = 512;

/// A linear map with intercept.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// Subtracted from each input, in its unit.
    pub input_mean: Vec<f64>,
    /// Divides each input, in its unit.
    pub input_scale: Vec<f64>,
    /// `outputs × inputs`, from standardised inputs to labels, in the labels' units.
    pub weights: DMatrix<f64>,
    /// The answer to the mean input, in the labels' units.
    pub intercept: Vec<f64>,
    /// Standard deviation of each label, in its unit.
    pub label_scale: Vec<f64>,
}

/// Why there is no ridge solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RidgeError {
    /// A negative or non-finite penalty.
    #[error("the ridge penalty is {0}; it must be zero or more")]
    Penalty(f64),
    /// The normal equations cannot be solved.
    #[error("inputs are linear combinations of each other and the penalty {penalty} is too small; raise it")]
    Singular {
        /// The penalty that was asked for.
        penalty: f64,
    },
}

impl Ridge {
    /// The solution for a data set; `penalty` is relative to the variance of a standardised input, which is 1.
    pub fn fit(data: &Dataset, penalty: f64) -> Result<Self, RidgeError> {
        if !penalty.is_finite() || penalty < 0.0 {
            return Err(RidgeError::Penalty(penalty));
        }
        let row_weights = data.relative_row_weights();
        let (input_mean, input_scale) = moments(data.inputs(), &row_weights);
        let (intercept, label_scale) = moments(data.labels(), &row_weights);
        let (inputs, labels) = (input_mean.len(), intercept.len());
        let mut regression = Regression::new(inputs, labels);
        for first in (0..data.rows()).step_by(BLOCK_ROWS) {
            let rows = BLOCK_ROWS.min(data.rows() - first);
            // One column for each row of data: both sides of the product are then filled in the order of memory.
            let standardised = DMatrix::from_fn(inputs, rows, |column, row| {
                (f64::from(data.inputs().row(first + row)[column]) - input_mean[column]) / input_scale[column]
            });
            let weights: Vec<f64> = row_weights[first..first + rows].iter().map(|weight| weight / data.rows() as f64).collect();
            let residual =
                DMatrix::from_fn(rows, labels, |row, label| f64::from(data.labels().row(first + row)[label]) - intercept[label]);
            regression.push_block(standardised.as_view(), &residual, Some(&weights));
        }
        let largest = regression.gram.diagonal().iter().fold(0.0f64, |largest, power| largest.max(*power));
        // A constant input has no column of its own; any positive number makes its weight zero.
        regression.penalise(|power| if power < 1e-9 { 1.0 } else { penalty });
        let factor = Factor::new(regression.gram).ok_or(RidgeError::Singular { penalty })?;
        // Rounding can leave a tiny positive pivot where the exact one is zero: its solution would be noise.
        if factor.smallest_pivot() < 1e-13 * largest {
            return Err(RidgeError::Singular { penalty });
        }
        let weights = factor.solve(&regression.cross).transpose();
        Ok(Self { input_mean, input_scale, weights, intercept, label_scale })
    }

    /// The answer in f64, in the labels' units.
    pub fn evaluate(&self, inputs: &[f32]) -> Vec<f64> {
        let standardised: Vec<f64> = inputs
            .iter()
            .zip(self.input_mean.iter().zip(&self.input_scale))
            .map(|(input, (mean, scale))| (f64::from(*input) - mean) / scale)
            .collect();
        let row = |index: usize| self.weights.row(index).iter().zip(&standardised).map(|(w, s)| w * s).sum::<f64>();
        self.intercept.iter().enumerate().map(|(index, intercept)| intercept + row(index)).collect()
    }

    /// The same map as a network of a skip and no layers.
    pub fn to_network(&self) -> FloatNetwork {
        let narrow = |values: &[f64]| values.iter().map(|value| *value as f32).collect::<Vec<_>>();
        let skip = self
            .weights
            .row_iter()
            .zip(&self.label_scale)
            .flat_map(|(row, scale)| row.iter().map(|weight| (weight / scale) as f32).collect::<Vec<_>>());
        FloatNetwork {
            input_mean: narrow(&self.input_mean),
            input_scale: narrow(&self.input_scale),
            layers: Vec::new(),
            skip: Some(skip.collect()),
            output_mean: narrow(&self.intercept),
            output_scale: narrow(&self.label_scale),
            notes: BTreeMap::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dataset::RowMatrix;
    use super::*;

    fn dataset(rows: usize, row: impl Fn(usize) -> (Vec<f32>, Vec<f32>)) -> Dataset {
        let (first_inputs, first_labels) = row(0);
        let (mut inputs, mut labels) = (RowMatrix::new(first_inputs.len()), RowMatrix::new(first_labels.len()));
        for index in 0..rows {
            let (x, y) = row(index);
            inputs.push(&x);
            labels.push(&y);
        }
        Dataset::new(inputs, labels).unwrap()
    }

    #[test]
    fn equals_the_solution_on_paper() {
        // Inputs 0 and 2 have mean 1 and deviation 1: s = ∓1, labels ±3 round 4, so b = 3 / (1 + penalty).
        let data = dataset(2, |row| (vec![2.0 * row as f32], vec![1.0 + 6.0 * row as f32]));
        let ridge = Ridge::fit(&data, 0.5).unwrap();
        assert_eq!(ridge.intercept, [4.0]);
        assert!((ridge.weights[(0, 0)] - 2.0).abs() < 1e-12);
        assert!((ridge.evaluate(&[2.0])[0] - 6.0).abs() < 1e-12);
        assert!((ridge.to_network().evaluate(&[2.0])[0] - 6.0).abs() < 1e-6);
        // A row of weight 3 counts as three rows.
        let heavy = dataset(3, |row| (vec![[0.0, 1.0, 5.0][row]], vec![[1.0, 0.0, 2.0][row]]));
        let repeated = dataset(5, |row| (vec![[0.0, 1.0, 5.0, 5.0, 5.0][row]], vec![[1.0, 0.0, 2.0, 2.0, 2.0][row]]));
        let weighted = Ridge::fit(&heavy.with_row_weights(vec![1.0, 1.0, 3.0]).unwrap(), 0.1).unwrap();
        assert!((weighted.weights[(0, 0)] - Ridge::fit(&repeated, 0.1).unwrap().weights[(0, 0)]).abs() < 1e-12);
    }

    #[test]
    fn recovers_a_linear_map_over_several_blocks() {
        let input = |row: usize, column: usize| ((row * (7 + 4 * column) + column) % 101) as f32 / 10.0;
        let data = dataset(1500, |row| {
            let x: Vec<f32> = (0..3).map(|column| input(row, column)).collect();
            let y = vec![2.0 * x[0] - x[1] + 3.0, x[2] * 0.5 - 7.0];
            ([&x[..], &[9.0]].concat(), y)
        });
        let ridge = Ridge::fit(&data, 0.0).unwrap();
        let answer = ridge.evaluate(&[1.0, 2.0, 4.0, 9.0]);
        assert!((answer[0] - 3.0).abs() < 1e-5 && (answer[1] + 5.0).abs() < 1e-5, "{answer:?}");
        assert_eq!(ridge.weights[(0, 3)], 0.0, "a constant input has no influence");
    }

    #[test]
    fn collinear_inputs_share_the_weight_or_are_refused() {
        let data = dataset(50, |row| {
            let x = (row % 13) as f32;
            (vec![x, 2.0 * x], vec![x])
        });
        assert_eq!(Ridge::fit(&data, 0.0), Err(RidgeError::Singular { penalty: 0.0 }));
        let ridge = Ridge::fit(&data, 1e-6).unwrap();
        assert!((ridge.weights[(0, 0)] - ridge.weights[(0, 1)]).abs() < 1e-6);
        assert!((ridge.evaluate(&[5.0, 10.0])[0] - 5.0).abs() < 1e-4);
        assert!(Ridge::fit(&data, -1.0).is_err());
    }
}
