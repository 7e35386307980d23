//! From a loop to its models: collect, learn, design the lane, export.

use impromptu_model_export::{ExportError, Precision, description::LaneDescription, encode};

use super::{
    flights::{FlightsError, Loop},
    lane::{LaneChoice, LaneRefusal, choose_lane, dithered_logs, strongest_lane},
    learn::{LearnError, Learned, learn},
    models::{ModelSet, describe, feedforward},
    recipe::{LaneRecipe, Recipe},
};
use crate::{
    flight_log::FlightLog,
    training::Progress,
    trajectory::{Trajectory, strokes},
};

/// Why there are no models.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Flights failed.
    #[error(transparent)]
    Flights(#[from] FlightsError),
    /// Learning failed.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// A model could not be encoded.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// Everything that was built for a loop.
#[derive(Debug)]
pub struct Built {
    /// Networks, calibration rows, envelope.
    pub learned: Learned,
    /// Feedback lane, or why there is none.
    pub lane: Result<LaneChoice, LaneRefusal>,
    /// Feedback lane of the flatness comparison.
    pub feedforward_lane: Option<LaneChoice>,
    /// Model files.
    pub models: ModelSet,
}

/// What a random number is for: training, validation and test never share a seed.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Training flights.
    Training = 1,
    /// Flights with dither.
    Identification = 2,
    /// Validation strokes and flights.
    Validation = 3,
    /// Test strokes and flights.
    Test = 4,
}

/// The seed of a purpose (SplitMix64's finaliser).
pub fn derived(seed: u64, purpose: Purpose) -> u64 {
    let mut mixed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add((purpose as u64) << 56);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// Logs of the recipe's training flights.
///
/// # Errors
/// If they cannot be flown.
pub fn training_logs(recipe: &Recipe, plant: &Loop, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
    let mut first = derived(seed, Purpose::Training);
    let mut logs = Vec::new();
    for excitation in &recipe.excitations {
        logs.extend(plant.collect(&excitation.motions(first), None, first)?);
        first = first.wrapping_add(u64::from(excitation.flights));
    }
    Ok(logs)
}

/// Validation strokes at each of the recipe's speeds.
///
/// # Errors
/// If they cannot be sampled.
pub fn validation_strokes(recipe: &Recipe, speeds: &[f64], rate_hz: f64, seed: u64) -> Result<Vec<Trajectory>, FlightsError> {
    let seed = derived(seed, Purpose::Validation);
    let mut trajectories = Vec::new();
    for &speed in speeds {
        trajectories.extend(strokes(seed, recipe.validation_strokes, speed, rate_hz)?);
    }
    Ok(trajectories)
}

/// Smoothing of logs under a condition: none where there is no noise.
pub fn smoothing(recipe: &Recipe, plant: &Loop) -> f64 {
    if plant.condition.noise.position > 0.0 || plant.condition.noise.velocity > 0.0 { recipe.smoothing_s } else { 0.0 }
}

/// Builds the models of a loop. The same seed gives the same bytes.
///
/// # Errors
/// If flights or learning fail; a refused feedback lane is no error.
pub fn build(recipe: &Recipe, plant: &Loop, seed: u64, progress: &mut dyn FnMut(Progress)) -> Result<Built, BuildError> {
    let delay = plant.condition.measurement_delay_s;
    let mut recipe = recipe.clone();
    recipe.network.seed = seed;
    recipe.fine_tuning.seed = seed;
    let logs = training_logs(&recipe, plant, seed)?;
    let learned = learn(&recipe, &logs, delay, smoothing(&recipe, plant), progress)?;
    drop(logs);

    let dithered = dithered_logs(&recipe.lane, plant, derived(seed, Purpose::Identification))?;
    let flight_seed = derived(seed, Purpose::Validation);
    let validation = validation_strokes(&recipe, &recipe.validation_speeds, plant.rate_hz(), seed)?;
    let describe = |lane: Option<&LaneDescription>| describe(&recipe, plant, &learned, lane, "candidate", "", seed);
    let lane = choose_lane(&recipe, plant, &dithered, &validation, flight_seed, &|lane| {
        encode(&describe(Some(lane)), Some(&learned.quantised), Precision::Int8, &learned.calibration)
    });

    let wide = LaneRecipe { fast_limits: vec![0.1, 0.3], ..recipe.lane.clone() };
    let nominal = validation_strokes(&recipe, &[1.0], plant.rate_hz(), seed)?;
    let feedforward_lane = strongest_lane(&wide, plant, &dithered, &nominal, flight_seed, &|lane| {
        feedforward(&plant.settings, describe(Some(lane)))
    })
    .ok();

    let remarks = match &lane {
        Ok(choice) => format!("feedback lane: {}", choice.design),
        Err(reason) => format!("no feedback lane: {reason}"),
    };
    let models = ModelSet::new(
        &recipe,
        plant,
        &learned,
        lane.as_ref().ok().map(|choice| &choice.lane),
        feedforward_lane.as_ref().map(|choice| &choice.lane),
        &remarks,
        seed,
    )?;
    Ok(Built { learned, lane, feedforward_lane, models })
}
