//! Flights of a loop, replayed through the learner as if it had flown: what it would have left of each next one.
//!
//! *in* logs of flights without a correction, in the order in which they were flown; *out* for each the error as recorded and as
//! predicted; *never* anything that was learned from a flight in what is predicted for it with what came before, but for the
//! response where that is found from the first two; *source* ours.
//!
//! It is a prediction, nothing was flown: the error that is left is the recorded one and what the guessed response makes of the
//! correction, `e + G c`. The learner measures that, and so learns and acts as it would in a linear loop with this response; a
//! loop that answers otherwise, saturates, or is disturbed otherwise, is left with another error. [`Replay::otherwise`] says how
//! much is left if the loop is faster or slower than guessed while the learner holds to its guess.
//!
//! | ticks of a flight | counted and learned from |
//! |---|---|
//! | the first 80 | no: nobody knows what the loop was asked before |
//! | the last 80 | no: nobody knows where the trajectory would have gone on |

use impromptu_firmware::{
    learning::{AHEAD, Filter, Kept, Learner, Limits, Measured, Parts, Response, identity},
    model::{Channel, Channels},
    preview::EndRule,
};
use impromptu_training::track::Track;
use serde::Serialize;

use crate::second_order::{Known, SecondOrder, resampled};

/// Ticks at each end that are not counted.
const UNKNOWN: usize = AHEAD as usize;
/// Share of the bound that the feedback part has.
const FEEDBACK: f64 = 0.6;
/// What corrections are at their largest in a calm flight, as a share of the bound, and their change in a second.
const SCALE: f32 = 0.5;
/// See [`SCALE`].
const RATE: f32 = 20.0;
/// Flights that the response is identified from.
const IDENTIFIED: usize = 2;
/// What the real loop's frequency may be of the guessed one's, and its delay of the guessed one by the inverse.
const OTHERWISE: [f64; 2] = [0.8, 1.25];

/// A flight: the axes of a log, all of the same rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Name of the log.
    pub name: String,
    /// Axes, the same ones in the same order for every flight.
    pub tracks: Vec<Track>,
}

/// Why flights cannot be replayed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// Less than two flights, or one without an axis.
    #[error("what a flight teaches shows in the next one; give the logs of two sound flights at least")]
    Few,
    /// Axes that differ.
    #[error(
        "{flight}: its axes are {found}, those of the first log {first}; choose those that all logs have with --axis or --columns"
    )]
    Axes {
        /// The flight.
        flight: String,
        /// Its axes.
        found: String,
        /// Those of the first flight.
        first: String,
    },
    /// Nothing to identify a response from.
    #[error(
        "{flight}: the reference does not move, so that it does not show how the loop answers; give a log first that moves, or \
         --frequency, --damping and --delay-ms"
    )]
    Still {
        /// The flight.
        flight: String,
    },
    /// No response fits.
    #[error(
        "no response can be found from the first logs: each is too fast for their rate; log faster, or give another one with \
         --frequency, --damping and --delay-ms"
    )]
    Unidentified,
    /// A response for which there are no ticks.
    #[error(
        "a response of {frequency:.2} rad/s, damping {damping:.2} and delay {delay_ms:.0} ms cannot be followed in a log of \
         {log_hz:.1} rows a second: it is to settle in about 80 ticks, of which a row is four at most, and the delay 32; log \
         faster, or give another response with --frequency, --damping and --delay-ms"
    )]
    NoTicks {
        /// rad/s.
        frequency: f64,
        /// Damping ratio.
        damping: f64,
        /// ms.
        delay_ms: f64,
        /// Rows a second.
        log_hz: f64,
    },
    /// A flight that is too short.
    #[error(
        "{flight}: {seconds:.1} s are too short; this loop needs {needed:.1} s at least, of which the middle third is counted"
    )]
    Short {
        /// The flight.
        flight: String,
        /// Its length, s.
        seconds: f64,
        /// Length needed, s.
        needed: f64,
    },
}

/// A flight as it was and as it would have been; RMS over its counted ticks, all axes together, in the unit of the log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Predicted {
    /// The flight.
    pub name: String,
    /// Counted time, s.
    pub seconds: f64,
    /// Time of flight that was learned from before, min.
    pub learned_before_min: f64,
    /// Error as recorded.
    pub recorded: f64,
    /// Predicted error with what came before, nothing learned in the flight.
    pub predicted: f64,
    /// By how much less that is, %.
    pub reduction_percent: f64,
    /// Predicted error of a learner that goes on learning in the flight.
    pub learning_on: f64,
}

