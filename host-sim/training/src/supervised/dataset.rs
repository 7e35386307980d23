//! Rows of inputs and labels.

/// A row-major f32 matrix that grows by rows.
#[derive(Debug, Clone, PartialEq)]
pub struct RowMatrix {
    columns: usize,
    values: Vec<f32>,
}

impl RowMatrix {
    /// No rows of `columns` values each.
    pub fn new(columns: usize) -> Self {
        Self { columns, values: Vec::new() }
    }

    /// Rows one after another; `None` unless the values fill whole rows.
    pub fn from_values(columns: usize, values: Vec<f32>) -> Option<Self> {
        (columns > 0 && values.len().is_multiple_of(columns)).then_some(Self { columns, values })
    }

    /// Adds one row.
    ///
    /// # Panics
    /// If the row has another number of columns.
    pub fn push(&mut self, row: &[f32]) {
        assert_eq!(row.len(), self.columns, "a row has as many values as the matrix has columns");
        self.values.extend_from_slice(row);
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.values.len().checked_div(self.columns).unwrap_or(0)
    }

    /// The number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row.
    pub fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.columns..][..self.columns]
    }

    /// All rows in order.
    pub fn iter(&self) -> impl Iterator<Item = &[f32]> {
        (0..self.rows()).map(|row| self.row(row))
    }

    /// All values, row after row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

/// Why rows are no data set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DatasetError {
    /// No rows, or rows without values.
    #[error("the data set is empty: {inputs} input columns, {labels} label columns, {rows} rows")]
    Empty {
        /// Columns of inputs.
        inputs: usize,
        /// Columns of labels.
        labels: usize,
        /// Rows.
        rows: usize,
    },
    /// Inputs, labels or row weights of different lengths.
    #[error("{rows} rows of inputs, but {found} {what}")]
    Length {
        /// Rows of inputs.
        rows: usize,
        /// What has another length.
        what: &'static str,
        /// Its length.
        found: usize,
    },
    /// A NaN, an infinity or a negative weight.
    #[error("row {row} of the {what} is not usable at column {column}: {value}")]
    Value {
        /// Which table.
        what: &'static str,
        /// The row, counted from 0.
        row: usize,
        /// The column, counted from 0.
        column: usize,
        /// What is there.
        value: f32,
    },
    /// All row weights are zero.
    #[error("all row weights are zero")]
    NoWeight,
}

/// Inputs, labels and optional weights of the rows; finite, of equal length, not empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    inputs: RowMatrix,
    labels: RowMatrix,
    row_weights: Option<Vec<f32>>,
}

impl Dataset {
    /// Rows of inputs with their labels, all of equal weight.
    pub fn new(inputs: RowMatrix, labels: RowMatrix) -> Result<Self, DatasetError> {
        let rows = inputs.rows();
        if rows == 0 || labels.columns() == 0 {
            return Err(DatasetError::Empty { inputs: inputs.columns(), labels: labels.columns(), rows });
        }
        if labels.rows() != rows {
            return Err(DatasetError::Length { rows, what: "rows of labels", found: labels.rows() });
        }
        for (what, table) in [("inputs", &inputs), ("labels", &labels)] {
            if let Some(index) = table.values().iter().position(|value| !value.is_finite()) {
                let (row, column) = (index / table.columns(), index % table.columns());
                return Err(DatasetError::Value { what, row, column, value: table.values()[index] });
            }
        }
        Ok(Self { inputs, labels, row_weights: None })
    }

    /// Weights of the rows, at least one above zero; only their ratios count.
    pub fn with_row_weights(mut self, weights: Vec<f32>) -> Result<Self, DatasetError> {
        if weights.len() != self.rows() {
            return Err(DatasetError::Length { rows: self.rows(), what: "row weights", found: weights.len() });
        }
        if let Some(row) = weights.iter().position(|weight| !weight.is_finite() || *weight < 0.0) {
            return Err(DatasetError::Value { what: "row weights", row, column: 0, value: weights[row] });
        }
        if weights.iter().all(|weight| *weight == 0.0) {
            return Err(DatasetError::NoWeight);
        }
        self.row_weights = Some(weights);
        Ok(self)
    }

    /// The number of rows, at least 1.
    pub fn rows(&self) -> usize {
        self.inputs.rows()
    }

    /// What the network sees.
    pub fn inputs(&self) -> &RowMatrix {
        &self.inputs
    }

    /// What it shall answer.
    pub fn labels(&self) -> &RowMatrix {
        &self.labels
    }

    /// The weight of a row, scaled so that the mean over all rows is 1.
    pub fn relative_row_weights(&self) -> Vec<f64> {
        let Some(weights) = &self.row_weights else {
            return vec![1.0; self.rows()];
        };
        let mean = weights.iter().map(|weight| f64::from(*weight)).sum::<f64>() / weights.len() as f64;
        weights.iter().map(|weight| f64::from(*weight) / mean).collect()
    }
}

/// The weighted mean and standard deviation of each column; a column which does not vary has the deviation 1.
pub(super) fn moments(table: &RowMatrix, row_weights: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let total: f64 = row_weights.iter().sum();
    let weighted = |value: &dyn Fn(usize, f64) -> f64| {
        let mut sums = vec![0.0; table.columns()];
        for (row, weight) in table.iter().zip(row_weights) {
            for (column, (sum, number)) in sums.iter_mut().zip(row).enumerate() {
                *sum += weight * value(column, f64::from(*number));
            }
        }
        sums.iter_mut().for_each(|sum| *sum /= total);
        sums
    };
    let means = weighted(&|_, number| number);
    let variances = weighted(&|column, number| (number - means[column]).powi(2));
    let scales = means.iter().zip(variances).map(|(mean, variance)| {
        let deviation = variance.sqrt();
        // Below the resolution of f32 the column is a constant with rounding noise.
        if deviation > 1e-6 * mean.abs() && deviation > 1e-20 { deviation } else { 1.0 }
    });
    let scales = scales.collect();
    (means, scales)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: usize, values: &[f32]) -> RowMatrix {
        RowMatrix::from_values(columns, values.to_vec()).unwrap()
    }

    #[test]
    fn refuses_unusable_rows_by_name() {
        let labels = table(1, &[1.0, 2.0]);
        let error = |inputs: RowMatrix| Dataset::new(inputs, labels.clone()).unwrap_err().to_string();
        assert!(error(table(2, &[1.0, 2.0, 3.0, f32::NAN])).contains("row 1 of the inputs is not usable at column 1"));
        assert!(error(table(1, &[1.0])).contains("1 rows of inputs, but 2 rows of labels"));
        assert!(error(RowMatrix::new(3)).contains("empty"));
        assert!(RowMatrix::from_values(2, vec![1.0; 3]).is_none());
        let data = Dataset::new(table(1, &[1.0, 2.0]), labels).unwrap();
        assert!(data.clone().with_row_weights(vec![1.0, -1.0]).unwrap_err().to_string().contains("row 1 of the row weights"));
        assert_eq!(data.clone().with_row_weights(vec![0.0; 2]), Err(DatasetError::NoWeight));
        assert_eq!(data.with_row_weights(vec![1.0, 3.0]).unwrap().relative_row_weights(), [0.5, 1.5]);
    }

    #[test]
    fn moments_are_weighted_and_constants_have_unit_scale() {
        let (means, scales) = moments(&table(2, &[1.0, 5.0, 3.0, 5.0]), &[3.0, 1.0]);
        assert_eq!(means, [1.5, 5.0]);
        assert!((scales[0] - 0.75f64.sqrt()).abs() < 1e-12 && scales[1] == 1.0);
    }
}
