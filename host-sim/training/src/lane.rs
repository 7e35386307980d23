//! Choice of the feedback lane: designs from dithered logs, judged in flight.
//!
//! A design is admissible if no validation flight, at nominal, with 10 and 20 ms more delay in the whole loop, and with the
//! loop's gain times 0.7 and 1.3, is worse than the baseline's flight of the same trajectory, except where the network lane alone
//! is worse too: for a vehicle that tumbles without the lane the lane is not to blame. Among the admissible ones the best score
//! is taken: average and worst flight of each of these cases, the nominal one counting most: what a user gets also when the
//! vehicle is not quite the one that was identified.

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_model_export::{
    ExportError,
    description::{AuthorityDescription, LaneAxisDescription, LaneDescription},
};
use impromptu_sim::{
    flight_log::FlightLog,
    flights::{FlightsError, Loop},
    rollout::Dither,
    trajectory::hover,
};
use rayon::prelude::*;

use crate::{
    feedback_design::{AxisLog, DesignSettings, IdentificationData, LaneDesign, design, smallest},
    lane_choice::{LaneChoice, LaneRefusal},
    recipe::{LaneRecipe, Recipe},
    validation::Validation,
};

/// One design, ready to be flown.
struct Candidate {
    lane: LaneDescription,
    design: String,
}

/// A way in which validation flights differ from the design.
struct Case {
    name: &'static str,
    /// Share of the score; flights are mostly nominal.
    weight: f64,
    delay_s: f64,
    loop_gain: f32,
}

const CASES: [Case; 5] = [
    Case { name: "nominal", weight: 0.4, delay_s: 0.0, loop_gain: 1.0 },
    Case { name: "+10 ms", weight: 0.125, delay_s: 0.01, loop_gain: 1.0 },
    Case { name: "+20 ms", weight: 0.225, delay_s: 0.02, loop_gain: 1.0 },
    Case { name: "loop gain 0.7", weight: 0.125, delay_s: 0.0, loop_gain: 0.7 },
    Case { name: "loop gain 1.3", weight: 0.125, delay_s: 0.0, loop_gain: 1.3 },
];

/// Identification data of x and y pooled, and of z.
pub(crate) fn identification(logs: &[FlightLog], lags: usize) -> Result<[IdentificationData; 2], LaneRefusal> {
    let signals: Vec<[Vec<f64>; 5]> = logs
        .iter()
        .flat_map(|log| {
            (0..3).map(|axis| {
                let column =
                    |value: &dyn Fn(&impromptu_sim::flight_log::LogRow) -> f64| log.rows.iter().map(value).collect::<Vec<f64>>();
                [
                    column(&|row| row.measured_position[axis]),
                    column(&|row| row.measured_velocity[axis]),
                    column(&|row| row.reference_position[axis]),
                    column(&|row| row.reference_velocity[axis]),
                    column(&|row| row.reference_position[axis] - row.desired.position[axis]),
                ]
            })
        })
        .collect();
    let logs_of = |wanted: &dyn Fn(usize) -> bool| -> Vec<AxisLog<'_>> {
        signals
            .iter()
            .enumerate()
            .filter(|(index, _)| wanted(index % 3))
            .map(|(_, [position, velocity, reference, reference_velocity, dither])| AxisLog {
                measured_position: position,
                measured_velocity: velocity,
                reference_position: reference,
                reference_velocity,
                dither: Some(dither),
            })
            .collect()
    };
    let collect = |axis, logs: &[AxisLog<'_>]| {
        IdentificationData::collect(logs, lags).map_err(|reason| LaneRefusal::Design { axis, reason })
    };
    Ok([collect("x and y", &logs_of(&|axis| axis < 2))?, collect("z", &logs_of(&|axis| axis == 2))?])
}

