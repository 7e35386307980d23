//! Choice of the feedback lane: designs from dithered logs, judged in flight.
//!
//! A design is admissible if no validation flight, at nominal, with 10 and 20 ms more delay in the whole loop, and with the loop's gain
//! times 0.7 and 1.3, is worse than the baseline's flight of the same trajectory. Among the admissible ones the best mean over all of
//! these flights is taken: what a user gets when the vehicle is not quite the one that was identified.

use impromptu_firmware::{
    adapter::Lanes,
    model::{Margins, Model},
};
use impromptu_model_export::{
    ExportError,
    description::{LaneAxisDescription, LaneDescription},
};
use rayon::prelude::*;

use super::{
    flights::{FlightsError, Loop, reduction},
    recipe::{LaneRecipe, Recipe},
};
use crate::{
    feedback_design::{AxisLog, DesignRefusal, DesignSettings, IdentificationData, LaneDesign, design},
    flight_log::FlightLog,
    rollout::{Dither, RolloutError},
    trajectory::Trajectory,
};

/// Why a model is written without a feedback lane.
#[derive(Debug, thiserror::Error)]
pub enum LaneRefusal {
    /// The identification or every design was refused.
    #[error("{axis}: {reason}")]
    Design {
        /// Axis that was refused.
        axis: &'static str,
        /// Why.
        reason: DesignRefusal,
    },
    /// No design passed the validation flights.
    #[error("of {designs} designs none passed the validation flights; the best one's worst flight was {worst:.1} % ({case})")]
    Flights {
        /// Designs that were flown.
        designs: usize,
        /// Reduction of the worst flight of the best design, per cent.
        worst: f64,
        /// The case in which that was.
        case: String,
    },
    /// Flights could not be flown.
    #[error(transparent)]
    Rollout(#[from] FlightsError),
    /// A candidate could not be encoded.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<RolloutError> for LaneRefusal {
    fn from(error: RolloutError) -> Self {
        Self::Rollout(error.into())
    }
}

/// The lane that was chosen.
#[derive(Clone, Debug)]
pub struct LaneChoice {
    /// What is stored.
    pub lane: LaneDescription,
    /// The design in words.
    pub design: String,
    /// Mean reduction over all validation flights, per cent.
    pub mean: f64,
    /// Worst reduction over all validation flights, per cent.
    pub worst: f64,
}

/// One design, ready to be flown.
struct Candidate {
    lane: LaneDescription,
    design: String,
}

/// A way in which validation flights differ from the design.
struct Case {
    name: &'static str,
    delay_s: f64,
    loop_gain: f32,
}

const CASES: [Case; 5] = [
    Case { name: "nominal", delay_s: 0.0, loop_gain: 1.0 },
    Case { name: "+10 ms", delay_s: 0.01, loop_gain: 1.0 },
    Case { name: "+20 ms", delay_s: 0.02, loop_gain: 1.0 },
    Case { name: "loop gain 0.7", delay_s: 0.0, loop_gain: 0.7 },
    Case { name: "loop gain 1.3", delay_s: 0.0, loop_gain: 1.3 },
];

/// Identification data of x and y pooled, and of z.
fn identification(logs: &[FlightLog], lags: usize) -> Result<[IdentificationData; 2], LaneRefusal> {
    let signals: Vec<[Vec<f64>; 5]> = logs
        .iter()
        .flat_map(|log| {
            (0..3).map(|axis| {
                let column = |value: &dyn Fn(&crate::flight_log::LogRow) -> f64| log.rows.iter().map(value).collect::<Vec<f64>>();
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
    for &effort in &recipe.efforts {
        for &velocity_weight in &recipe.velocity_weights {
            for &noise_factor in &recipe.noise_factors {
                grid.push(DesignSettings { effort, velocity_weight, noise_factor, ..recipe.design.clone() });
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
        for &fast_limit in &recipe.fast_limits {
            candidates.push(Candidate {
                lane: describe(&[&horizontal, &horizontal, &vertical], fast_limit, recipe.integral_limit),
                design: format!(
                    "effort {}, e_v {}, noise x{}, fast clamp {} m",
                    settings.effort, settings.velocity_weight, settings.noise_factor, fast_limit
                ),
            });
        }
    }
    match refusal {
        Some(reason) if candidates.is_empty() => Err(reason),
        _ => Ok(candidates),
    }
}

/// A design for each axis as the firmware stores it: errors of position and velocity, output on the position reference.
fn describe(designs: &[&LaneDesign; 3], fast_limit: f64, integral_limit: f64) -> LaneDescription {
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
                integral_limit: integral_limit as f32,
            }
        })
        .collect();
    LaneDescription { axes, margins: worst_margins(designs) }
}

/// The smallest margins over the axes; zero where the longer model is unstable.
fn worst_margins(designs: &[&LaneDesign; 3]) -> Margins {
    let mut worst = Margins { delay_ms: f32::MAX, gain: f32::MAX, modulus: f32::MAX };
    for design in designs {
        let found = design.assessment.margins.as_ref().map_or(Margins::default(), |margins| Margins {
            delay_ms: margins.delay_milliseconds.map_or(f32::MAX, |value| value as f32),
            gain: margins.gain_up.map_or(f32::MAX, |value| value as f32),
            modulus: margins.modulus as f32,
        });
        worst.delay_ms = worst.delay_ms.min(found.delay_ms);
        worst.gain = worst.gain.min(found.gain);
        worst.modulus = worst.modulus.min(found.modulus);
    }
    worst
}

/// Collects dithered logs.
///
/// # Errors
/// If they cannot be flown.
pub fn dithered_logs(recipe: &LaneRecipe, plant: &Loop, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
    let dither = Dither { amplitude: recipe.dither, hold_s: recipe.dither_hold_s };
    plant.collect(&recipe.excitation.motions(seed), Some(dither), seed)
}

/// Designs lanes from dithered `logs` and chooses one by flights over the `validation` trajectories. `encode` makes a
/// model file with a lane; the network lane flies too.
///
/// # Errors
/// With the reason why there is no lane.
pub fn choose_lane(
    recipe: &Recipe,
    plant: &Loop,
    logs: &[FlightLog],
    validation: &[Trajectory],
    seed: u64,
    encode: &(dyn Fn(&LaneDescription) -> Result<Vec<u8>, ExportError> + Sync),
) -> Result<LaneChoice, LaneRefusal> {
    let candidates = candidates(&recipe.lane, logs)?;
    let loops: Vec<Loop> =
        CASES.iter().map(|case| Loop { condition: plant.condition.delayed(case.delay_s), ..plant.clone() }).collect();
    let baselines: Vec<Vec<f64>> =
        loops.iter().map(|plant| plant.errors(validation, None, 1.0, seed)).collect::<Result<_, _>>()?;
    let scores: Vec<(f64, f64, &'static str)> = candidates
        .par_iter()
        .map(|candidate| {
            let bytes = encode(&candidate.lane)?;
            let model = Model::from_bytes(&bytes).map_err(ExportError::Refused)?;
            let (mut sum, mut worst, mut worst_case) = (0.0, f64::INFINITY, "");
            for ((case, plant), baseline) in CASES.iter().zip(&loops).zip(&baselines) {
                let errors = plant.errors(validation, Some((&model, Lanes::BOTH)), case.loop_gain, seed)?;
                let (mean, least) = reduction(baseline, &errors);
                sum += mean / CASES.len() as f64;
                if least < worst {
                    (worst, worst_case) = (least, case.name);
                }
            }
            Ok((sum, worst, worst_case))
        })
        .collect::<Result<_, LaneRefusal>>()?;
    let best = |admissible: &dyn Fn(&(f64, f64, &str)) -> bool| {
        let places = scores.iter().enumerate().filter(|(_, score)| admissible(score));
        places.max_by(|(_, a), (_, b)| a.0.total_cmp(&b.0)).map(|(place, _)| place)
    };
    match best(&|score| score.1 >= 0.0) {
        Some(place) => {
            let Candidate { lane, design } = &candidates[place];
            let (mean, worst, _) = scores[place];
            Ok(LaneChoice { lane: lane.clone(), design: design.clone(), mean, worst })
        }
        None => {
            let least = scores.iter().max_by(|a, b| a.1.total_cmp(&b.1));
            let (_, worst, case) = least.copied().unwrap_or((f64::NEG_INFINITY, f64::NEG_INFINITY, "no design"));
            Err(LaneRefusal::Flights { designs: candidates.len(), worst, case: case.into() })
        }
    }
}
