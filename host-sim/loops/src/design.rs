//! Feedback lanes of a loop, and the choice of one of them on models of the loop.
//!
//! *in* models of the axes and pieces of logs that nothing was fitted to; *out* a lane, or why an axis has none; *never* a lane
//! with which any piece, on any model that the logs leave possible, is worse than the loop alone: as logged, with further delay
//! of the whole loop, with more or less gain; *source* `impromptu-training`, which chooses lanes for a simulated vehicle in
//! the same cases.

use impromptu_diagnosis::prediction::root_mean_square;
use impromptu_firmware::{
    Lanes,
    model::{LargestModel, Margins},
};
use impromptu_model_export::{
    ExportError,
    description::{AuthorityDescription, LaneAxisDescription, LaneDescription},
};
use impromptu_training::{
    feedback_design::{ArxModel, DesignRefusal},
    lane::worst_to_answer_for,
};
use rayon::prelude::*;

use crate::{
    candidates::{Candidate, DesignAxis, authority, candidates, lane_of},
    layout::Layout,
    reading::AxisSignals,
    replay::{Case, Flight, Piece},
};

/// A lane of one axis with what it flew.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The axis of the lane.
    pub lane: LaneAxisDescription,
    /// Its margins.
    pub margins: Margins,
    /// The design in words.
    pub design: String,
    /// Worst reduction of any piece on any model in any case, %.
    pub worst: f64,
}

