//! Feedback lanes of a loop, and the choice of one of them on models of the loop.
//!
//! *in* models of the axes and pieces of logs that nothing was fitted to; *out* a lane, or why an axis has none; *never* a lane
//! with which any piece, on any model that the logs leave possible, is worse than the loop alone: as logged, with further delay of
//! the whole loop, with more or less gain; *source* `impromptu-training`, which chooses lanes for a simulated vehicle in the same
//! cases.

use impromptu_firmware::{
    Lanes,
    model::{MAX_AXES, Margins, Model},
};
use impromptu_model_export::{
    ExportError,
    description::{AuthorityDescription, LaneAxisDescription, LaneDescription},
};
use impromptu_training::feedback_design::{ArxModel, DesignRefusal, DesignSettings, LaneDesign, design};
use rayon::prelude::*;

use crate::{
    layout::Layout,
    models::Models,
    reading::AxisSignals,
    replay::{Case, Flight, Piece},
};

/// What the sizes of a loop are in those of the loop for which designs were found good: a Crazyflie's, which is 13 cm behind and
/// has a time constant of 0.7 s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Length, in the axis' unit for each metre.
    pub length: f64,
    /// Time, s a second.
    pub time: f64,
}

/// RMS error and lag of that loop, m and s.
const ERROR: f64 = 0.13;
/// See [`ERROR`].
const LAG_S: f64 = 0.7;
/// Memory of a lane and of the model on which it is judged, s of that loop.
const MEMORY_S: [f64; 2] = [0.25, 0.45];
/// Control weights, weights on velocity (s²) and clamps (m) tried.
const CONTROL_WEIGHTS: [f64; 3] = [3e-3, 6e-3, 1.2e-2];
/// See [`CONTROL_WEIGHTS`].
const VELOCITY_WEIGHTS: [f64; 2] = [0.05, 0.2];
/// See [`CONTROL_WEIGHTS`].
const FAST_LIMITS: [f64; 2] = [0.1, 0.15];
/// Clamp of the integral, m; error and desired acceleration at which half of the fast clamp is left, m and m/s².
const INTEGRAL_LIMIT: f64 = 0.3;
/// See [`INTEGRAL_LIMIT`].
const AUTHORITY: [f64; 2] = [0.1, 6.0];
/// Time in which the recent peak of these is forgotten, s.
const FORGOTTEN_S: f64 = 0.33;

impl Scale {
    /// Of a loop whose error and lag, s, are these.
    pub fn of(error: f64, lag_s: f64) -> Self {
        Self { length: (error / ERROR).max(1e-9), time: (lag_s / LAG_S).clamp(1e-4, 1e4) }
    }

    /// Settings of a design at this rate, Hz, with the memory of a loop as slow as `slowest`.
    pub fn settings(&self, rate_hz: f64, slowest: f64) -> DesignSettings {
        let Self { length, time } = *self;
        let ticks = |seconds: f64| (seconds * slowest * rate_hz).round();
        let lags = ticks(MEMORY_S[0]).clamp(6.0, 25.0) as usize;
        let usual = DesignSettings::default();
        let [position, velocity] = usual.least_noise;
        DesignSettings {
            tick: 1.0 / rate_hz,
            lags,
            margin_lags: (ticks(MEMORY_S[1]).clamp(10.0, 45.0) as usize).max(lags),
            integral_weight: usual.integral_weight / (time * time),
            noise_factor: 2.0,
            least_noise: [position * length, velocity * length / time],
            least_excitation: usual.least_excitation * length,
            least_precision: usual.least_precision * time * time * 0.01 * rate_hz,
            ..usual
        }
    }
}

/// An axis of which lanes are designed.
#[derive(Clone, Debug)]
pub struct DesignAxis<'a> {
    /// Its models.
    pub models: &'a Models,
    /// Its sizes.
    pub scale: Scale,
    /// Settings of its designs.
    pub settings: DesignSettings,
    /// Index into the layout's axes.
    pub place: usize,
}

