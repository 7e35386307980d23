//! Simulated flights that judge: which network flies best.
//!
//! *in* a loop, trajectories, candidates; *out* the best of them; *never* a test flight, nor a flight that the guard saved;
//! *source* Zhou 2017 compares modules by the error in flight. Errors on rows do not tell it: poor training signals are fitted
//! best and flown worst.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_model_export::{ExportError, FloatNetwork, Precision, encode};
use impromptu_sim::{
    flights::{FlightsError, Loop, reduction},
    trajectory::{Trajectory, strokes},
};

use crate::{
    error::BuildError,
    learn::{Candidates, Rows},
    models::describe,
    purpose::{Purpose, derived},
    recipe::Recipe,
};

/// Flights by which models are judged.
#[derive(Clone, Debug)]
pub struct Validation<'a> {
    /// What flies.
    pub closed_loop: &'a Loop,
    /// Over what.
    pub trajectories: Vec<Trajectory>,
    /// Seed of the first flight.
    pub seed: u64,
}

impl<'a> Validation<'a> {
    /// The recipe's strokes at some speeds.
    ///
    /// # Errors
    /// If they cannot be sampled.
    pub fn strokes(recipe: &Recipe, closed_loop: &'a Loop, speeds: &[f64], seed: u64) -> Result<Self, FlightsError> {
        let seed = derived(seed, Purpose::Validation);
        let mut trajectories = Vec::new();
        for &speed in speeds {
            trajectories.extend(strokes(seed, recipe.validation_strokes, speed, closed_loop.rate_hz())?);
        }
        Ok(Self { closed_loop, trajectories, seed })
    }
}

/// Further delay of the whole loop in one of the flights by which networks are chosen, s.
const LATE_S: f64 = 0.02;
/// A network may be this much worse than the ridge regression in any kind of validation flight, points.
const LOSS_AGAINST_RIDGE: f64 = 0.1;

/// The candidate with the best mean reduction over the validation flights, nominal and late, each speed by itself; first come
/// those that are nowhere worse than the ridge regression on the same features.
///
/// # Errors
/// If a candidate cannot be encoded or flown.
pub fn best_in_flight(
    recipe: &Recipe,
    validation: &Validation<'_>,
    candidates: Candidates<'_>,
    rows: &Rows,
) -> Result<usize, BuildError> {
    let lanes = Lanes { network: true, feedback: false };
    let seed = validation.seed;
    let nominal = &validation.closed_loop.unguarded();
    let late = nominal.delayed(LATE_S);
    let kinds: Vec<(&Loop, &[Trajectory])> = [nominal, &late]
        .into_iter()
        .flat_map(|closed_loop| {
            let speeds = validation.trajectories.chunks(recipe.validation_strokes.max(1));
            speeds.map(move |trajectories| (closed_loop, trajectories))
        })
        .collect();
    let baselines: Vec<Vec<f64>> = kinds
        .iter()
        .map(|(closed_loop, trajectories)| closed_loop.errors(trajectories, None, 1.0, seed))
        .collect::<Result<_, _>>()
        .map_err(FlightsError::from)?;
    let fly = |network: &FloatNetwork, precision| -> Result<Vec<f64>, BuildError> {
        let description = describe(recipe, nominal, rows, None, "candidate", "", seed);
        let bytes = encode(&description, Some(network), precision, &rows.calibration)?;
        let model = Model::from_bytes(&bytes).map_err(ExportError::Refused)?;
        kinds
            .iter()
            .zip(&baselines)
            .map(|((closed_loop, trajectories), baseline)| {
                let errors = closed_loop.errors(trajectories, Some((&model, lanes)), 1.0, seed).map_err(FlightsError::from)?;
                Ok(reduction(baseline, &errors).0)
            })
            .collect()
    };
    let bar = fly(candidates.ridge, Precision::Float)?;
    let mut best = (false, f64::NEG_INFINITY, 0);
    for (index, candidate) in candidates.networks.iter().enumerate() {
        let found = fly(candidate, candidates.precision)?;
        let harmless = found.iter().zip(&bar).all(|(network, ridge)| *network >= ridge - LOSS_AGAINST_RIDGE);
        let mean = found.iter().sum::<f64>() / found.len().max(1) as f64;
        if (harmless, mean) > (best.0, best.1) {
            best = (harmless, mean, index);
        }
    }
    Ok(best.2)
}