/// All designs of the recipe's grid that exist; the last refusal if none does.
fn candidates(recipe: &LaneRecipe, logs: &[FlightLog]) -> Result<Vec<Candidate>, LaneRefusal> {
    let data = identification(logs, recipe.design.margin_lags)?;
    let mut grid = Vec::new();
    for &control_weight in &recipe.control_weights {
        for &velocity_weight in &recipe.velocity_weights {
            for &noise_factor in &recipe.noise_factors {
                grid.push(DesignSettings { control_weight, velocity_weight, noise_factor, ..recipe.design.clone() });
            }
        }
    }
    let designs: Vec<Result<[LaneDesign; 2], LaneRefusal>> = grid
        .par_iter()
        .map(|settings| {
            let make = |axis, data| design(data, settings).map_err(|reason| LaneRefusal::Design { axis, reason });
            Ok([make("x and y", &data[0])?, make("z", &data[1])?])
        })
        .collect();
    let mut refusal = None;
    let mut candidates = Vec::new();
    for (settings, designs) in grid.iter().zip(designs) {
        let [horizontal, vertical] = match designs {
            Ok(designs) => designs,
            Err(reason) => {
                refusal = Some(reason);
                continue;
            }
        };
        for (&fast_limit, &scale) in
            recipe.fast_limits.iter().flat_map(|limit| recipe.authority_scales.iter().map(move |scale| (limit, scale)))
        {
            candidates.push(Candidate {
                lane: describe(&[&horizontal, &horizontal, &vertical], fast_limit, scale, recipe),
                design: format!(
                    "control weight {}, e_v {}, noise x{}, fast clamp {} m (half of it at {} m/s²)",
                    settings.control_weight, settings.velocity_weight, settings.noise_factor, fast_limit, scale
                ),
            });
        }
    }
    match refusal {
        Some(reason) if candidates.is_empty() => Err(reason),
        _ => Ok(candidates),
    }
}

/// Lanes of all designs of the recipe's grid that exist, from dithered logs, not flown yet; each with its margins.
///
/// # Errors
/// If there is none.
pub fn lanes(recipe: &LaneRecipe, logs: &[FlightLog]) -> Result<Vec<LaneDescription>, LaneRefusal> {
    Ok(candidates(recipe, logs)?.into_iter().map(|candidate| candidate.lane).collect())
}

/// A design for each axis as the firmware stores it: errors of position and velocity, output on the position reference.
fn describe(designs: &[&LaneDesign; 3], fast_limit: f64, scale: f64, recipe: &LaneRecipe) -> LaneDescription {
    let axes = designs
        .iter()
        .zip(0u8..)
        .map(|(design, axis)| {
            let stored: Vec<f32> = design.gain.stored_coefficients().iter().map(|value| *value as f32).collect();
            let lags = design.gain.lags();
            LaneAxisDescription {
                output: axis,
                errors: vec![(axis, axis), (axis + 3, axis + 3)],
                error_coefficients: vec![stored[..lags].to_vec(), stored[lags..2 * lags].to_vec()],
                output_coefficients: stored[2 * lags..].to_vec(),
                integral: design.gain.integral_coefficient as f32,
                fast_limit: fast_limit as f32,
                integral_limit: recipe.integral_limit as f32,
            }
        })
        .collect();
    // Desired accelerations, whose effect on the loop outlasts them.
    let authority = AuthorityDescription {
        channels: vec![6, 7, 8],
        scale: scale as f32,
        error_scale: recipe.error_scale as f32,
        decay: recipe.authority_decay as f32,
    };
    LaneDescription { axes, authority, margins: smallest(designs.iter().map(|design| design.margins())) }
}

/// Collects dithered logs.
///
/// # Errors
/// If they cannot be flown.
pub fn dithered_logs(recipe: &LaneRecipe, closed_loop: &Loop, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
    let dither = Dither { amplitude: recipe.dither, hold_s: recipe.dither_hold_s };
    closed_loop.collect(&recipe.dithered_flights.motions(seed), Some(dither), seed)
}

/// How one design flew.
struct Score {
    /// As [`LaneChoice::score`].
    mean: f64,
    worst: f64,
    worst_case: &'static str,
    /// Least gain of a nominal flight over the network lane alone, per cent of the baseline's error.
    over_network: f64,
}

