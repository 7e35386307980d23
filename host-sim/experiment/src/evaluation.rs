//! Flights of every method over the test strokes.

use impromptu_firmware::{adapter::Lanes, learning::Parts, model::Model};
use impromptu_model_export::{ExportError, verify};
use impromptu_report::{FlightTrace, LaneOutcome, Margins, Method, ModelCard, PerFlight};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{Loop, Response},
    learned::{LearningLoop, after, teaching},
    rollout::{FlightPlan, RolloutError},
    trajectory::{Trajectory, TrajectoryError},
};
use impromptu_training::build::Built;

const NETWORK: Lanes = Lanes { network: true, feedback: false };
const FEEDBACK: Lanes = Lanes { network: false, feedback: true };

/// Why nothing was evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    /// A stroke cannot be sampled.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Flights failed.
    #[error(transparent)]
    Rollout(#[from] RolloutError),
    /// A model file is refused.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// The file and the lanes of a method; `None` for the baseline and for what is not in a file.
fn flown_by(built: &Built, method: Method) -> Option<(&[u8], Lanes)> {
    let models = &built.models;
    let (bytes, lanes) = match method {
        Method::Baseline | Method::Learned | Method::FullLearned => return None,
        Method::Feedforward => (&models.feedforward, NETWORK),
        Method::Feedback => (&models.feedforward, FEEDBACK),
        Method::FeedforwardFeedback => (&models.feedforward, Lanes::BOTH),
        Method::Ridge => (&models.ridge, NETWORK),
        Method::NetF32 => (&models.float, NETWORK),
        Method::NetInt8 => (&models.int8, NETWORK),
        Method::FullRidge => (&models.ridge, Lanes::BOTH),
        Method::FullF32 => (&models.float, Lanes::BOTH),
        Method::FullInt8 => (&models.int8, Lanes::BOTH),
    };
    Some((bytes, lanes))
}

/// Flies every method over the trajectories; one entry for each flight.
///
/// # Errors
/// If a model is refused or a flight cannot be flown.
pub fn evaluate(
    built: &Built,
    closed_loop: &Loop,
    trajectories: &[Trajectory],
    speed: f64,
    flight_seed: u64,
    seed: u64,
) -> Result<Vec<PerFlight>, EvaluationError> {
    let baseline = closed_loop.errors(trajectories, None, 1.0, flight_seed)?;
    let unguarded = closed_loop.unguarded();
    let mut flights = Vec::new();
    // What is learned on top of a model is for `evaluate --learn`.
    for method in Method::ALL.into_iter().filter(|method| *method != Method::FullLearned) {
        let errors = match flown_by(built, method) {
            None if method == Method::Learned => learned(closed_loop, None, trajectories, speed, flight_seed, LEARNED_SECONDS)?,
            None => baseline.clone(),
            Some((bytes, lanes)) => {
                let model = Model::from_bytes(bytes).map_err(ExportError::Refused)?;
                // The guard hands over what it would cost the comparisons: they fly without.
                let watched = matches!(method, Method::NetF32 | Method::NetInt8 | Method::FullF32 | Method::FullInt8);
                let closed_loop = if watched { closed_loop } else { &unguarded };
                closed_loop.errors(trajectories, Some((&model, lanes)), 1.0, flight_seed)?
            }
        };
        flights.extend(per_flight(closed_loop, trajectories, speed, method, &errors, &baseline, seed));
    }
    Ok(flights)
}

/// How long is learned before the flights that are judged, s of motion.
const LEARNED_SECONDS: u32 = 60;

/// RMS errors, m, over trajectories with what so many seconds of other strokes at that speed taught; each goes on learning.
///
/// # Errors
/// If a flight cannot be flown.
pub fn learned(
    closed_loop: &Loop,
    model: Option<(&Model<'_>, Lanes)>,
    trajectories: &[Trajectory],
    speed: f64,
    flight_seed: u64,
    seconds: u32,
) -> Result<Vec<f64>, EvaluationError> {
    let teach = teaching(flight_seed, seconds, speed, closed_loop.rate_hz())?;
    let learned = LearningLoop { closed_loop, model, parts: Parts::BOTH, response: Response::Commissioned, seed: flight_seed };
    Ok(after(&learned, seconds, &teach, trajectories)?.errors)
}

/// Flights as they are reported, of their RMS errors and the baseline's over the same trajectories, m.
pub fn per_flight(
    closed_loop: &Loop,
    trajectories: &[Trajectory],
    speed: f64,
    method: Method,
    errors: &[f64],
    baseline: &[f64],
    seed: u64,
) -> Vec<PerFlight> {
    let flights = trajectories.iter().zip(errors).zip(baseline);
    let report = |((trajectory, error), baseline): ((&Trajectory, &f64), &f64)| PerFlight {
        vehicle: closed_loop.vehicle.name.clone(),
        gains: closed_loop.gains.clone(),
        condition: closed_loop.condition.name.clone(),
        speed,
        method,
        trajectory: trajectory.name.clone(),
        rms_cm: 100.0 * error,
        reduction: 100.0 * (1.0 - error / baseline),
        seed,
    };
    flights.map(report).collect()
}

/// Full records of a few flights: the baseline, the network lane alone, and both lanes.
///
/// # Errors
/// As [`evaluate`].
pub fn traces(
    built: &Built,
    closed_loop: &Loop,
    trajectories: &[Trajectory],
    speed: f64,
    flight_seed: u64,
) -> Result<Vec<(FlightTrace, FlightLog)>, EvaluationError> {
    let model = Model::from_bytes(&built.models.int8).map_err(ExportError::Refused)?;
    let mut traces = Vec::new();
    for (method, lanes) in [(Method::Baseline, None), (Method::NetInt8, Some(NETWORK)), (Method::FullInt8, Some(Lanes::BOTH))] {
        let plans: Vec<FlightPlan<'_>> = trajectories
            .iter()
            .zip(flight_seed..)
            .map(|(trajectory, seed)| FlightPlan {
                model: lanes.map(|lanes| (&model, lanes)),
                log: true,
                ..FlightPlan::new(trajectory, seed)
            })
            .collect();
        for (record, trajectory) in closed_loop.fly(&plans)?.into_iter().zip(trajectories) {
            let Some(log) = record.log else { continue };
            let trace = FlightTrace {
                trajectory: trajectory.name.clone(),
                vehicle: closed_loop.vehicle.name.clone(),
                gains: closed_loop.gains.clone(),
                condition: closed_loop.condition.name.clone(),
                speed,
                method,
                rate_hz: log.rate_hz,
                desired: log.rows.iter().map(|row| row.desired.position).collect(),
                flown: log.rows.iter().map(|row| row.true_position.unwrap_or(row.measured_position)).collect(),
                reference: log.rows.iter().map(|row| row.reference_position).collect(),
                scored: trajectory.scored.clone(),
            };
            traces.push((trace, log));
        }
    }
    Ok(traces)
}

/// What is said of the flashed model.
///
/// # Errors
/// If the file is refused.
pub fn model_card(built: &Built, closed_loop: &Loop) -> Result<ModelCard, ExportError> {
    let bytes = &built.models.int8;
    let model = Model::from_bytes(bytes).map_err(ExportError::Refused)?;
    let card = model.card();
    let network = &built.learned.exported;
    let dense: usize = network.layers.iter().map(|layer| layer.weights.len() + layer.bias.len()).sum();
    let skip = network.skip.as_ref().map_or(0, Vec::len);
    let difference = verify::difference(&model, network, &built.learned.rows.calibration);
    let position = &difference.rms[..3.min(difference.rms.len())];
    let square = position.iter().map(|rms| rms * rms).sum::<f64>();
    let lane_parameters = model.feedback().map_or(0, |lane| lane.multiply_adds());
    Ok(ModelCard {
        name: card.name.into(),
        vehicle: closed_loop.vehicle.name.clone(),
        gains: closed_loop.gains.clone(),
        condition: closed_loop.condition.name.clone(),
        bytes: bytes.len() as u64,
        crc32: model.checksum(),
        parameters: (dense + skip) as u64 + u64::from(lane_parameters),
        multiply_adds: u64::from(model.network().map_or(0, |network| network.multiply_adds())) + u64::from(lane_parameters),
        margins: card.feedback.as_ref().map(|lane| Margins {
            delay_ms: lane.margins.delay_ms.into(),
            gain: lane.margins.gain.into(),
            modulus: lane.margins.modulus.into(),
        }),
        lane: match &built.lane {
            Ok(choice) => LaneOutcome::Chosen(choice.design.clone()),
            Err(reason) => LaneOutcome::Refused(reason.to_string()),
        },
        minutes: Some(built.flown.minutes()),
        quantisation_rms_mm: Some(1e3 * square.sqrt()),
    })
}