/// Why an axis has no lane.
#[derive(Clone, Debug, thiserror::Error)]
pub enum NoLane {
    /// No design exists.
    #[error("{0}")]
    Design(#[from] DesignRefusal),
    /// None is good enough.
    #[error(
        "of {designs} designs none left every piece of the logs better than the loop alone; the best one's worst was \
         {worst:.0} % ({case})"
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

/// Makes a model file with a lane.
pub type Encode<'a> = dyn Fn(Option<&LaneDescription>) -> Result<Vec<u8>, ExportError> + Sync + 'a;

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
    pub encode: &'a Encode<'a>,
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
    pub fn benches<'m>(&'m self, axes: &'m [DesignAxis<'_>], draws: usize) -> Vec<Vec<Piece<'m>>> {
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
        self.errors_guarded(bench, case, model, false)
    }

    /// The same with the add-on's guard on or off.
    fn errors_guarded(
        &self,
        bench: &[Piece<'_>],
        case: Case,
        model: Option<(&[u8], Lanes)>,
        guarded: bool,
    ) -> Result<Vec<Vec<f64>>, ExportError> {
        let Some((bytes, lanes)) = model else {
            return Ok(bench.iter().map(|piece| piece.errors(case, self.age_ticks, self.settled, None)).collect());
        };
        let model = LargestModel::sized(bytes).map_err(ExportError::Refused)?;
        bench
            .iter()
            .map(|piece| {
                let mut flight = Flight::new(&model, self.layout, self.rate_hz, lanes, guarded).map_err(ExportError::Refused)?;
                Ok(piece.errors(case, self.age_ticks, self.settled, Some(&mut flight)))
            })
            .collect()
    }

    /// Of each axis the best lane, or why it has none.
    ///
    /// # Errors
    /// If a model cannot be made.
    pub fn choose(
        &self,
        axes: &[DesignAxis<'_>],
        benches: &[Vec<Piece<'_>>],
    ) -> Result<Vec<Result<Chosen, NoLane>>, ExportError> {
        let candidates = candidates(self.layout, axes);
        let authority = authority(self.layout, axes, self.rate_hz);
        let slowest = axes.iter().map(|axis| axis.scale.time).fold(f64::INFINITY, f64::min);
        let cases = cases(self.rate_hz, slowest);
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
            .map(|candidate| self.scores(candidate, &authority, &cases, benches, &alone))
            .collect::<Result<_, _>>()?;
        Ok((0..axes.len()).map(|axis| best(&candidates, &scores, axis)).collect())
    }

    /// How a candidate does on each axis.
    fn scores(
        &self,
        candidate: &Candidate,
        authority: &AuthorityDescription,
        cases: &[(f64, Case)],
        benches: &[Vec<Piece<'_>>],
        alone: &[Vec<[Vec<Vec<f64>>; 2]>],
    ) -> Result<Vec<Option<Score>>, ExportError> {
        let mut scores = vec![None; candidate.axes.len()];
        let designed: Vec<(usize, &LaneAxisDescription, Margins)> = candidate
            .axes
            .iter()
            .enumerate()
            .filter_map(|(axis, designed)| designed.as_ref().ok().map(|(lane, margins)| (axis, lane, *margins)))
            .collect();
        if designed.is_empty() {
            return Ok(scores);
        }
        let parts: Vec<_> = designed.iter().map(|(_, lane, margins)| (*lane, *margins)).collect();
        let bytes = (self.encode)(Some(&lane_of(&parts, authority.clone())))?;
        for (bench, alone) in benches.iter().zip(alone) {
            let usual = &alone[0][0];
            for ((weight, case), [baseline, network]) in cases.iter().zip(alone) {
                let errors = self.errors(bench, *case, Some((&bytes, Lanes::BOTH)))?;
                for (axis, ..) in &designed {
                    let of = |errors: &[Vec<f64>]| errors.iter().map(|errors| errors[*axis]).collect::<Vec<_>>();
                    let score = scores[*axis].get_or_insert(Score { mean: 0.0, worst: f64::INFINITY, case: "" });
                    // A model that swings by itself in this case is not this loop, or the loop is to blame.
                    if root_mean_square(of(baseline)) <= SWINGS * root_mean_square(of(usual)) {
                        score.add(*weight / benches.len() as f64, case.name, [&of(baseline), &of(network), &of(&errors)]);
                    }
                }
            }
        }
        Ok(scores)
    }

    /// RMS errors without and with a model, whose guard is on or off, of each axis on each set of models and each piece.
    ///
    /// # Errors
    /// If the model is refused.
    pub fn predicted(
        &self,
        benches: &[Vec<Piece<'_>>],
        (model, lanes): (&[u8], Lanes),
        guarded: bool,
    ) -> Result<Vec<Vec<[f64; 2]>>, ExportError> {
        let flown: Vec<Vec<Vec<[f64; 2]>>> = benches
            .par_iter()
            .map(|bench| {
                let baseline = self.errors(bench, Case::NOMINAL, None)?;
                let errors = self.errors_guarded(bench, Case::NOMINAL, Some((model, lanes)), guarded)?;
                let pairs = baseline.iter().zip(&errors).map(|(a, b)| a.iter().zip(b).map(|(a, b)| [*a, *b]).collect());
                Ok::<_, ExportError>(pairs.collect())
            })
            .collect::<Result<_, _>>()?;
        let axes = self.layout.axes.len();
        Ok((0..axes).map(|axis| flown.iter().flatten().map(|flight| flight[axis]).collect()).collect())
    }
}

/// A loop without an add-on swings by itself in a case whose error is so many times that of the logs.
const SWINGS: f64 = 1.5;

impl Score {
    /// Adds flights of one case: without anything, with the network lane alone, with both lanes.
    fn add(&mut self, weight: f64, case: &'static str, [baseline, network, errors]: [&[f64]; 3]) {
        let ratios = baseline.iter().zip(errors).map(|(baseline, error)| error.max(1e-12) / baseline.max(1e-12));
        let logs = ratios.map(f64::ln).sum::<f64>();
        let mean = 100.0 * (1.0 - (logs / baseline.len().max(1) as f64).exp());
        let worst = worst_to_answer_for(baseline, network, errors);
        self.mean += weight * (0.9 * mean + 0.1 * worst);
        if worst < self.worst {
            (self.worst, self.case) = (worst, case);
        }
    }
}

fn best(candidates: &[Candidate], scores: &[Vec<Option<Score>>], axis: usize) -> Result<Chosen, NoLane> {
    let scored = || candidates.iter().zip(scores).filter_map(|(candidate, scores)| scores[axis].map(|score| (candidate, score)));
    let good = scored().filter(|(_, score)| score.worst >= 0.0).max_by(|(_, a), (_, b)| a.mean.total_cmp(&b.mean));
    if let Some((candidate, Score { worst, .. })) = good
        && let Ok((lane, margins)) = &candidate.axes[axis]
    {
        return Ok(Chosen { lane: lane.clone(), margins: *margins, design: candidate.words.clone(), worst });
    }
    match scored().max_by(|(_, a), (_, b)| a.worst.total_cmp(&b.worst)) {
        Some((_, score)) => Err(NoLane::Worse { designs: scored().count(), worst: score.worst, case: score.case }),
        None => match candidates.iter().find_map(|candidate| candidate.axes[axis].as_ref().err()) {
            Some(refusal) => Err(NoLane::Design(refusal.clone())),
            None => Err(NoLane::Worse { designs: 0, worst: f64::NEG_INFINITY, case: "no design" }),
        },
    }
}
