//! Training rows from the baseline loop under tones.
//!
//! *in* a plant, tones, a feature set, a seed; *out* [`Rows`]: features and target of randomly chosen samples, as many of each
//! tone; *never* a sample of which a feature would look beyond the run; *source* Zhou 2017, section V-A (balanced number of
//! randomly chosen points from each trajectory). The actual output y(t+k) stands where the desired one, y_d(t+k), stands in
//! flight.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::siso::{FeatureSet, Moment, Plant, Start, signal::Tone, simulate};

/// What is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Sampling period, s.
    pub period: f64,
    /// Rows of each tone.
    pub rows: usize,
    /// Shortest run of a tone, samples. Slow tones run for one cycle.
    pub least_samples: usize,
    /// Seed of the choice.
    pub seed: u64,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { period: crate::siso::fixtures::PERIOD, rows: 30, least_samples: 400, seed: 1 }
    }
}

/// Features and targets, one row a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// `[rows][features]`.
    pub inputs: DMatrix<f64>,
    /// u(t), less what the set's output is counted from.
    pub targets: DVector<f64>,
}

impl Rows {
    /// Rows of a list of features and targets.
    pub fn new(rows: &[(Vec<f64>, f64)]) -> Self {
        let columns = rows.first().map_or(0, |row| row.0.len());
        Self {
            inputs: DMatrix::from_fn(rows.len(), columns, |row, column| rows[row].0[column]),
            targets: DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1)),
        }
    }

    /// Smallest and largest value of each feature.
    pub fn envelope(&self) -> Vec<(f64, f64)> {
        self.inputs.column_iter().map(|column| (column.min(), column.max())).collect()
    }

    /// The rows' features in f32.
    pub fn narrow(&self) -> Vec<Vec<f32>> {
        self.inputs.row_iter().map(|row| row.iter().map(|value| *value as f32).collect()).collect()
    }
}

/// A reference, sample by sample.
pub type Reference = Box<dyn Fn(i64) -> f64 + Sync>;

/// Runs the plant under each reference (from rest, `samples` of them) and picks `rows` samples at random.
pub fn sample(plant: &impl Plant<f64>, set: &FeatureSet, references: &[(Reference, usize)], rows: usize, seed: u64) -> Rows {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut chosen = Vec::new();
    for (reference, samples) in references {
        let module = |moment: &Moment<'_, f64>| reference(moment.sample);
        let run = simulate(plant, &module, &|_| 0.0, &Start::rest(), *samples);
        let output =
            |sample: i64| usize::try_from(sample).map_or(0.0, |sample| run.output.get(sample).copied().unwrap_or(f64::NAN));
        let usable = samples.saturating_sub(set.preview());
        let mut indices: Vec<usize> = (0..rows).map(|_| random.random_range(0..usable.max(1))).collect();
        indices.sort_unstable();
        for index in indices {
            let moment = run.moment(index, &output);
            chosen.push((set.inputs(&moment), run.reference[index] - set.base(&moment)));
        }
    }
    Rows::new(&chosen)
}

/// Rows of tones.
pub fn sample_tones(plant: &impl Plant<f64>, set: &FeatureSet, tones: &[Tone], sampling: &Sampling) -> Rows {
    let period = sampling.period;
    let references: Vec<(Reference, usize)> = tones
        .iter()
        .map(|&tone| {
            let reference: Reference = Box::new(move |sample| tone.at(sample, period));
            (reference, tone.samples(period, sampling.least_samples))
        })
        .collect();
    sample(plant, set, &references, sampling.rows, sampling.seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{
        Module, fixtures,
        law::{StateSpaceLaw, TransferFunctionLaw},
        signal::tones,
    };

    #[test]
    fn rows_of_both_feature_sets_obey_the_exact_laws() {
        let sampling = Sampling { rows: 4, ..Sampling::default() };
        for system in [fixtures::minimum_phase(), fixtures::non_minimum_phase(), fixtures::position_and_difference(0.7)] {
            let (order, ahead) = (system.order(), system.relative_degree());
            let rows = sample_tones(&system, &FeatureSet::state_space(order, ahead), &tones(), &sampling);
            assert_eq!(rows.targets.len(), 100);
            let law = StateSpaceLaw::new(&system);
            for (row, target) in rows.inputs.row_iter().zip(&rows.targets) {
                let row: Vec<f64> = row.iter().copied().collect();
                let desired = |_| row[order];
                let moment = Moment { sample: 0, state: &row[..order], references: &[], desired: &desired };
                assert!((law.reference(&moment) - target).abs() < 1e-11);
            }
            let rows = sample_tones(&system, &FeatureSet::transfer_function(order, ahead), &tones(), &sampling);
            let law = TransferFunctionLaw::new(&system.transfer_function());
            for (row, target) in rows.inputs.row_iter().zip(&rows.targets) {
                let row: Vec<f64> = row.iter().copied().collect();
                let past: Vec<f64> = row[order + 1..].iter().rev().copied().collect();
                let desired = |sample: i64| row[(past.len() as i64 + ahead as i64 - sample) as usize];
                let moment = Moment { sample: past.len() as i64, state: &[], references: &past, desired: &desired };
                assert!((law.reference(&moment) - target).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_rows_and_another_one_others() {
        let system = fixtures::minimum_phase();
        let rows =
            |seed| sample_tones(&system, &FeatureSet::state_space(2, 1), &tones(), &Sampling { seed, ..Sampling::default() });
        assert_eq!(rows(3), rows(3));
        assert_ne!(rows(3), rows(4));
    }
}