/// All flights, one after another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replay {
    /// The response that the learner was given.
    pub response: SecondOrder,
    /// Flights that it was identified from; none if it was given.
    pub identified_from: Vec<String>,
    /// By how much it misses what was measured in them, RMS in the unit of the log; `None` if it was given.
    pub misfit: Option<f64>,
    /// Learner's ticks a second.
    pub rate_hz: f64,
    /// Rows of the first log a second.
    pub log_hz: f64,
    /// Whether the rate of change comes from the logs; else it is the difference of the measured value, low-passed over a tick.
    pub measured_rate: bool,
    /// Flights.
    pub flights: Vec<Predicted>,
    /// Mean predicted error of the flights from the second on, in a loop a fifth slower and a quarter faster than guessed.
    pub otherwise: [f64; 2],
    /// Time of flight that was learned from, min.
    pub learned_min: f64,
    /// What was learned of all flights, as a learner keeps it ([`Kept`]): of signals that have the names of the axes.
    #[serde(skip)]
    pub learned: Vec<u8>,
}

/// An axis at the learner's rate.
struct Signals {
    reference: Vec<f64>,
    measured: Vec<f64>,
    rate: Vec<f64>,
}

impl Signals {
    fn of(track: &Track, rate_hz: f64) -> Self {
        let at = |values: &[f64]| resampled(values, track.period_s, rate_hz);
        let measured = at(&track.measured);
        let rate = track.rate.as_ref().map_or_else(|| differences(&measured, rate_hz), |rate| at(rate));
        Self { reference: at(&track.reference), measured, rate }
    }

    /// The desired trajectory at a tick; before the log the loop rested where it was measured first.
    fn desired(&self, tick: i64) -> f32 {
        let value = match usize::try_from(tick) {
            Ok(tick) => self.reference.get(tick).or(self.reference.last()),
            Err(_) => self.measured.first(),
        };
        value.copied().unwrap_or(0.0) as f32
    }
}

/// The rate of change as a loop has it that measures positions alone: the difference from the tick before, of which each tick
/// takes a half.
fn differences(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut rate = 0.0;
    let before = values.first().into_iter().chain(values);
    let pairs = before.zip(values);
    pairs
        .map(|(before, value)| {
            rate += 0.5 * ((value - before) * rate_hz - rate);
            rate
        })
        .collect()
}

/// A replay's loop and learners.
#[derive(Clone)]
struct Loop {
    rate_hz: f64,
    /// What the loop makes of a correction.
    answer: Response,
    /// A learner for each axis.
    learners: Vec<Learner>,
}

impl Loop {
    /// A flight: counted ticks, sums of the squares of the error as recorded and as predicted.
    fn fly(&mut self, axes: &[Signals], learn: Parts) -> (usize, f64, f64) {
        let (mut counted, mut recorded, mut predicted) = (0, 0.0, 0.0);
        for (signals, learner) in axes.iter().zip(&mut self.learners) {
            let ticks = signals.reference.len().saturating_sub(UNKNOWN);
            let delay = 1 + self.answer.delay();
            let (mut filter, mut corrections) = (Filter::default(), Vec::with_capacity(ticks));
            learner.start(signals.desired(-1));
            counted = 0;
            let rows = signals.reference.iter().zip(signals.measured.iter().zip(&signals.rate));
            for (tick, (reference, (measured, rate))) in rows.enumerate().take(ticks) {
                let input = tick.checked_sub(delay).and_then(|at| corrections.get(at)).copied().unwrap_or(0.0);
                let answer = f64::from(filter.step(&self.answer, input));
                let answer_rate = f64::from(filter.change()) * self.rate_hz;
                let desired = |offset: i32| signals.desired(tick as i64 + i64::from(offset));
                let learn = if tick < UNKNOWN { Parts::NONE } else { learn };
                let measured_then = Measured { value: (measured + answer) as f32, rate: Some((rate + answer_rate) as f32) };
                corrections.push(learner.step(desired, Some(measured_then), learn, Parts::BOTH));
                if tick >= UNKNOWN {
                    counted += 1;
                    recorded += (measured - reference).powi(2);
                    predicted += (measured + answer - reference).powi(2);
                }
            }
        }
        (counted, recorded, predicted)
    }

    /// Every flight after the ones before it.
    fn fly_all(&mut self, flights: &[(&str, Vec<Signals>)]) -> Vec<Predicted> {
        let mut learned_s = 0.0;
        flights
            .iter()
            .map(|(name, axes)| {
                let (count, recorded, predicted) = self.clone().fly(axes, Parts::NONE);
                let (_, _, learning) = self.fly(axes, Parts::BOTH);
                let [recorded, predicted, learning_on] =
                    [recorded, predicted, learning].map(|sum| (sum / count.max(1) as f64).sqrt());
                let (seconds, learned_before_min) = (count as f64 / self.rate_hz, learned_s / 60.0);
                learned_s += seconds;
                Predicted {
                    name: (*name).to_owned(),
                    seconds,
                    learned_before_min,
                    recorded,
                    predicted,
                    reduction_percent: 100.0 * (1.0 - predicted / recorded),
                    learning_on,
                }
            })
            .collect()
    }
}

impl Loop {
    /// What the learners keep.
    fn kept(&self, tracks: &[Track]) -> Vec<u8> {
        let channels: Vec<Channel<'_>> =
            tracks.iter().map(|track| Channel { name: &track.name, unit: "", frame: "", end: EndRule::Hold }).collect();
        let signals = Channels { desired: &channels, measured: &channels, reference: &channels };
        let rate_hz = self.rate_hz as f32;
        let count = self.learners.len();
        let mut bytes = vec![0; Kept::length(count)];
        let axes = self.learners.iter().map(Learner::kept);
        Kept::write(&mut bytes, identity(signals, rate_hz, None), rate_hz, count, axes).map(<[u8]>::to_vec).unwrap_or_default()
    }
}

