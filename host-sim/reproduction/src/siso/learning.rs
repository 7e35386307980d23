//! From a plant to a module that flies, and how good it is.
//!
//! *in* a plant, features, settings; *out* a [`Learned`] network with its model files, and an [`Assessment`] of a module in the
//! loop; *never* a choice by the test trajectory: among restarts the f32 kernel's error on other samples of the tones decides;
//! *source* Zhou 2017, section V.

use impromptu_model_export::{ExportError, Precision};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::siso::{
    FeatureSet, FirmwareModule, Module, Network, NetworkModule, Plant, Rows, Run, Start,
    deployment::model_file,
    levenberg_marquardt::{self, Fit, train},
    samples::{Sampling, sample_tones},
    signal::tones,
    simulate,
    simulation::rms,
};

/// How a module is learned from tones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Rows.
    pub sampling: Sampling,
    /// Training.
    pub training: levenberg_marquardt::Settings,
    /// Networks that are trained, each from other hidden layers.
    pub restarts: usize,
    /// Seed of everything random.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { sampling: Sampling::default(), training: levenberg_marquardt::Settings::default(), restarts: 4, seed: 1 }
    }
}

/// A trained network with all that it needs to fly.
#[derive(Clone, Debug)]
pub struct Learned {
    /// What it reads.
    pub set: FeatureSet,
    /// What it was trained on.
    pub rows: Rows,
    /// The network and its training.
    pub fit: Fit,
    /// RMS error of the f32 kernel on held-out samples, in the reference's unit.
    pub held_out: f64,
}

impl Learned {
    /// The network.
    pub fn network(&self) -> &Network {
        &self.fit.network
    }

    /// The network in front of a plant, in f64.
    pub fn module(&self) -> NetworkModule<'_> {
        NetworkModule { set: &self.set, network: self.network() }
    }

    /// The firmware's model file.
    ///
    /// # Errors
    /// If the firmware would refuse it.
    pub fn file(&self, precision: Precision, period: f64) -> Result<Vec<u8>, ExportError> {
        model_file(self.network(), &self.set, &self.rows, precision, period)
    }
}

/// Trains restarts on the paper's tones, on all cores, and keeps the one that serves the f32 kernel best.
///
/// # Errors
/// If the firmware would refuse the network.
pub fn learn(plant: &impl Plant<f64>, set: &FeatureSet, settings: &Settings) -> Result<Learned, ExportError> {
    let sampling = Sampling { seed: settings.seed, ..settings.sampling };
    let rows = sample_tones(plant, set, &tones(), &sampling);
    let held_out = sample_tones(plant, set, &tones(), &Sampling { seed: settings.seed.wrapping_add(1 << 32), ..sampling });
    learn_rows(set, rows, &held_out, settings)
}

/// Trains restarts on rows of any origin; `held_out` are others of the same kind.
///
/// # Errors
/// If the firmware would refuse the network.
pub fn learn_rows(set: &FeatureSet, rows: Rows, held_out: &Rows, settings: &Settings) -> Result<Learned, ExportError> {
    let fits: Vec<Result<(Fit, f64), ExportError>> = (0..settings.restarts.max(1) as u64)
        .into_par_iter()
        .map(|restart| {
            let seed = settings.seed.wrapping_mul(0x9e37_79b9).wrapping_add(restart);
            let fit = train(&rows, &settings.training, seed);
            let file = model_file(&fit.network, set, &rows, Precision::Float, settings.sampling.period)?;
            let error = narrow_error(&file, set, held_out).unwrap_or(f64::INFINITY);
            Ok((fit, error))
        })
        .collect();
    let fits: Vec<(Fit, f64)> = fits.into_iter().collect::<Result<_, _>>()?;
    // The first of equals, whatever finished first.
    let best = fits.into_iter().reduce(|best, next| if next.1 < best.1 { next } else { best });
    let (fit, error) = best.unwrap_or_else(|| unreachable!("at least one restart"));
    Ok(Learned { set: set.clone(), rows, fit, held_out: error })
}

/// RMS error of a model file on rows; `None` if the firmware refuses the file.
pub fn narrow_error(file: &[u8], set: &FeatureSet, rows: &Rows) -> Option<f64> {
    let module = FirmwareModule::new(file, set).ok()?;
    let errors = rows.narrow().into_iter().zip(&rows.targets);
    Some(rms(errors.map(|(inputs, target)| f64::from(module.evaluate(&inputs)) - target)))
}

/// A module in the loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// RMS of the module's reference less that of the exact law at the same moments: what the paper calls modelling error.
    pub model_rms: f64,
    /// RMS of y - y_d.
    pub tracking_rms: f64,
    /// The exact law's reference at each moment of the run.
    pub exact: Vec<f64>,
    /// The run.
    pub run: Run<f64>,
}

/// Flies a module along `desired` and compares it with the exact law.
pub fn assess(
    plant: &impl Plant<f64>,
    module: &dyn Module<f64>,
    law: &dyn Module<f64>,
    desired: &dyn Fn(i64) -> f64,
    start: &Start<'_, f64>,
    samples: usize,
) -> Assessment {
    let run = simulate(plant, module, desired, start, samples);
    let exact: Vec<f64> = (0..samples).map(|sample| law.reference(&run.moment(sample, desired))).collect();
    let model_rms = rms(run.reference.iter().zip(&exact).map(|(found, exact)| found - exact));
    Assessment { model_rms, tracking_rms: run.tracking_rms(0), exact, run }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::{fixtures, law::StateSpaceLaw};

    fn desired(sample: i64) -> f64 {
        fixtures::test_trajectory(sample as f64 * fixtures::PERIOD)
    }

    #[test]
    fn the_network_is_exact_to_1e_8_in_f64_and_4e_7_in_the_firmwares_f32_on_the_minimum_phase_system() {
        let system = fixtures::minimum_phase();
        let law = StateSpaceLaw::new(&system);
        let learned = learn(&system, &FeatureSet::state_space(2, 1), &Settings::default()).unwrap();
        let samples = fixtures::test_samples(fixtures::PERIOD);
        let found = assess(&system, &learned.module(), &law, &desired, &Start::rest(), samples);
        assert!(found.model_rms <= 1e-8 && found.tracking_rms <= 1e-8, "{} {}", found.model_rms, found.tracking_rms);
        for (precision, bound) in [(Precision::Float, 4e-7), (Precision::Int16, 1e-2), (Precision::Int8, 2e-2)] {
            let file = learned.file(precision, fixtures::PERIOD).unwrap();
            let module = FirmwareModule::new(&file, &learned.set).unwrap();
            let found = assess(&system, &module, &law, &desired, &Start::rest(), samples);
            assert!(
                found.model_rms <= bound && found.tracking_rms <= bound,
                "{precision:?}: {} {}",
                found.model_rms,
                found.tracking_rms
            );
        }
    }

    #[test]
    fn the_number_of_threads_does_not_change_what_is_learned() {
        let system = fixtures::minimum_phase();
        let training = levenberg_marquardt::Settings { units: 4, iterations: 6, ..Default::default() };
        let settings = Settings { training, restarts: 3, ..Settings::default() };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| learn(&system, &FeatureSet::state_space(2, 1), &settings).unwrap())
        };
        let (one, three) = (with(1), with(3));
        assert_eq!((one.fit, one.held_out), (three.fit, three.held_out));
    }
}