/// A lane of one axis with what it flew.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The axis of the lane.
    pub lane: LaneAxisDescription,
    /// Its margins.
    pub margins: Margins,
    /// The design in words.
    pub design: String,
    /// Score: mean over the cases of 90 % of the average and 10 % of the worst reduction, %.
    pub score: f64,
    /// Worst reduction of any piece on any model in any case, %.
    pub worst: f64,
}

/// Why an axis has no lane.
#[derive(Clone, Debug, thiserror::Error)]
pub enum NoLane {
    /// No design exists.
    #[error("{0}")]
    Design(#[from] DesignRefusal),
    /// Other axes gain more.
    #[error("a model holds {MAX_AXES} lanes, and other axes gain more by theirs")]
    Full,
    /// None is good enough.
    #[error(
        "of {designs} designs none left every piece of the logs better than the loop alone; the best one's worst was {worst:.0} % ({case})"
    )]
    Worse {
        /// Designs.
        designs: usize,
        /// Worst reduction of the best one, %.
        worst: f64,
        /// The case.
        case: &'static str,
    },
}

/// Cases of a loop that is told references at this rate and is as slow as `time`: 10 and 20 ms later for the loop for which
/// designs were found good.
fn cases(rate_hz: f64, time: f64) -> [(f64, Case); 5] {
    let ticks = |seconds: f64| (seconds * time * rate_hz).ceil() as usize;
    [
        (0.4, Case::NOMINAL),
        (0.125, Case { name: "a little later", delay: ticks(0.01), gain: 1.0 }),
        (0.225, Case { name: "later", delay: ticks(0.02), gain: 1.0 }),
        (0.125, Case { name: "loop gain 0.7", delay: 0, gain: 0.7 }),
        (0.125, Case { name: "loop gain 1.3", delay: 0, gain: 1.3 }),
    ]
}

/// One point of the grid, designed for every axis.
struct Candidate {
    axes: Vec<Result<(LaneAxisDescription, Margins), DesignRefusal>>,
    words: String,
}

/// What judges lanes.
pub struct Judge<'a> {
    /// Signals of the loop.
    pub layout: &'a Layout,
    /// Rate of the references, Hz.
    pub rate_hz: f64,
    /// Age of what is measured, ticks.
    pub age_ticks: f64,
    /// Ticks of a piece that are not judged: the lanes fade in.
    pub settled: usize,
    /// Pieces of logs: of each the signals of every axis of the layout.
    pub pieces: Vec<Vec<&'a AxisSignals>>,
    /// Makes a model file with a lane; the network lane flies too.
    pub encode: &'a (dyn Fn(Option<&LaneDescription>) -> Result<Vec<u8>, ExportError> + Sync),
}