impl Replay {
    /// Replays flights in their order; what of the response is not known is identified from the first two.
    ///
    /// # Errors
    /// If the axes of the flights differ, a flight is too short, or there is no response for their rate.
    pub fn of(flights: &[Flight], known: &Known) -> Result<Self, ReplayError> {
        let first = flights.first().filter(|first| flights.len() > 1 && !first.tracks.is_empty()).ok_or(ReplayError::Few)?;
        check_axes(flights, first)?;
        let log_hz = first.tracks.first().map_or(f64::NAN, |track| 1.0 / track.period_s);
        let (response, misfit, identified_from) = match known.whole() {
            Some(response) => (response, None, Vec::new()),
            None => {
                let shown = flights.get(..IDENTIFIED).unwrap_or(flights);
                if let Some(still) = shown.iter().find(|flight| !flight.tracks.iter().any(|track| extent(&track.reference) > 0.0))
                {
                    return Err(ReplayError::Still { flight: still.name.clone() });
                }
                let tracks: Vec<&Track> = shown.iter().flat_map(|flight| &flight.tracks).collect();
                let (response, misfit) = known.identify(&tracks).ok_or(ReplayError::Unidentified)?;
                (response, Some(misfit), shown.iter().map(|flight| flight.name.clone()).collect())
            }
        };
        let SecondOrder { frequency, damping, delay_s, .. } = response;
        let no_ticks = ReplayError::NoTicks { frequency, damping, delay_ms: 1e3 * delay_s, log_hz };
        let rate_hz = response.rate_hz(log_hz).ok_or_else(|| no_ticks.clone())?;
        let answer = response.response(rate_hz).ok_or(no_ticks)?;
        let needed = 3.0 * UNKNOWN as f64 / rate_hz;
        for flight in flights {
            let seconds =
                flight.tracks.iter().map(|track| track.reference.len() as f64 * track.period_s).fold(f64::MAX, f64::min);
            if seconds < needed {
                return Err(ReplayError::Short { flight: flight.name.clone(), seconds, needed });
            }
        }
        // Bounded by what the trajectories reach over: a correction is no journey of its own.
        let extents = flights.iter().flat_map(|flight| &flight.tracks).map(|track| extent(&track.reference));
        let bound = extents.fold(0.0, f64::max);
        let still = || ReplayError::Still { flight: first.name.clone() };
        let learner = Learner::new(answer, rate_hz as f32, 0.0, limits(bound)).ok_or_else(still)?;
        let learners = vec![learner; first.tracks.len()];
        let mut closed_loop = Loop { rate_hz, answer, learners };
        let signals: Vec<(&str, Vec<Signals>)> = flights
            .iter()
            .map(|flight| (flight.name.as_str(), flight.tracks.iter().map(|track| Signals::of(track, rate_hz)).collect()))
            .collect();
        let otherwise = OTHERWISE.map(|factor| {
            let other = SecondOrder { frequency: factor * response.frequency, delay_s: response.delay_s / factor, ..response };
            let answer = other.response(rate_hz).unwrap_or(answer);
            let predicted = Loop { answer, ..closed_loop.clone() }.fly_all(&signals);
            mean(predicted.iter().skip(1).map(|flight| flight.predicted))
        });
        let measured_rate = flights.iter().flat_map(|flight| &flight.tracks).all(|track| track.rate.is_some());
        let flights = closed_loop.fly_all(&signals);
        let learned = closed_loop.kept(&first.tracks);
        let learned_min = flights.iter().map(|flight| flight.seconds).sum::<f64>() / 60.0;
        Ok(Self { response, identified_from, misfit, rate_hz, log_hz, measured_rate, flights, otherwise, learned_min, learned })
    }
}

/// Bounds of corrections of trajectories that reach over so much.
fn limits(extent: f64) -> Limits {
    let correction = extent as f32;
    Limits { scale: SCALE * correction, correction, feedback: FEEDBACK as f32 * correction, rate: RATE * correction }
}

fn check_axes(flights: &[Flight], first: &Flight) -> Result<(), ReplayError> {
    let names = |flight: &Flight| flight.tracks.iter().map(|track| track.name.as_str()).collect::<Vec<_>>().join(", ");
    match flights.iter().find(|flight| names(flight) != names(first)) {
        Some(other) => Err(ReplayError::Axes { flight: other.name.clone(), found: names(other), first: names(first) }),
        None => Ok(()),
    }
}

fn extent(values: &[f64]) -> f64 {
    let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(least, most), value| (least.min(*value), most.max(*value)));
    (most - least).max(0.0)
}

/// The mean of what there is; not a number if there is nothing.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    sum / count as f64
}

#[cfg(test)]
mod tests;
