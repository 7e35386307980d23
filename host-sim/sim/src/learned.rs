//! Flights that learn, and what is left of the error.
//!
//! *in* a loop, a model or none, trajectories; *out* their errors beside the baseline's of the same seeds; *never* a baseline
//! that flew another vehicle or another air; *source* ours ([`impromptu_flight::learning`]).

use impromptu_firmware::{
    adapter::Lanes,
    learning::{Parts, Phase, Problem, Progress},
    model::Model,
};
use impromptu_flight::learning::FlightLearning;
#[cfg(feature = "threads")]
use rayon::prelude::*;

use crate::{
    flight_log::{FlightLog, LogRow},
    flights::{Guessed, Loop, Response, reduction},
    rollout::{FlightPlan, RolloutError},
    trajectory::{Trajectory, TrajectoryError, hover, stroke},
};

/// Strokes that are not judged where they are flown one after another.
const FIRST: usize = 4;
/// Between the seeds of the flights that teach and those that are judged.
const OTHER_SEEDS: u64 = 1 << 32;
/// Hover in which responses are measured, s: rest, steps and fit take fifteen of it, twice as much of a
/// slow loop.
const HOVER_S: f64 = 32.0;
/// The same of strokes.
const OTHER_STROKES: u64 = 0x7ea_c413;

/// What learns.
#[derive(Clone, Copy, Debug)]
pub struct LearningLoop<'a> {
    /// The loop that is flown.
    pub closed_loop: &'a Loop,
    /// The model before it and its lanes, if there is one.
    pub model: Option<(&'a Model<'a>, Lanes)>,
    /// Parts that learn and act.
    pub parts: Parts,
    /// How the response is known.
    pub response: Response,
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

impl Flown {
    /// Flights of several vehicles as those of one.
    pub fn together(all: impl IntoIterator<Item = Self>) -> Self {
        all.into_iter().fold(Self::default(), |mut sum, flown| {
            sum.baseline.extend(flown.baseline);
            sum.errors.extend(flown.errors);
            sum.seconds += flown.seconds;
            sum.forgotten += flown.forgotten;
            sum
        })
    }
}

impl<'a> LearningLoop<'a> {
    fn nothing(&self) -> Result<FlightLearning, RolloutError> {
        let guessed = match self.response {
            Response::Guessed(guessed) => guessed,
            Response::Commissioned => Guessed::RIGHT,
        };
        let mut learning = self.closed_loop.learning(&guessed)?;
        if self.response == Response::Commissioned {
            commission(self.closed_loop, &mut learning, self.seed)?;
        }
        learning.add_on().switch(self.parts, self.parts);
        Ok(learning)
    }

    fn fly(
        &self,
        closed_loop: &Loop,
        trajectory: &Trajectory,
        seed: u64,
        learning: &mut FlightLearning,
    ) -> Result<f64, RolloutError> {
        let plan = FlightPlan { model: self.model, guard: closed_loop.guard, ..FlightPlan::new(trajectory, seed) };
        Ok(closed_loop.fly_learning(&plan, learning)?.rms)
    }
}

/// The hover in which responses are measured.
///
/// # Errors
/// If the rate is none.
pub fn commissioning(rate_hz: f64) -> Result<Trajectory, TrajectoryError> {
    hover(HOVER_S).sampled(rate_hz)
}

/// Hovers until the responses are measured, after which it learns; `None`, or why they were not: then it learns with the guess. A
/// model does not correct meanwhile: its feedback lane would take the steps for a disturbance.
///
/// # Errors
/// If it cannot be flown.
pub fn commission(closed_loop: &Loop, learning: &mut FlightLearning, seed: u64) -> Result<Option<Problem>, RolloutError> {
    let hover = commissioning(closed_loop.rate_hz()).map_err(|error| RolloutError::Commission(error.to_string()))?;
    learning.add_on().commission();
    closed_loop.fly_learning(&FlightPlan::new(&hover, seed ^ OTHER_SEEDS), learning)?;
    match learning.progress() {
        Progress { phase: Phase::Learning, problem, .. } => Ok(problem),
        Progress { commissioned, .. } => Err(RolloutError::Commission(format!("{:.0} % done", 100.0 * commissioned))),
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
pub fn one_after_another(learned: &LearningLoop<'_>, strokes: &[Trajectory], later_s: f64) -> Result<Flown, RolloutError> {
    let mut learning = learned.nothing()?;
    let closed_loop = learned.closed_loop;
    let mut baseline = closed_loop.errors(strokes, None, 1.0, learned.seed)?;
    let mut errors = Vec::new();
    for (stroke, seed) in strokes.iter().zip(learned.seed..) {
        errors.push(learned.fly(closed_loop, stroke, seed, &mut learning)?);
    }
    let first = baseline.first().zip(errors.first()).map(|(baseline, error)| reduction(&[*baseline], &[*error]).0);
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
        forgotten: learning.progress().forgotten.into(),
    })
}

/// Strokes of so many seconds of motion and more that teach, none of which is judged: those that leave their plane, so that every
/// axis moves.
///
/// # Errors
/// If they cannot be sampled.
pub fn teaching(seed: u64, motion_s: u32, speed: f64, rate_hz: f64) -> Result<Vec<Trajectory>, TrajectoryError> {
    // One takes eight seconds and more at normal speed.
    let count = 1 + (f64::from(motion_s) * speed / 8.0).ceil() as u64;
    (0..count).map(|index| stroke(seed ^ OTHER_STROKES, 4 * index + 3).scaled(speed).sampled(rate_hz)).collect()
}