/// Authority of a lane over axes of these sizes.
pub fn authority(layout: &Layout, axes: &[DesignAxis<'_>], rate_hz: f64) -> AuthorityDescription {
    let largest = axes.iter().map(|axis| axis.scale.length).fold(0.0, f64::max);
    let fastest = axes.iter().map(|axis| axis.scale.length / axis.scale.time.powi(2)).fold(0.0, f64::max);
    let slowest = axes.iter().map(|axis| axis.scale.time).fold(0.0, f64::max);
    let channels: Vec<u8> = axes.iter().filter_map(|axis| layout.axes[axis.place].desired[2]).take(4).collect();
    AuthorityDescription {
        channels,
        scale: (AUTHORITY[1] * fastest) as f32,
        error_scale: (AUTHORITY[0] * largest) as f32,
        decay: (-1.0 / (FORGOTTEN_S * slowest * rate_hz)).exp() as f32,
    }
}

fn stored(
    layout: &Layout,
    axis: &DesignAxis<'_>,
    output: u8,
    designed: &LaneDesign,
    fast_limit: f64,
) -> (LaneAxisDescription, Margins) {
    let channels = &layout.axes[axis.place];
    let coefficients: Vec<f32> = designed.gain.stored_coefficients().iter().map(|value| *value as f32).collect();
    let lags = designed.gain.lags();
    let mut errors = Vec::new();
    let mut error_coefficients = Vec::new();
    for (derivative, these) in coefficients.chunks(lags).take(2).enumerate() {
        if let (Some(measured), Some(desired)) = (channels.measured[derivative], channels.desired[derivative]) {
            errors.push((measured, desired));
            error_coefficients.push(these.to_vec());
        }
    }
    let lane = LaneAxisDescription {
        output,
        errors,
        error_coefficients,
        output_coefficients: coefficients[2 * lags..].to_vec(),
        integral: designed.gain.integral_coefficient as f32,
        fast_limit: (fast_limit * axis.scale.length) as f32,
        integral_limit: (INTEGRAL_LIMIT * axis.scale.length) as f32,
    };
    let margins = designed.assessment.margins.as_ref().map_or(Margins::default(), |margins| Margins {
        delay_ms: margins.delay_milliseconds.map_or(f32::MAX, |value| value as f32),
        gain: margins.gain_up.map_or(f32::MAX, |value| value as f32),
        modulus: margins.modulus as f32,
    });
    (lane, margins)
}

fn candidates(layout: &Layout, axes: &[DesignAxis<'_>]) -> Vec<Candidate> {
    let grid: Vec<(f64, f64)> =
        CONTROL_WEIGHTS.iter().flat_map(|control| VELOCITY_WEIGHTS.iter().map(move |velocity| (*control, *velocity))).collect();
    let designs: Vec<Vec<Result<LaneDesign, DesignRefusal>>> = grid
        .par_iter()
        .map(|&(control_weight, velocity)| {
            let settings = |axis: &DesignAxis<'_>| DesignSettings {
                control_weight,
                velocity_weight: velocity * axis.scale.time * axis.scale.time,
                ..axis.settings.clone()
            };
            axes.iter().map(|axis| design(&axis.models.data, &settings(axis))).collect()
        })
        .collect();
    let mut candidates = Vec::new();
    for ((control, velocity), designs) in grid.iter().zip(&designs) {
        for fast_limit in FAST_LIMITS {
            let axes = axes.iter().zip(designs).zip(0u8..).map(|((axis, designed), output)| match designed {
                Ok(designed) => Ok(stored(layout, axis, output, designed, fast_limit)),
                Err(refusal) => Err(refusal.clone()),
            });
            candidates.push(Candidate {
                axes: axes.collect(),
                words: format!("control weight {control}, e_v {velocity}, fast clamp {fast_limit}"),
            });
        }
    }
    candidates
}

/// A lane of these axes, with the smallest of their margins.
pub fn lane_of(axes: &[(&LaneAxisDescription, Margins)], authority: AuthorityDescription) -> LaneDescription {
    let worst = |of: fn(&Margins) -> f32| axes.iter().map(|(_, margins)| of(margins)).fold(f32::MAX, f32::min);
    LaneDescription {
        axes: axes.iter().map(|(lane, _)| (*lane).clone()).collect(),
        authority,
        margins: Margins {
            delay_ms: worst(|margins| margins.delay_ms),
            gain: worst(|margins| margins.gain),
            modulus: worst(|margins| margins.modulus),
        },
    }
}

/// How a candidate did on an axis.
#[derive(Clone, Copy)]
struct Score {
    mean: f64,
    worst: f64,
    case: &'static str,
}

impl Judge<'_> {
    /// Pieces on each set of models: the models themselves, then the draws.
    fn benches<'m>(&'m self, axes: &'m [DesignAxis<'_>], draws: usize) -> Vec<Vec<Piece<'m>>> {
        let sets = std::iter::once(None).chain((0..draws).map(Some));
        sets.map(|draw| {
            let model = |axis: &'m DesignAxis<'_>| -> &'m ArxModel {
                draw.and_then(|draw| axis.models.draws.get(draw)).unwrap_or(&axis.models.whole)
            };
            let models: Vec<&ArxModel> = axes.iter().map(model).collect();
            self.pieces.iter().map(|signals| Piece::new(signals.clone(), models.clone(), self.rate_hz)).collect()
        })
        .collect()
    }

    /// RMS errors, [piece][axis], of a model's lanes.
    ///
    /// # Errors
    /// If the model is refused.
    fn errors(&self, bench: &[Piece<'_>], case: Case, model: Option<(&[u8], Lanes)>) -> Result<Vec<Vec<f64>>, ExportError> {
        let Some((bytes, lanes)) = model else {
            return Ok(bench.iter().map(|piece| piece.errors(case, self.age_ticks, self.settled, None)).collect());
        };
        let model = Model::from_bytes(bytes).map_err(ExportError::Refused)?;
        bench
            .iter()
            .map(|piece| {
                let mut flight = Flight::new(&model, self.layout, self.rate_hz, lanes, false).map_err(ExportError::Refused)?;
                Ok(piece.errors(case, self.age_ticks, self.settled, Some(&mut flight)))
            })
            .collect()
    }

    /// Of each axis the best lane, or why it has none.
    ///
    /// # Errors
    /// If a model cannot be made.
    pub fn choose(&self, axes: &[DesignAxis<'_>], draws: usize) -> Result<Vec<Result<Chosen, NoLane>>, ExportError> {
        let candidates = candidates(self.layout, axes);
        let authority = authority(self.layout, axes, self.rate_hz);
        let slowest = axes.iter().map(|axis| axis.scale.time).fold(f64::INFINITY, f64::min);
        let cases = cases(self.rate_hz, slowest);
        let benches = self.benches(axes, draws);
        let network = (self.encode)(None)?;
        // Of each bench and case the errors without anything, and with the network lane alone.
        let alone: Vec<Vec<[Vec<Vec<f64>>; 2]>> = benches
            .par_iter()
            .map(|bench| {
                let pair = |case| {
                    let lanes = Lanes { network: true, feedback: false };
                    Ok([self.errors(bench, case, None)?, self.errors(bench, case, Some((&network, lanes)))?])
                };
                cases.iter().map(|(_, case)| pair(*case)).collect::<Result<_, ExportError>>()
            })
            .collect::<Result<_, _>>()?;
        let scores: Vec<Vec<Option<Score>>> = candidates
            .par_iter()
            .map(|candidate| {
                let designed: Vec<(&LaneAxisDescription, Margins)> =
                    candidate.axes.iter().filter_map(|axis| axis.as_ref().ok()).map(|(lane, margins)| (lane, *margins)).collect();
                if designed.is_empty() {
                    return Ok(vec![None; axes.len()]);
                }
                let bytes = (self.encode)(Some(&lane_of(&designed, authority.clone())))?;
                let mut scores: Vec<Option<Score>> = candidate
                    .axes
                    .iter()
                    .map(|axis| axis.as_ref().ok().map(|_| Score { mean: 0.0, worst: f64::INFINITY, case: "" }))
                    .collect();
                for (bench, alone) in benches.iter().zip(&alone) {
                    let usual = &alone[0][0];
                    for ((weight, case), [baseline, network]) in cases.iter().zip(alone) {
                        let errors = self.errors(bench, *case, Some((&bytes, Lanes::BOTH)))?;
                        for (axis, score) in scores.iter_mut().enumerate() {
                            let Some(score) = score else { continue };
                            let of = |errors: &[Vec<f64>]| errors.iter().map(|errors| errors[axis]).collect::<Vec<_>>();
                            // A model that swings by itself in this case is not this loop, or the loop is to blame.
                            if rms(&of(baseline)) > SWINGS * rms(&of(usual)) {
                                continue;
                            }
                            score.add(*weight / benches.len() as f64, case.name, [&of(baseline), &of(network), &of(&errors)]);
                        }
                    }
                }
                Ok(scores)
            })
            .collect::<Result<_, ExportError>>()?;
        Ok((0..axes.len()).map(|axis| best(&candidates, &scores, axis)).collect())
    }

    /// Reductions, %, of each axis on each set of models and each piece: [axis][flight], with errors without and with.
    ///
    /// # Errors
    /// If the model is refused.
    pub fn predicted(
        &self,
        axes: &[DesignAxis<'_>],
        draws: usize,
        model: &[u8],
        lanes: Lanes,
    ) -> Result<Vec<Vec<[f64; 2]>>, ExportError> {
        let benches = self.benches(axes, draws);
        let flown: Vec<Vec<Vec<[f64; 2]>>> = benches
            .par_iter()
            .map(|bench| {
                let baseline = self.errors(bench, Case::NOMINAL, None)?;
                let errors = self.errors(bench, Case::NOMINAL, Some((model, lanes)))?;
                let pairs = baseline.iter().zip(&errors).map(|(a, b)| a.iter().zip(b).map(|(a, b)| [*a, *b]).collect());
                Ok::<_, ExportError>(pairs.collect())
            })
            .collect::<Result<_, _>>()?;
        Ok((0..axes.len()).map(|axis| flown.iter().flatten().map(|flight| flight[axis]).collect()).collect())
    }
}

/// A loop without an add-on swings by itself in a case whose error is so many times that of the logs.
const SWINGS: f64 = 1.5;

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

impl Score {
    /// Adds flights of one case: without anything, with the network lane alone, with both lanes.
    fn add(&mut self, weight: f64, case: &'static str, [baseline, network, errors]: [&[f64]; 3]) {
        let flights = || baseline.iter().zip(network).zip(errors);
        let logs: f64 = flights().map(|((baseline, _), error)| (error.max(1e-12) / baseline.max(1e-12)).ln()).sum();
        let mean = 100.0 * (1.0 - (logs / baseline.len().max(1) as f64).exp());
        // A lane answers for the flights that the network lane alone can fly.
        let answerable = flights().filter(|((baseline, network), _)| network <= baseline);
        let worst = answerable.map(|((baseline, _), error)| 100.0 * (1.0 - error / baseline)).fold(100.0, f64::min);
        self.mean += weight * (0.9 * mean + 0.1 * worst);
        if worst < self.worst {
            (self.worst, self.case) = (worst, case);
        }
    }
}

fn best(candidates: &[Candidate], scores: &[Vec<Option<Score>>], axis: usize) -> Result<Chosen, NoLane> {
    let scored = || candidates.iter().zip(scores).filter_map(|(candidate, scores)| scores[axis].map(|score| (candidate, score)));
    let good = scored().filter(|(_, score)| score.worst >= 0.0).max_by(|(_, a), (_, b)| a.mean.total_cmp(&b.mean));
    if let Some((candidate, Score { mean, worst, .. })) = good
        && let Ok((lane, margins)) = &candidate.axes[axis]
    {
        return Ok(Chosen { lane: lane.clone(), margins: *margins, design: candidate.words.clone(), score: mean, worst });
    }
    match scored().max_by(|(_, a), (_, b)| a.worst.total_cmp(&b.worst)) {
        Some((_, score)) => Err(NoLane::Worse { designs: scored().count(), worst: score.worst, case: score.case }),
        None => match candidates.iter().find_map(|candidate| candidate.axes[axis].as_ref().err()) {
            Some(refusal) => Err(NoLane::Design(refusal.clone())),
            None => Err(NoLane::Worse { designs: 0, worst: f64::NEG_INFINITY, case: "no design" }),
        },
    }
}
