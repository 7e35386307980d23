//! Columns of a log, and figures of a column.
//!
//! *in* rows as a log has them; *out* columns of one length; *never* an order of rows that the log does not have; *source* ours.

/// Columns of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Line of each row in the file, from 1.
    pub lines: Vec<u64>,
    /// Time, in the unit of the log, then s.
    pub time: Vec<f64>,
    /// Reference.
    pub reference: Vec<f64>,
    /// Measured value.
    pub measured: Vec<f64>,
    /// Its rate of change, if the log has it.
    pub rate: Option<Vec<f64>>,
    /// What was desired, where that is not the reference.
    pub desired: Option<Vec<f64>>,
    /// Further columns, which are cut and filled as these.
    pub others: Vec<Vec<f64>>,
    /// Whether a time is written with a decimal point or an exponent, as seconds are.
    pub decimal: bool,
}

impl Columns {
    /// The same lines with every column through `change`.
    pub(crate) fn each(&self, lines: Vec<u64>, change: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            lines,
            time: change(&self.time),
            reference: change(&self.reference),
            measured: change(&self.measured),
            rate: self.rate.as_deref().map(&change),
            desired: self.desired.as_deref().map(&change),
            others: self.others.iter().map(|values| change(values)).collect(),
            decimal: self.decimal,
        }
    }
}

/// The middle one of values, 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The mean of values, 0 of none.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
