//! Records of a channel: what was asked, what was measured, at a uniform rate.
//!
//! *in* columns of time, reference and measured value; *out* a [`Record`]; *never* a number that is not finite, nor time that is
//! not uniform: a few lost rows are filled, more is refused; *source* Zhou 2017, Fig. 1: u and y of the baseline.

use serde::Serialize;

/// A stretch without a gap.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Segment {
    /// Reference that the loop received, u.
    pub reference: Vec<f64>,
    /// Measured output, y; `measured[k]` was sampled when `reference[k]` was handed over, or before.
    pub measured: Vec<f64>,
}

/// Stretches of one channel at one rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    /// Time between samples, s.
    pub period_s: f64,
    /// Stretches.
    pub segments: Vec<Segment>,
}

/// Why columns are no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// Columns of different length.
    #[error("{time} times, {reference} references, {measured} measured values; every row needs all three")]
    Lengths {
        /// Rows of time.
        time: usize,
        /// Rows of the reference.
        reference: usize,
        /// Rows of the measured value.
        measured: usize,
    },
    /// A number that is not finite.
    #[error("row {row}: `{column}` is {value}, not a finite number; drop the row or cut the log there")]
    NotFinite {
        /// Row, from 0.
        row: usize,
        /// Which of the columns.
        column: &'static str,
        /// What stands there.
        value: f64,
    },
    /// Time that is not uniform.
    #[error(
        "row {row}: {found:.4} s after the row before, where {usual:.4} s are usual; resample the log to a uniform rate, or cut \
         it there"
    )]
    NotUniform {
        /// Row, from 0.
        row: usize,
        /// Time since the row before, s.
        found: f64,
        /// Median time between rows, s.
        usual: f64,
    },
    /// Too few rows.
    #[error("{rows} rows are too few: at least {needed} are needed, better some hundred responses long")]
    Short {
        /// Rows found.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// Records at different rates.
    #[error("one log has {0:.4} s between rows, another {1:.4} s; resample them to one rate")]
    Rates(f64, f64),
}

/// Fewest rows of a log.
pub const FEWEST_ROWS: usize = 60;
/// Largest deviation of a regular time step from the usual one, as a share of it.
pub(crate) const JITTER: f64 = 0.25;
/// Longest step, in usual ones, that lost rows may leave; the line between its ends fills it.
pub(crate) const LONGEST_GAP: f64 = 8.5;
/// Share of steps that may be irregular.
pub(crate) const MOST_UNEVEN: f64 = 0.03;

