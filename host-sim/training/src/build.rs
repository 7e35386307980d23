//! From a loop to its models: collect, learn, design the lane, export.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_model_export::{
    Description, ExportError, FloatNetwork, Precision,
    description::{LaneDescription, MonitorDescription},
    encode,
};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{FlightsError, Loop, reduction},
    trajectory::{Trajectory, strokes},
};

use crate::{
    error::BuildError,
    lane::{LaneChoice, LaneRefusal, choose_lane, dithered_logs, strongest_lane},
    learn::{Candidates, Learned, Rows, learn},
    models::{FromFlights, ModelSet, describe, feedforward},
    monitor::{monitor, validated_rms},
    recipe::{LaneRecipe, Recipe},
    supervised::Progress,
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
pub fn training_logs(recipe: &Recipe, closed_loop: &Loop, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
    let mut first = derived(seed, Purpose::Training);
    let mut logs = Vec::new();
    for flight_set in &recipe.training_flights {
        logs.extend(closed_loop.collect(&flight_set.motions(first), None, first)?);
        first = first.wrapping_add(u64::from(flight_set.flights));
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
pub fn smoothing(recipe: &Recipe, closed_loop: &Loop) -> f64 {
    if closed_loop.condition.noise.position > 0.0 || closed_loop.condition.noise.velocity > 0.0 {
        recipe.smoothing_s
    } else {
        0.0
    }
}

/// Builds the models of a loop. The same seed gives the same bytes.
///
/// # Errors
/// If flights or learning fail; a refused feedback lane is no error.
pub fn build(recipe: &Recipe, closed_loop: &Loop, seed: u64, progress: &mut dyn FnMut(Progress)) -> Result<Built, BuildError> {
    let delay = closed_loop.condition.measurement_delay_s;
    let mut recipe = recipe.clone();
    recipe.network.seed = seed;
    recipe.fine_tuning.seed = seed;
    let logs = training_logs(&recipe, closed_loop, seed)?;
    let validation = validation_strokes(&recipe, &recipe.validation_speeds, closed_loop.rate_hz(), seed)?;
    let flight_seed = derived(seed, Purpose::Validation);
    let judge = |candidates: Candidates<'_>, rows: &Rows| {
        Ok(best_in_flight(&recipe, closed_loop, &validation, flight_seed, candidates, rows)?)
    };
    let learned = learn(&recipe, &logs, delay, smoothing(&recipe, closed_loop), Some(&judge), progress)?;
    drop(logs);

    let dithered = dithered_logs(&recipe.lane, closed_loop, derived(seed, Purpose::Identification))?;
    let describe = |lane: Option<&LaneDescription>| describe(&recipe, closed_loop, &learned.rows, lane, "candidate", "", seed);
    let lane = choose_lane(&recipe, closed_loop, &dithered, &validation, flight_seed, &|lane| {
        encode(&describe(Some(lane)), Some(&learned.quantised), Precision::Int8, &learned.rows.calibration)
    });

    // The feed-forward leaves larger errors, for which the network's lane would be unfairly weak.
    let wide = LaneRecipe { fast_limits: vec![0.1, 0.3], authority_scales: vec![1e3], error_scale: 0.2, ..recipe.lane.clone() };
    let nominal = validation_strokes(&recipe, &[1.0], closed_loop.rate_hz(), seed)?;
    let feedforward_lane = strongest_lane(&wide, closed_loop, &dithered, &nominal, flight_seed, &|lane| {
        feedforward(&closed_loop.settings, describe(Some(lane)))
    })
    .ok();

    let remarks = match &lane {
        Ok(choice) => format!("feedback lane: {}", choice.design),
        Err(reason) => format!("no feedback lane: {reason}"),
    };
    let monitor = monitor(&recipe, &dithered).ok();
    let from_flights = |lane: Option<&LaneDescription>, validation: &[Trajectory], encode: &Encode<'_>| {
        let promised = |monitor: &MonitorDescription| {
            let model = encode(describe(lane))?;
            Ok::<_, BuildError>(MonitorDescription {
                validated_rms: validated_rms(closed_loop, validation, &model, flight_seed)?,
                ..monitor.clone()
            })
        };
        Ok::<_, BuildError>(FromFlights { lane: lane.cloned(), monitor: monitor.as_ref().map(promised).transpose()? })
    };
    let own = from_flights(lane.as_ref().ok().map(|choice| &choice.lane), &validation, &|description| {
        encode(&description, Some(&learned.quantised), Precision::Int8, &learned.rows.calibration)
    })?;
    let of_feedforward = from_flights(feedforward_lane.as_ref().map(|choice| &choice.lane), &nominal, &|description| {
        feedforward(&closed_loop.settings, description)
    })?;
    let models = ModelSet::new(&recipe, closed_loop, &learned, &own, &of_feedforward, &remarks, seed)?;
    Ok(Built { learned, lane, feedforward_lane, models })
}

/// Makes a model file of a description.
type Encode<'a> = dyn Fn(Description) -> Result<Vec<u8>, ExportError> + 'a;

/// Further delay of the whole loop in one of the flights by which networks are chosen, s.
const LATE_S: f64 = 0.02;
/// A network may be this much worse than the ridge regression in any kind of validation flight, points.
const LOSS_AGAINST_RIDGE: f64 = 0.1;

/// The candidate with the best mean reduction over the validation flights, nominal and late, each speed by itself; first come those
/// that are nowhere worse than the ridge regression on the same features.
///
/// # Errors
/// If a candidate cannot be encoded or flown.
pub fn best_in_flight(
    recipe: &Recipe,
    closed_loop: &Loop,
    validation: &[Trajectory],
    seed: u64,
    candidates: Candidates<'_>,
    rows: &Rows,
) -> Result<usize, BuildError> {
    let lanes = Lanes { network: true, feedback: false };
    let closed_loop = &closed_loop.unguarded();
    let late = closed_loop.delayed(LATE_S);
    let kinds: Vec<(&Loop, &[Trajectory])> = [closed_loop, &late]
        .into_iter()
        .flat_map(|closed_loop| {
            validation.chunks(recipe.validation_strokes.max(1)).map(move |trajectories| (closed_loop, trajectories))
        })
        .collect();
    let baselines: Vec<Vec<f64>> = kinds
        .iter()
        .map(|(closed_loop, trajectories)| closed_loop.errors(trajectories, None, 1.0, seed))
        .collect::<Result<_, _>>()
        .map_err(FlightsError::from)?;
    let fly = |network: &FloatNetwork, precision| -> Result<Vec<f64>, BuildError> {
        let description = describe(recipe, closed_loop, rows, None, "candidate", "", seed);
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