/// All designs of a recipe from dithered logs, and how each flew over the validation trajectories in every case.
fn flown(
    recipe: &LaneRecipe,
    validation: &Validation<'_>,
    logs: &[FlightLog],
    encode: &(dyn Fn(&LaneDescription) -> Result<Vec<u8>, ExportError> + Sync),
) -> Result<(Vec<Candidate>, Vec<Score>), LaneRefusal> {
    let candidates = candidates(recipe, logs)?;
    let cases = &CASES;
    // What a lane does by itself is judged, not what the guard makes of it.
    let Validation { closed_loop, trajectories: validation, seed } = validation;
    let (closed_loop, seed) = (&closed_loop.unguarded(), *seed);
    let loops: Vec<Loop> = cases.iter().map(|case| closed_loop.delayed(case.delay_s)).collect();
    let baselines: Vec<Vec<f64>> =
        loops.iter().map(|closed_loop| closed_loop.errors(validation, None, 1.0, seed)).collect::<Result<_, _>>()?;
    let network_alone: Vec<Vec<f64>> = match candidates.first() {
        Some(candidate) => {
            let bytes = encode(&candidate.lane)?;
            let model = Model::from_bytes(&bytes).map_err(ExportError::Refused)?;
            let lanes = Lanes { network: true, feedback: false };
            loops
                .iter()
                .map(|closed_loop| closed_loop.errors(validation, Some((&model, lanes)), 1.0, seed))
                .collect::<Result<_, _>>()?
        }
        None => Vec::new(),
    };
    let scores = candidates
        .par_iter()
        .map(|candidate| {
            let bytes = encode(&candidate.lane)?;
            let model = Model::from_bytes(&bytes).map_err(ExportError::Refused)?;
            let mut score = Score { mean: 0.0, worst: f64::INFINITY, worst_case: "", over_network: f64::INFINITY };
            for (place, (((case, closed_loop), baseline), alone)) in
                cases.iter().zip(&loops).zip(&baselines).zip(&network_alone).enumerate()
            {
                let errors = closed_loop.errors(validation, Some((&model, Lanes::BOTH)), case.loop_gain, seed)?;
                let worst = worst_to_answer_for(baseline, alone, &errors);
                // The geometric mean: halving a small error counts as much as halving a large one.
                let logs = baseline.iter().zip(&errors).map(|(baseline, error)| (error / baseline).ln());
                let mean = 100.0 * (1.0 - (logs.sum::<f64>() / baseline.len().max(1) as f64).exp());
                score.mean += case.weight * (0.9 * mean + 0.1 * worst);
                if worst < score.worst {
                    (score.worst, score.worst_case) = (worst, case.name);
                }
                if place == 0 {
                    let gains = baseline.iter().zip(alone).zip(&errors);
                    let gains = gains.map(|((baseline, network), error)| 100.0 * (network - error) / baseline);
                    score.over_network = gains.fold(f64::INFINITY, f64::min);
                }
            }
            Ok(score)
        })
        .collect::<Result<_, LaneRefusal>>()?;
    Ok((candidates, scores))
}

/// The worst reduction, per cent, among the flights in which the network lane alone is not worse than the baseline.
pub fn worst_to_answer_for(baseline: &[f64], network_alone: &[f64], errors: &[f64]) -> f64 {
    let flights = baseline.iter().zip(network_alone).zip(errors);
    let answerable = flights.filter(|((baseline, alone), _)| alone <= baseline);
    answerable.map(|((baseline, _), error)| 100.0 * (1.0 - error / baseline)).fold(100.0, f64::min)
}

/// A nominal flight may lose this much, per cent of the baseline's error, against the network lane alone; of what the worst one
/// loses beyond it, a share is taken off the score: it is one flight of many.
const LOSS_AGAINST_NETWORK: f64 = 1.0;
const LOSS_SHARE: f64 = 0.2;

/// Designs lanes from dithered `logs` and chooses one by `validation` flights. `encode` makes a
/// model file with a lane; the network lane flies too.
///
/// # Errors
/// With the reason why there is no lane.
pub fn choose_lane(
    recipe: &Recipe,
    validation: &Validation<'_>,
    logs: &[FlightLog],
    encode: &(dyn Fn(&LaneDescription) -> Result<Vec<u8>, ExportError> + Sync),
) -> Result<LaneChoice, LaneRefusal> {
    let (candidates, scores) = flown(&recipe.lane, validation, logs, encode)?;
    let admissible = |score: &Score| score.worst >= 0.0;
    if let Some(mut choice) = best(&candidates, &scores, &admissible) {
        let flown = flown_delay_margin(validation, &encode(&choice.lane)?)?;
        let margins = &mut choice.lane.margins;
        margins.delay_ms = margins.delay_ms.min(flown);
        return Ok(choice);
    }
    let (worst, case) = scores
        .iter()
        .max_by(|a, b| a.worst.total_cmp(&b.worst))
        .map_or((f64::NEG_INFINITY, "no design"), |score| (score.worst, score.worst_case));
    Err(LaneRefusal::Flights { designs: candidates.len(), worst, case: case.into() })
}