/// What so many seconds of motion of strokes teach, flown one after another, and how long they took with their rests, s.
///
/// # Errors
/// If a stroke cannot be flown.
pub fn taught(learned: &LearningLoop<'_>, motion_s: u32, strokes: &[Trajectory]) -> Result<(FlightLearning, f64), RolloutError> {
    let mut learning = learned.nothing()?;
    let mut left = f64::from(motion_s);
    let mut flown = 0.0;
    for (stroke, seed) in strokes.iter().zip(learned.seed.wrapping_add(OTHER_SEEDS)..) {
        if left <= 0.0 {
            break;
        }
        let mut stroke = stroke.clone();
        let ticks = (left * stroke.rate_hz) as usize;
        left -= stroke.scored.len() as f64 / stroke.rate_hz;
        if ticks < stroke.scored.len() {
            stroke.scored.end = stroke.scored.start + ticks;
            stroke.samples.truncate(stroke.scored.end);
        }
        flown += seconds(&stroke);
        learned.fly(learned.closed_loop, &stroke, seed, &mut learning)?;
    }
    Ok((learning, flown))
}

/// Each stroke by itself, with what so many seconds of other strokes taught; it goes on learning.
///
/// # Errors
/// If a stroke cannot be flown.
pub fn after(
    learned: &LearningLoop<'_>,
    motion_s: u32,
    teach: &[Trajectory],
    strokes: &[Trajectory],
) -> Result<Flown, RolloutError> {
    let (learning, flown) = taught(learned, motion_s, teach)?;
    let (errors, forgotten) = each(learned, learned.closed_loop, &learning, strokes)?;
    let baseline = learned.closed_loop.errors(strokes, None, 1.0, learned.seed)?;
    let seconds = flown + strokes.iter().map(seconds).sum::<f64>();
    Ok(Flown { baseline, errors, first: None, seconds, forgotten })
}

/// Each stroke by itself with what was learned.
fn each(
    learned: &LearningLoop<'_>,
    closed_loop: &Loop,
    learning: &FlightLearning,
    strokes: &[Trajectory],
) -> Result<(Vec<f64>, u32), RolloutError> {
    let fly = |(index, stroke): (usize, &Trajectory)| {
        let mut own = learning.clone();
        let error = learned.fly(closed_loop, stroke, learned.seed.wrapping_add(index as u64), &mut own)?;
        Ok((error, u32::from(own.progress().forgotten - learning.progress().forgotten)))
    };
    #[cfg(feature = "threads")]
    let strokes = strokes.par_iter();
    #[cfg(not(feature = "threads"))]
    let strokes = strokes.iter();
    let flown: Vec<(f64, u32)> = strokes.enumerate().map(fly).collect::<Result<_, RolloutError>>()?;
    Ok((flown.iter().map(|(error, _)| *error).collect(), flown.iter().map(|(_, forgotten)| forgotten).sum()))
}

/// Root mean square error over flights, second by second in motion: points (s, m) without learning and with it, from nothing.
/// Each flight flies strokes of its own one after another; rests between them are left out.
///
/// # Errors
/// If a stroke cannot be flown.
pub fn second_by_second(
    closed_loop: &Loop,
    flights: &[Vec<Trajectory>],
    seconds: usize,
    seed: u64,
) -> Result<[Vec<(f64, f64)>; 2], RolloutError> {
    let fly = |strokes: &Vec<Trajectory>| {
        let mut learning = closed_loop.learning(&Guessed::RIGHT)?;
        commission(closed_loop, &mut learning, seed)?;
        let mut squares = [Vec::new(), Vec::new()];
        for (stroke, seed) in strokes.iter().zip(seed..) {
            let plan = FlightPlan { log: true, ..FlightPlan::new(stroke, seed) };
            let without = closed_loop.fly(std::slice::from_ref(&plan))?.pop().unwrap_or_default();
            let with = closed_loop.fly_learning(&plan, &mut learning)?;
            for (squares, record) in squares.iter_mut().zip([without, with]) {
                squares.extend(of_each_second(stroke, &record.log.unwrap_or_default()));
            }
        }
        Ok(squares)
    };
    #[cfg(feature = "threads")]
    let flights = flights.par_iter();
    #[cfg(not(feature = "threads"))]
    let flights = flights.iter();
    let flown: Vec<[Vec<f64>; 2]> = flights.map(fly).collect::<Result<_, RolloutError>>()?;
    let point = |index: usize, second: usize| {
        let squares: Vec<f64> = flown.iter().filter_map(|squares| squares[index].get(second).copied()).collect();
        (second as f64 + 0.5, (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
    };
    Ok([0, 1].map(|index| (0..seconds).map(|second| point(index, second)).collect()))
}

/// Mean square of the error in each whole second of the drawn part, m².
fn of_each_second(stroke: &Trajectory, log: &FlightLog) -> Vec<f64> {
    let square = |row: &LogRow| {
        let position = row.true_position.unwrap_or(row.measured_position);
        (0..3).map(|axis| (position[axis] - row.desired.position[axis]).powi(2)).sum::<f64>()
    };
    let rows = log.rows.get(stroke.scored.clone()).unwrap_or_default();
    let second = (stroke.rate_hz.round() as usize).max(1);
    rows.chunks_exact(second).map(|rows| rows.iter().map(square).sum::<f64>() / second as f64).collect()
}
