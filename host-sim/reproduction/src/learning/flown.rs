//! Flights that learn.
//!
//! *in* a loop, a model or none, strokes; *out* their errors beside the baseline's of the same seeds; *never* a baseline that flew
//! another vehicle or another air; *source* none.

use impromptu_firmware::{adapter::Lanes, learning::Parts, model::Model};
use impromptu_flight::learning::FlightLearning;
use impromptu_sim::{
    flights::Loop,
    rollout::{FlightPlan, RolloutError},
    trajectory::Trajectory,
};
use rayon::prelude::*;

/// Strokes that are not judged where they are flown one after another.
const FIRST: usize = 4;
/// Between the seeds of the flights that teach and those that are judged.
const OTHER_SEEDS: u64 = 1 << 32;

/// What learns.
#[derive(Clone, Copy, Debug)]
pub struct Learned<'a> {
    /// The loop that is flown.
    pub closed_loop: &'a Loop,
    /// The model before it, with both lanes, if there is one.
    pub model: Option<&'a Model<'a>>,
    /// Parts that learn and act.
    pub parts: Parts,
    /// Of the first flight; each has its own.
    pub seed: u64,
}

/// Errors of flights, m.
#[derive(Clone, Debug, Default)]
pub struct Flown {
    /// Without anything.
    pub baseline: Vec<f64>,
    /// With what was learned.
    pub errors: Vec<f64>,
    /// Reduction of the first stroke, %.
    pub first: Option<f64>,
    /// Flown altogether, s.
    pub seconds: f64,
    /// How often what was learned was forgotten.
    pub forgotten: u32,
}

impl<'a> Learned<'a> {
    fn nothing(&self) -> Result<FlightLearning, RolloutError> {
        let mut learning = self.closed_loop.learning()?;
        learning.switch(self.parts, self.parts);
        Ok(learning)
    }

    fn fly(
        &self,
        closed_loop: &Loop,
        trajectory: &Trajectory,
        seed: u64,
        learning: &mut FlightLearning,
    ) -> Result<f64, RolloutError> {
        let model = self.model.map(|model| (model, Lanes::BOTH));
        let plan = FlightPlan { model, guard: closed_loop.guard, ..FlightPlan::new(trajectory, seed) };
        Ok(closed_loop.fly_learning(&plan, learning)?.rms)
    }
}

fn seconds(trajectory: &Trajectory) -> f64 {
    trajectory.samples.len() as f64 / trajectory.rate_hz
}

/// Strokes one after another, each with what those before it taught; the first four are not judged. With `later_s`, they are all
/// judged, flown once more with so much more delay in the loop, each with what all of them taught.
///
/// # Errors
/// If a stroke cannot be flown.
pub fn one_after_another(learned: &Learned<'_>, strokes: &[Trajectory], later_s: f64) -> Result<Flown, RolloutError> {
    let mut learning = learned.nothing()?;
    let closed_loop = learned.closed_loop;
    let mut baseline = closed_loop.errors(strokes, None, 1.0, learned.seed)?;
    let mut errors = Vec::new();
    for (stroke, seed) in strokes.iter().zip(learned.seed..) {
        errors.push(learned.fly(closed_loop, stroke, seed, &mut learning)?);
    }
    let reduction = |(baseline, error): (&f64, &f64)| 100.0 * (1.0 - error / baseline);
    let first = baseline.iter().zip(&errors).map(reduction).next();
    let flown: f64 = strokes.iter().map(seconds).sum();
    if later_s > 0.0 {
        let later = closed_loop.delayed(later_s);
        let (errors, forgotten) = each(learned, &later, &learning, strokes)?;
        let baseline = later.errors(strokes, None, 1.0, learned.seed)?;
        return Ok(Flown { baseline, errors, first, seconds: 2.0 * flown, forgotten });
    }
    let judged = FIRST.min(strokes.len());
    Ok(Flown {
        baseline: baseline.split_off(judged),
        errors: errors.split_off(judged),
        first,
        seconds: flown,
        forgotten: learning.forgotten().into(),
    })
}

/// Each stroke by itself, with what so many seconds of other strokes taught.
///
/// # Errors
/// If a stroke cannot be flown.
pub fn after(learned: &Learned<'_>, taught: u32, teach: &[Trajectory], strokes: &[Trajectory]) -> Result<Flown, RolloutError> {
    let mut learning = learned.nothing()?;
    let mut left = f64::from(taught);
    let mut flown = 0.0;
    for (stroke, seed) in teach.iter().zip(learned.seed.wrapping_add(OTHER_SEEDS)..) {
        if left <= 0.0 {
            break;
        }
        let mut stroke = stroke.clone();
        let ticks = stroke.scored.start + ((left * stroke.rate_hz) as usize).min(stroke.scored.len());
        left -= stroke.scored.len() as f64 / stroke.rate_hz;
        if left < 0.0 {
            stroke.samples.truncate(ticks);
            stroke.scored.end = ticks;
        }
        flown += seconds(&stroke);
        learned.fly(learned.closed_loop, &stroke, seed, &mut learning)?;
    }
    let (errors, forgotten) = each(learned, learned.closed_loop, &learning, strokes)?;
    let baseline = learned.closed_loop.errors(strokes, None, 1.0, learned.seed)?;
    flown += strokes.iter().map(seconds).sum::<f64>();
    Ok(Flown { baseline, errors, first: None, seconds: flown, forgotten })
}

/// Each stroke by itself with what was learned.
fn each(
    learned: &Learned<'_>,
    closed_loop: &Loop,
    learning: &FlightLearning,
    strokes: &[Trajectory],
) -> Result<(Vec<f64>, u32), RolloutError> {
    let fly = |(index, stroke): (usize, &Trajectory)| {
        let mut own = learning.clone();
        let error = learned.fly(closed_loop, stroke, learned.seed.wrapping_add(index as u64), &mut own)?;
        Ok((error, u32::from(own.forgotten() - learning.forgotten())))
    };
    let flown: Vec<(f64, u32)> = strokes.par_iter().enumerate().map(fly).collect::<Result<_, RolloutError>>()?;
    Ok((flown.iter().map(|(error, _)| *error).collect(), flown.iter().map(|(_, forgotten)| forgotten).sum()))
}