/// Hovers that a delay margin is flown in, and how long each is, s.
const HOVERS: usize = 4;
const HOVER_S: f64 = 12.0;
/// Steps of the delay, and the longest, ms.
const DELAY_STEP: usize = 5;
const LONGEST_DELAY: usize = 150;
/// A loop with more delay than its margin hovers with an error of more than this many times that without, and so much more, m.
const DOUBLED: f64 = 2.0;
const MORE: f64 = 1e-3;

/// Longest delay of the whole loop, ms, with which a hover with the feedback lane alone, which no guard hands over, has hardly a
/// larger error than without. Identified margins know what a delay on the lane's own way does: one before the motors takes phase
/// from the loop within too.
fn flown_delay_margin(validation: &Validation<'_>, bytes: &[u8]) -> Result<f32, LaneRefusal> {
    let model = Model::from_bytes(bytes).map_err(ExportError::Refused)?;
    let lanes = Lanes { network: false, feedback: true };
    let closed_loop = validation.closed_loop.unguarded();
    let hovers = vec![hover(HOVER_S).sampled(closed_loop.rate_hz()).map_err(FlightsError::from)?; HOVERS];
    let error = |milliseconds: usize| -> Result<f64, LaneRefusal> {
        let delayed = closed_loop.delayed(milliseconds as f64 * 1e-3);
        let errors = delayed.errors(&hovers, Some((&model, lanes)), 1.0, validation.seed)?;
        Ok(errors.iter().sum::<f64>() / errors.len() as f64)
    };
    let most = DOUBLED * error(0)? + MORE;
    for milliseconds in (DELAY_STEP..=LONGEST_DELAY).step_by(DELAY_STEP) {
        let found = error(milliseconds)?;
        if !found.is_finite() || found > most {
            return Ok((milliseconds - DELAY_STEP) as f32);
        }
    }
    Ok(LONGEST_DELAY as f32)
}

/// The design with the best score, admissible or not: the feedback lane of the flatness comparison, for which the clamp
/// that suits the network lane would be unfairly small.
///
/// # Errors
/// If there is no design at all.
pub fn strongest_lane(
    recipe: &LaneRecipe,
    validation: &Validation<'_>,
    logs: &[FlightLog],
    encode: &(dyn Fn(&LaneDescription) -> Result<Vec<u8>, ExportError> + Sync),
) -> Result<LaneChoice, LaneRefusal> {
    let (candidates, scores) = flown(recipe, validation, logs, encode)?;
    best(&candidates, &scores, &|_| true).ok_or(LaneRefusal::Flights {
        designs: 0,
        worst: f64::NEG_INFINITY,
        case: "no design".into(),
    })
}

fn best(candidates: &[Candidate], scores: &[Score], wanted: &dyn Fn(&Score) -> bool) -> Option<LaneChoice> {
    let places = candidates.iter().zip(scores).filter(|(_, score)| wanted(score));
    let merit = |score: &Score| score.mean + LOSS_SHARE * (score.over_network + LOSS_AGAINST_NETWORK).min(0.0);
    places.max_by(|(_, a), (_, b)| merit(a).total_cmp(&merit(b))).map(|(candidate, score)| LaneChoice {
        lane: candidate.lane.clone(),
        design: candidate.design.clone(),
        score: score.mean,
        worst: score.worst,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lane_answers_for_the_flights_that_the_network_alone_can_fly() {
        let baseline = [0.1, 0.1, 0.1];
        assert_eq!(worst_to_answer_for(&baseline, &[0.05, 0.05, 0.05], &[0.01, 0.2, 0.02]), -100.0);
        assert_eq!(worst_to_answer_for(&baseline, &[0.05, 2.0, 0.05], &[0.01, 3.0, 0.05]), 50.0);
        assert_eq!(worst_to_answer_for(&baseline, &[2.0; 3], &[3.0; 3]), 100.0);
        // A tumble that only the lane brings about.
        assert!(worst_to_answer_for(&baseline, &[0.05; 3], &[0.01, f64::INFINITY, 0.01]) < 0.0);
    }
}
