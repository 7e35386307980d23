//! When the guard trips, and how much harm is done until then: flights of every kind beside their baseline twins.
//!
//! *in* a loop, a model, a seed; *out* trips, and where the add-on does harm the time and the harm until hand-over; *never* a
//! twin that flew another vehicle, air, noise or fault than the add-on; *source* the Simplex architecture (Sha 2001): what counts
//! is how far the loop has gone when the simple one takes over.

use impromptu_firmware::{guard::Trips, model::Model};
use impromptu_sim::{
    flights::{FlightsError, Loop},
    rollout::RolloutError,
    trajectory::{Trajectory, hover, stroke},
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::{
    faults::{Change, Fault, Flown},
    mismatch::Mismatch,
};

/// Errors are root mean squares over so long, s.
pub const WINDOW_S: f64 = 0.5;
/// Harm is an error of more than this many times the twin's, and so much more, m.
pub const HARM_FACTOR: f64 = 1.5;
/// See [`HARM_FACTOR`].
pub const HARM_MORE: f64 = 0.01;
/// A feedback lane of less weight is handed over.
const HANDED_OVER: f32 = 0.01;
/// Where the twin is farther off than this, m, it is lost, and nothing is asked of the add-on.
pub const LOST: f64 = 2.0;
/// Each so many flights one is a hover, of so many seconds; the others are strokes.
const HOVER_EACH: u64 = 4;
const HOVER_S: f64 = 16.0;

/// Uniform numbers from a range.
type Between<'a> = &'a mut dyn FnMut(f64, f64) -> f64;

/// A kind of change.
#[derive(Clone, Copy)]
pub struct Kind {
    /// Name in the JSON document.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// One flight's change.
    draw: fn(Between<'_>) -> Change,
}

/// What moves vehicle or air only.
const fn other(mismatch: Mismatch) -> Change {
    Change { mismatch, ..Change::NONE }
}

/// The kinds; the first is healthy.
pub const KINDS: [Kind; 13] = [
    Kind { name: "nominal", what: "nominal (healthy)", draw: |_| Change::NONE },
    Kind {
        name: "delay_20_to_40_ms",
        what: "delay of the whole loop +20 to +40 ms",
        draw: |between| other(Mismatch { delay_s: between(0.02, 0.04), ..Mismatch::NONE }),
    },
    Kind {
        name: "delay_40_to_60_ms",
        what: "delay of the whole loop +40 to +60 ms",
        draw: |between| other(Mismatch { delay_s: between(0.04, 0.06), ..Mismatch::NONE }),
    },
    Kind {
        name: "delay_60_to_80_ms",
        what: "delay of the whole loop +60 to +80 ms",
        draw: |between| other(Mismatch { delay_s: between(0.06, 0.08), ..Mismatch::NONE }),
    },
    Kind {
        name: "thrust",
        what: "thrust -25 to +25 %",
        draw: |between| other(Mismatch { thrust: between(0.75, 1.25), ..Mismatch::NONE }),
    },
    Kind { name: "drag", what: "drag x3 to x6", draw: |between| other(Mismatch { drag: between(3.0, 6.0), ..Mismatch::NONE }) },
    Kind {
        name: "gains_halved",
        what: "position gains x0.5 to x0.7",
        draw: |between| Change { gains: between(0.5, 0.7), ..Change::NONE },
    },
    Kind {
        name: "gains_doubled",
        what: "position gains x1.4 to x2",
        draw: |between| Change { gains: between(1.4, 2.0), ..Change::NONE },
    },
    Kind {
        name: "wind",
        what: "wind of 2 to 8 m/s with gusts",
        draw: |between| {
            let wind_direction = between(0.0, std::f64::consts::TAU);
            other(Mismatch { wind: between(2.0, 8.0), wind_direction, ..Mismatch::NONE })
        },
    },
    Kind { name: "noise", what: "noise x2 to x5", draw: |between| Change { noise: between(2.0, 5.0), ..Change::NONE } },
    Kind {
        name: "frozen",
        what: "position frozen for 0.3 to 1.5 s",
        draw: |between| Change { fault: Fault::Frozen { at: between(3.0, 8.0), seconds: between(0.3, 1.5) }, ..Change::NONE },
    },
    Kind {
        name: "jumps",
        what: "position jumps by 0.05 to 1 m",
        draw: |between| Change {
            fault: Fault::Jumps { size: between(0.05, 1.0), each: between(0.5, 3.0) },
            direction: between(0.0, std::f64::consts::TAU),
            ..Change::NONE
        },
    },
    Kind {
        name: "starved",
        what: "no setpoints for 0.1 to 0.8 s",
        draw: |between| Change { fault: Fault::Starved { at: between(3.0, 8.0), seconds: between(0.1, 0.8) }, ..Change::NONE },
    },
];

/// Harm by an add-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harm {
    /// When it begins, s.
    pub at: f64,
    /// How long it takes from there to hand-over, s; nothing if that never comes.
    pub until_handover: Option<f64>,
    /// How much larger than its twin's the error is until hand-over at most, m.
    pub largest: f64,
}

/// What came of a flight and its twin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Trips.
    pub trips: Trips,
    /// The twin is lost; then nothing is said of harm.
    pub lost: bool,
    /// Harm, if there is any.
    pub harm: Option<Harm>,
}

