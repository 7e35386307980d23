//! From logs to a model file: the one sequence in which every model comes about.
//!
//! ```text
//! logs ──► sound ones ──► rows, some logs held out ──► ridge, network ──┐            learn()
//!                                                                       ▼
//! dithered logs ──► feedback lane ──► description ──► monitor ──► model file         complete()
//! ```
//!
//! *in* what is learned and how, logs, and a simulated loop where there is one; *out* networks, and a model file; *never* a lane
//! or a monitor that no flight has judged: without a simulated loop there is neither; *source* Zhou 2017, sections III and V.

use impromptu_model_export::{
    Description, ExportError,
    description::{LaneDescription, MonitorDescription, Provenance, Timing},
};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{FlightsError, Loop},
};

use crate::{
    error::BuildError,
    lane::choose_lane,
    lane_choice::{LaneChoice, LaneRefusal, in_words},
    learn::{Candidates, Judge, LearnError, LearnSettings, Learned, Rows, learn},
    models::describe,
    monitor::{monitor, validated_rms},
    recipe::Recipe,
    supervised::Progress,
    validation::{Validation, best_in_flight},
};

/// Smoothing of logs under a condition: none where there is no noise.
pub fn smoothing(recipe: &Recipe, closed_loop: &Loop) -> f64 {
    let noise = &closed_loop.condition.noise;
    if noise.position > 0.0 || noise.velocity > 0.0 { recipe.smoothing_s } else { 0.0 }
}

/// Everything in which trainings differ.
#[derive(Clone, Debug)]
pub struct Pipeline<'a> {
    /// What is learned, and how.
    pub settings: LearnSettings,
    /// The loop whose signals and rates the model has.
    pub template: &'a Loop,
    /// Whether that is the loop that was logged: if not, the model does not say of what vehicle it is.
    pub known: bool,
    /// Flights of a simulated loop that judge networks and feedback lanes, and tell what the guard may expect. Without them rows
    /// judge the networks, and the model has neither lane nor monitor.
    pub validation: Option<Validation<'a>>,
}

/// What is in a model besides its networks, and the file.
#[derive(Debug)]
pub struct Trained {
    /// Feedback lane, or why there is none.
    pub lane: Result<LaneChoice, LaneRefusal>,
    /// What the file says of itself.
    pub description: Description,
    /// The model file.
    pub model: Vec<u8>,
}

/// Makes a model file of a description.
pub type Encode<'a> = dyn Fn(&Description) -> Result<Vec<u8>, ExportError> + Sync + 'a;

impl<'a> Pipeline<'a> {
    /// For logs of a simulated loop, which flies the recipe's validation strokes as well.
    ///
    /// # Errors
    /// If these cannot be sampled.
    pub fn simulated(recipe: &Recipe, closed_loop: &'a Loop, seed: u64) -> Result<Self, FlightsError> {
        let validation = Validation::strokes(recipe, closed_loop, &recipe.validation_speeds, seed)?;
        Ok(Self { validation: Some(validation), ..Self::unjudged(recipe, closed_loop, seed) })
    }

    /// The same without validation flights: rows decide.
    pub fn unjudged(recipe: &Recipe, closed_loop: &'a Loop, seed: u64) -> Self {
        let settings = LearnSettings {
            measurement_delay_s: closed_loop.condition.measurement_delay_s,
            smoothing_s: smoothing(recipe, closed_loop),
            ..LearnSettings::new(recipe, seed)
        };
        Self { settings, template: closed_loop, known: true, validation: None }
    }

    /// Networks from logs of the baseline.
    ///
    /// # Errors
    /// If the logs hold too little or the training fails.
    pub fn learn(&self, logs: &[FlightLog], progress: &mut dyn FnMut(Progress)) -> Result<Learned, LearnError> {
        let in_flight = self.validation.as_ref().map(|validation| {
            |candidates: Candidates<'_>, rows: &Rows| Ok(best_in_flight(&self.settings.recipe, validation, candidates, rows)?)
        });
        learn(&self.settings, logs, in_flight.as_ref().map(|judge| judge as &Judge<'_>), progress)
    }

    /// A model file of what was learned: with a feedback lane and a monitor from `identification`, logs with dither, if flights
    /// can judge them. `remark` follows what is remarked of the lane.
    ///
    /// # Errors
    /// If flights fail or the model cannot be encoded; a refused feedback lane is no error.
    pub fn complete(
        &self,
        learned: &Learned,
        identification: &[FlightLog],
        name: &str,
        remark: Option<&str>,
    ) -> Result<Trained, BuildError> {
        let encode = |description: &Description| learned.encode(description);
        let recipe = &self.settings.recipe;
        let lane = match &self.validation {
            Some(validation) => {
                choose_lane(recipe, validation, identification, &|lane| encode(&self.describe(learned, Some(lane), name, "")))
            }
            None => Err(LaneRefusal::NoFlights),
        };
        let remarks = [Some(in_words(&lane).as_str()), remark].into_iter().flatten().collect::<Vec<_>>().join("; ");
        let description = self.describe(learned, lane.as_ref().ok().map(|choice| &choice.lane), name, &remarks);
        // What the guard judges by needs flights that the add-on flew; without a simulated loop there are none.
        let (description, model) = match &self.validation {
            Some(validation) => with_monitor(validation, description, monitor(recipe, identification).ok(), &encode)?,
            None => {
                let model = encode(&description)?;
                (description, model)
            }
        };
        Ok(Trained { lane, description, model })
    }

    /// Description of a model, with what is known of the logs' origin, without a monitor.
    pub fn describe(&self, learned: &Learned, lane: Option<&LaneDescription>, name: &str, remarks: &str) -> Description {
        let LearnSettings { recipe, seed, measurement_delay_s, .. } = &self.settings;
        let description = describe(recipe, self.template, &learned.rows, lane, name, remarks, *seed);
        let provenance = if self.known {
            description.provenance
        } else {
            let unknown = || "not stated".to_owned();
            Provenance { vehicle: unknown(), gains: unknown(), condition: unknown(), ..description.provenance }
        };
        let timing = Timing { measurement_delay_s: *measurement_delay_s as f32, ..description.timing };
        Description { provenance, timing, ..description }
    }
}

/// The model with a monitor, if there is one, that states what the validation flights without it have shown.
///
/// # Errors
/// If the model cannot be encoded or flown.
pub(crate) fn with_monitor(
    validation: &Validation<'_>,
    mut description: Description,
    monitor: Option<MonitorDescription>,
    encode: &Encode<'_>,
) -> Result<(Description, Vec<u8>), BuildError> {
    description.monitor = None;
    let mut model = encode(&description)?;
    if let Some(monitor) = monitor {
        let validated_rms = validated_rms(validation, &model)?;
        description.monitor = Some(MonitorDescription { validated_rms, ..monitor });
        model = encode(&description)?;
    }
    Ok((description, model))
}
