//! From a loop to its models: fly, train, and train what the models are compared with.
//!
//! *in* a recipe and a simulated loop; *out* model files: the network in two number formats, the ridge regression, the flatness
//! feed-forward; *never* a comparison that has fewer lanes than the model; *source* Zhou 2017, sections III and V.

use impromptu_model_export::{Description, ExportError, Precision, description::LaneDescription};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{FlightsError, Loop},
};

use crate::{
    error::BuildError,
    lane::{dithered_logs, strongest_lane},
    lane_choice::{LaneChoice, LaneRefusal},
    learn::Learned,
    models::feedforward,
    pipeline::{Pipeline, Trained, with_monitor},
    purpose::{Purpose, derived},
    recipe::{LaneRecipe, Recipe},
    supervised::Progress,
    validation::Validation,
};

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
    /// What was flown to learn from.
    pub flown: Flown,
}

/// Flight that was learned from, minutes. The simulated flights that judge candidates teach nothing and are not counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// For the networks.
    pub training: f64,
    /// With dither, for the feedback lane.
    pub dithered: f64,
}

impl Flown {
    /// Both together.
    pub fn minutes(&self) -> f64 {
        self.training + self.dithered
    }
}

impl std::fmt::Display for Flown {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{:.1} min of flight, {:.1} of them with dither", self.minutes(), self.dithered)
    }
}

/// Length of logs together, minutes.
pub fn minutes(logs: &[FlightLog]) -> f64 {
    logs.iter().map(|log| log.rows.len() as f64 / log.rate_hz).sum::<f64>() / 60.0
}

/// The models that an experiment compares, as the bytes of model files.
#[derive(Clone, Debug)]
pub struct ModelSet {
    /// Flatness feed-forward.
    pub feedforward: Vec<u8>,
    /// Ridge regression.
    pub ridge: Vec<u8>,
    /// Network, f32.
    pub float: Vec<u8>,
    /// Network, int8.
    pub int8: Vec<u8>,
    /// What the int8 file says of itself.
    pub description: Description,
}

/// Logs of the recipe's training flights.
///
/// # Errors
/// If they cannot be flown.
pub fn training_logs(recipe: &Recipe, closed_loop: &Loop, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
    let mut first = derived(seed, Purpose::Training);
    let mut logs = Vec::new();
    for flight_set in &recipe.training_flights {
        logs.extend(closed_loop.collect(&flight_set.motions(first), None, first)?);
        first = first.wrapping_add(u64::from(flight_set.flights));
    }
    Ok(logs)
}

/// Builds the models of a loop. The same seed gives the same bytes.
///
/// # Errors
/// If flights or learning fail; a refused feedback lane is no error.
pub fn build(recipe: &Recipe, closed_loop: &Loop, seed: u64, progress: &mut dyn FnMut(Progress)) -> Result<Built, BuildError> {
    let name = |what: &str| format!("{}-{}-{}-{what}", closed_loop.vehicle.name, closed_loop.gains, closed_loop.condition.name);
    let pipeline = Pipeline::simulated(recipe, closed_loop, seed)?;
    let logs = training_logs(recipe, closed_loop, seed)?;
    let learned = pipeline.learn(&logs, progress)?;
    let dithered = dithered_logs(&recipe.lane, closed_loop, derived(seed, Purpose::Identification))?;
    let flown = Flown { training: minutes(&logs), dithered: minutes(&dithered) };
    drop(logs);
    let trained = pipeline.complete(&learned, &dithered, &name("net_int8"), Some(&flown.to_string()))?;
    let (feedforward_lane, feedforward) =
        comparison(&pipeline, closed_loop, &learned, &dithered, &trained, &name("feedforward"))?;

    let Trained { lane, description, model } = trained;
    let beside = |what: &str, network| -> Result<Vec<u8>, ExportError> {
        let description = Description { name: name(what), ..description.clone() };
        learned.encode_as(&description, network, Precision::Float, learned.labels.bypass())
    };
    let models = ModelSet {
        feedforward,
        ridge: beside("ridge", &learned.ridge)?,
        float: beside("net_f32", &learned.network)?,
        int8: model,
        description,
    };
    Ok(Built { learned, lane, feedforward_lane, models, flown })
}

/// The flatness feed-forward with a feedback lane and a monitor of its own, if there are any.
fn comparison(
    pipeline: &Pipeline<'_>,
    closed_loop: &Loop,
    learned: &Learned,
    dithered: &[FlightLog],
    trained: &Trained,
    name: &str,
) -> Result<(Option<LaneChoice>, Vec<u8>), BuildError> {
    let (recipe, seed) = (&pipeline.settings.recipe, pipeline.settings.seed);
    let encode = |description: &Description| feedforward(&closed_loop.settings, description.clone());
    // The feed-forward leaves larger errors, for which the network's lane would be unfairly weak.
    let wide = LaneRecipe { fast_limits: vec![0.1, 0.3], authority_scales: vec![1e3], error_scale: 0.2, ..recipe.lane.clone() };
    let nominal = Validation::strokes(recipe, closed_loop, &[1.0], seed)?;
    let remarks = &trained.description.provenance.remarks;
    let describe = |lane: Option<&LaneDescription>| pipeline.describe(learned, lane, name, remarks);
    let lane = strongest_lane(&wide, &nominal, dithered, &|lane| encode(&describe(Some(lane)))).ok();
    let description = describe(lane.as_ref().map(|choice| &choice.lane));
    let (_, model) = with_monitor(&nominal, description, trained.description.monitor.clone(), &encode)?;
    Ok((lane, model))
}