/// Desired in the flight of that number: a stroke that nobody trained on, or a hover.
fn desired(seed: u64, flight: u64, rate_hz: f64) -> Result<Trajectory, FlightsError> {
    let motion = match (flight + 1).is_multiple_of(HOVER_EACH) {
        true => hover(HOVER_S),
        false => stroke(seed, flight),
    };
    Ok(motion.sampled(rate_hz)?)
}

/// Flies so many flights of each of [`KINDS`], with both lanes and without the add-on. Flights of the same number desire the same
/// and have the same noise and disturbance, whatever the kind.
///
/// # Errors
/// If the model does not fit the flight stack.
pub fn fly_kinds(closed_loop: &Loop, model: &Model<'_>, flights: u32, seed: u64) -> Result<Vec<Vec<Outcome>>, FlightsError> {
    let rate_hz = closed_loop.rate_hz();
    let trajectories: Vec<Trajectory> =
        (0..u64::from(flights)).map(|flight| desired(seed, flight, rate_hz)).collect::<Result<_, _>>()?;
    let fly = |(kind, flight): (usize, usize)| {
        let stream = ((kind as u64) << 32) | flight as u64;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ stream);
        let change = (KINDS[kind].draw)(&mut |low, high| random.random_range(low..high));
        outcome(&change, closed_loop, model, &trajectories[flight], seed.wrapping_add(flight as u64))
    };
    let all: Vec<(usize, usize)> =
        (0..KINDS.len()).flat_map(|kind| (0..trajectories.len()).map(move |flight| (kind, flight))).collect();
    let flown: Vec<Outcome> = all.into_par_iter().map(fly).collect::<Result<_, _>>()?;
    Ok(flown.chunks(trajectories.len().max(1)).map(<[Outcome]>::to_vec).collect())
}

fn outcome(
    change: &Change,
    closed_loop: &Loop,
    model: &Model<'_>,
    trajectory: &Trajectory,
    seed: u64,
) -> Result<Outcome, RolloutError> {
    let flown = change.applied(closed_loop);
    let twin = change.fly(&flown, None, trajectory, seed)?.squared_errors();
    let assisted = change.fly(&flown, Some(model), trajectory, seed)?;
    // What is no number is lost too.
    let lost = !twin.iter().all(|square| *square <= LOST * LOST);
    let harm = if lost { None } else { harm(&twin, &assisted, closed_loop.rate_hz()) };
    Ok(Outcome { trips: assisted.record.trips, lost, harm })
}

/// The first harm of a flight, beside the squared errors of its twin, m².
fn harm(twin: &[f64], assisted: &Flown, rate_hz: f64) -> Option<Harm> {
    let ticks = (WINDOW_S * rate_hz) as usize;
    let [twin, errors] = [twin, &assisted.squared_errors()].map(|squares| windows(squares, ticks));
    let harmful = |(error, twin): (&f64, &f64)| *error > HARM_FACTOR * twin + HARM_MORE || error.is_nan();
    let first = errors.iter().zip(&twin).position(harmful)?;
    // The last tick of that window.
    let begin = first + ticks - 1;
    let tripped = |tick: usize| {
        let trips = |tick: usize| assisted.lanes[tick].trips;
        tick > 0 && trips(tick) != trips(tick - 1)
    };
    let handed_over = |tick: usize| {
        let lanes = &assisted.lanes[tick];
        !lanes.allowed.feedback || lanes.weights[1] < HANDED_OVER || tripped(tick)
    };
    let handover = (begin..assisted.lanes.len()).find(|tick| handed_over(*tick));
    let last = handover.map_or(errors.len(), |tick| (tick + 2).saturating_sub(ticks)).max(first + 1).min(errors.len());
    let largest = (first..last).map(|window| errors[window] - twin[window]).fold(0.0, f64::max);
    Some(Harm { at: begin as f64 / rate_hz, until_handover: handover.map(|tick| (tick - begin) as f64 / rate_hz), largest })
}

/// Root mean square over each `ticks` ticks.
pub fn windows(squares: &[f64], ticks: usize) -> Vec<f64> {
    squares.windows(ticks.min(squares.len())).map(|window| (window.iter().sum::<f64>() / window.len() as f64).sqrt()).collect()
}