impl Record {
    /// A record of one stretch; the period is the median step.
    ///
    /// # Errors
    /// Names the first row that is wrong.
    pub fn new(time: &[f64], reference: &[f64], measured: &[f64]) -> Result<Self, RecordError> {
        let rows = time.len();
        if reference.len() != rows || measured.len() != rows {
            return Err(RecordError::Lengths { time: rows, reference: reference.len(), measured: measured.len() });
        }
        for (column, values) in [("time", time), ("reference", reference), ("measured", measured)] {
            if let Some((row, value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
                return Err(RecordError::NotFinite { row, column, value: *value });
            }
        }
        if rows < FEWEST_ROWS {
            return Err(RecordError::Short { rows, needed: FEWEST_ROWS });
        }
        let steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[sorted.len() / 2];
        let even = |step: f64| (step - usual).abs() <= JITTER * usual;
        let not_uniform = |row: usize| RecordError::NotUniform { row: row + 1, found: steps[row], usual };
        if let Some(row) = steps.iter().position(|step| usual <= 0.0 || *step <= 0.0 || *step > LONGEST_GAP * usual) {
            return Err(not_uniform(row));
        }
        let uneven = steps.iter().filter(|step| !even(**step)).count();
        if uneven as f64 > MOST_UNEVEN * steps.len() as f64 {
            return Err(not_uniform(steps.iter().position(|step| !even(*step)).unwrap_or(0)));
        }
        // The mean is exact where the median is one rounded step.
        let regular = || steps.iter().copied().filter(|step| even(*step));
        let period_s = regular().sum::<f64>() / regular().count() as f64;
        let segment = Segment { reference: reference.to_vec(), measured: measured.to_vec() };
        let segment = if uneven == 0 { segment } else { filled(time, &segment, period_s) };
        Ok(Self { period_s, segments: vec![segment] })
    }

    /// The record round the mean of its reference: a constant in both columns says nothing of the loop, and large ones cost
    /// digits.
    #[must_use]
    pub fn centred(mut self) -> Self {
        let mean = self.segments.iter().flat_map(|segment| &segment.reference).sum::<f64>() / self.len().max(1) as f64;
        for Segment { reference, measured } in &mut self.segments {
            reference.iter_mut().chain(measured).for_each(|value| *value -= mean);
        }
        self
    }

    /// All records as one.
    ///
    /// # Errors
    /// If there is none, or their rates differ.
    pub fn joined(records: impl IntoIterator<Item = Self>) -> Result<Self, RecordError> {
        let mut records = records.into_iter();
        let mut all = records.next().ok_or(RecordError::Short { rows: 0, needed: FEWEST_ROWS })?;
        for record in records {
            if (record.period_s / all.period_s - 1.0).abs() > 0.02 {
                return Err(RecordError::Rates(all.period_s, record.period_s));
            }
            all.segments.extend(record.segments);
        }
        Ok(all)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.segments.iter().map(|segment| segment.reference.len()).sum()
    }

    /// Samples of the shortest stretch.
    pub fn shortest(&self) -> usize {
        self.segments.iter().map(|segment| segment.reference.len()).min().unwrap_or(0)
    }

    /// Samples of the longest stretch.
    pub fn longest(&self) -> usize {
        self.segments.iter().map(|segment| segment.reference.len()).max().unwrap_or(0)
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The record at every `divisor`-th sample. Both columns go through the same zero-phase mean of `divisor` samples first,
    /// which leaves the relation of one to the other as it is and takes away what the slower rate cannot show.
    #[must_use]
    pub fn slower(&self, divisor: usize) -> Self {
        if divisor <= 1 {
            return self.clone();
        }
        let segments = self.segments.iter().map(|segment| Segment {
            reference: decimated(&segment.reference, divisor),
            measured: decimated(&segment.measured, divisor),
        });
        Self { period_s: self.period_s * divisor as f64, segments: segments.collect() }
    }

    /// Of each stretch the first part, `samples` in all at most; no part is shorter than [`FEWEST_ROWS`], if its stretch is not.
    #[must_use]
    pub fn shorter(mut self, samples: usize) -> Self {
        let all = self.len();
        if all > samples {
            for Segment { reference, measured } in &mut self.segments {
                let kept = (reference.len() * samples / all).max(FEWEST_ROWS);
                reference.truncate(kept);
                measured.truncate(kept);
            }
        }
        self
    }
}

/// The stretch at a uniform rate, by lines between its rows.
fn filled(time: &[f64], segment: &Segment, period_s: f64) -> Segment {
    let count = ((time[time.len() - 1] - time[0]) / period_s + 1e-6) as usize + 1;
    let places = places(time, period_s, count);
    Segment { reference: between(&segment.reference, &places), measured: between(&segment.measured, &places) }
}

/// Where the ticks of a uniform rate lie between rows: the row before, and which share of the way to the next.
pub(crate) fn places(time: &[f64], period_s: f64, count: usize) -> Vec<(usize, f64)> {
    let mut row = 0;
    let place = |tick: usize| {
        let now = time[0] + tick as f64 * period_s;
        while row + 2 < time.len() && time[row + 1] <= now {
            row += 1;
        }
        (row, ((now - time[row]) / (time[row + 1] - time[row])).clamp(0.0, 1.0))
    };
    (0..count).map(place).collect()
}

/// Values at places between rows, on straight lines.
pub(crate) fn between(values: &[f64], places: &[(usize, f64)]) -> Vec<f64> {
    places.iter().map(|&(row, share)| values[row] + share * (values[row + 1] - values[row])).collect()
}

/// Every `divisor`-th value of a mean of as many, centred on it.
pub fn decimated(values: &[f64], divisor: usize) -> Vec<f64> {
    // The half weights at the ends of an even mean keep it centred.
    let half = divisor as f64 / 2.0;
    let reach = half.floor() as usize;
    (0..values.len())
        .step_by(divisor)
        .map(|centre| {
            let (first, last) = (centre.saturating_sub(reach), (centre + reach).min(values.len() - 1));
            // A mean that is cut off on one side would be late or early there.
            let reach = (centre - first).min(last - centre);
            let weight = |at: usize| if divisor.is_multiple_of(2) && at.abs_diff(centre) == divisor / 2 { 0.5 } else { 1.0 };
            let range = centre - reach..=centre + reach;
            let total: f64 = range.clone().map(weight).sum();
            range.map(|at| weight(at) * values[at]).sum::<f64>() / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn time(rows: usize) -> Vec<f64> {
        (0..rows).map(|row| row as f64 * 0.01).collect()
    }

    #[test]
    fn what_is_wrong_with_a_log_is_named() {
        let good = vec![0.5; 100];
        assert_eq!(Record::new(&time(20), &good[..20], &good[..20]), Err(RecordError::Short { rows: 20, needed: 60 }));
        let mut bad = good.clone();
        bad[7] = f64::NAN;
        let message = Record::new(&time(100), &good, &bad).unwrap_err().to_string();
        assert!(message.contains("row 7") && message.contains("`measured`"), "{message}");
        let mut jumping = time(100);
        jumping.iter_mut().skip(30).for_each(|value| *value += 0.2);
        let message = Record::new(&jumping, &good, &good).unwrap_err().to_string();
        assert!(message.contains("row 30") && message.contains("resample"), "{message}");
        assert!(matches!(Record::new(&time(100), &good[1..], &good), Err(RecordError::Lengths { .. })));
    }

    #[test]
    fn a_few_lost_rows_are_filled() {
        let kept: Vec<f64> = time(300).into_iter().enumerate().filter(|(row, _)| row % 90 != 50).map(|(_, time)| time).collect();
        let values: Vec<f64> = kept.iter().map(|time| 3.0 * time).collect();
        let record = Record::new(&kept, &values, &values).unwrap();
        assert_eq!(record.len(), 300);
        assert!(record.segments[0].measured.windows(2).all(|pair| (pair[1] - pair[0] - 0.03).abs() < 1e-9));
    }

    proptest! {
        #[test]
        fn a_straight_line_stays_one_at_any_rate(slope in -3.0f64..3.0, divisor in 1usize..12) {
            let values: Vec<f64> = (0..200).map(|row| slope * f64::from(row)).collect();
            let record = Record::new(&time(200), &values, &values).unwrap().slower(divisor);
            for (index, value) in record.segments[0].reference.iter().enumerate() {
                prop_assert!((value - slope * (index * divisor) as f64).abs() < 1e-9);
            }
        }
    }
}
