//! Training flights are rehearsed: flown small first, then larger, as long as the loop follows as before.
//!
//! *in* a simulated loop and flights that are asked for; *out* the same flights, as large as the loop was seen to survive;
//! *never* a flight that was not flown smaller before, but for those behind the first two dozen of a set; *source* a loop that is
//! linear leaves an error in proportion to what it is asked for, one whose motors saturate leaves more.

use impromptu_sim::{
    flight_log::FlightLog,
    flights::{FlightsError, Loop},
    rollout::Dither,
};

use crate::recipe::{FlightSet, Signal};

/// Flights of a set that are rehearsed, at most: the first ones.
const REHEARSED: u32 = 24;
/// By how much more is flown from step to step.
const STEP: f64 = 1.07;
/// Steps below what is asked for at which is begun, half of it; a loop that does not follow there begins so many steps lower,
/// down to a fifteenth: less is not worth a flight.
const STEPS: i32 = 10;
/// A flight's RMS and largest error may be so many times what a linear loop would make of those of the step before.
const GROWTH: [f64; 2] = [1.08, 1.15];
/// With more than this many times its error the vehicle is lost.
const LOST: f64 = 3.0;
/// RMS and largest error that may be added to that, of the extent of what is desired: noise is not what grows.
const NOISE: [f64; 2] = [0.005, 0.01];

/// A set of flights as it may be flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rehearsed {
    /// As large as the loop was seen to survive, with a step to spare.
    pub flights: FlightSet,
    /// Share of the speed that was asked for.
    pub share: f64,
    /// Largest error that was seen up to a step beyond it, m.
    pub largest_error: f64,
    /// Rehearsals in which the vehicle was lost.
    pub lost: usize,
}

/// Why there is nothing to fly.
#[derive(Debug, thiserror::Error)]
pub enum RehearsalError {
    /// It could not be flown.
    #[error(transparent)]
    Flights(#[from] FlightsError),
    /// The loop is lost however little it is asked for.
    #[error(
        "the loop does not follow: even at {share:.2} times the speed asked for its error grows faster than what it is asked; \
         see what `fly` shows of it, or give it other gains"
    )]
    NeverFollows {
        /// Share of the speed asked for.
        share: f64,
    },
}

/// Share of what is asked for at so many steps below it.
fn share_of(step: i32) -> f64 {
    STEP.powi(-step)
}

impl FlightSet {
    /// The same flights at a share of their speed: strokes take longer, tones and splines are smaller.
    #[must_use]
    pub fn at(&self, share: f64) -> Self {
        let power = if self.signal == Signal::Strokes { 2 } else { 1 };
        Self { max_speed: self.max_speed * share, max_acceleration: self.max_acceleration * share.powi(power), ..*self }
    }

    /// What a linear loop makes of a flight's error, at most, if it is asked for this many times as much.
    fn growth(&self, ratio: f64) -> f64 {
        if self.signal == Signal::Strokes { ratio * ratio } else { ratio }
    }
}

/// Largest extent of what is desired along an axis, m.
fn extent(log: &FlightLog) -> f64 {
    let along = |axis: usize| {
        let values = || log.rows.iter().map(move |row| row.desired.position[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    (0..3).map(along).fold(0.0, f64::max)
}

/// RMS and largest distance of what was measured from what was desired, m; infinite if a number was lost.
fn errors(log: &FlightLog) -> [f64; 2] {
    let (mut sum, mut largest) = (0.0, 0.0f64);
    for row in &log.rows {
        let axes = row.measured_position.iter().zip(&row.desired.position);
        let square = axes.map(|(measured, desired)| (measured - desired).powi(2)).sum::<f64>();
        if !square.is_finite() {
            return [f64::INFINITY; 2];
        }
        (sum, largest) = (sum + square, largest.max(square));
    }
    [(sum / log.rows.len().max(1) as f64).sqrt(), largest.sqrt()]
}

/// What was seen of a flight.
struct Seen {
    errors: [f64; 2],
    extent: f64,
}

impl Seen {
    fn of(log: &FlightLog) -> Self {
        Self { errors: errors(log), extent: extent(log) }
    }

    fn is_lost(&self, largest_error: f64) -> bool {
        let largest = self.errors[1];
        largest.is_nan() || largest > LOST * largest_error + NOISE[1] * self.extent
    }
}

/// Whether a vehicle was lost that a rehearsal saw `largest_error` of.
pub fn lost(log: &FlightLog, largest_error: f64) -> bool {
    Seen::of(log).is_lost(largest_error)
}

/// What a loop survives of a set of flights whose motions begin at `seed`.
///
/// # Errors
/// If it survives none, or nothing can be flown.
pub fn rehearse(closed_loop: &Loop, set: &FlightSet, dither: Option<Dither>, seed: u64) -> Result<Rehearsed, RehearsalError> {
    let scouts = FlightSet { flights: set.flights.min(REHEARSED), ..*set };
    let fly = |share: f64| -> Result<Vec<Seen>, FlightsError> {
        let logs = closed_loop.collect(&scouts.at(share).motions(seed), dither, seed)?;
        Ok(logs.iter().map(Seen::of).collect())
    };
    let mut gone = 0;
    for first in [STEPS, 2 * STEPS, 3 * STEPS, 4 * STEPS] {
        let mut before = fly(share_of(first + 1))?;
        // The largest error of each step that was followed. What is asked for is step 0; one more is flown to spare.
        let mut followed = vec![];
        for step in (-1..=first).rev() {
            let flown = fly(share_of(step))?;
            let growth = set.growth(STEP);
            let follows = |now: &Seen, before: &Seen| {
                now.errors[0].is_finite()
                    && (0..2).all(|place| {
                        now.errors[place] <= GROWTH[place] * growth * before.errors[place] + NOISE[place] * now.extent
                    })
            };
            if !flown.iter().zip(&before).all(|(now, before)| follows(now, before)) {
                gone += flown.iter().zip(&before).filter(|(now, before)| now.is_lost(before.errors[1])).count();
                break;
            }
            before = flown;
            followed.push((step, before.iter().fold(0.0f64, |most, seen| most.max(seen.errors[1]))));
        }
        if let [.., (step, _), (_, largest_error)] = followed[..] {
            let share = share_of(step);
            return Ok(Rehearsed { flights: set.at(share), share, largest_error, lost: gone });
        }
    }
    Err(RehearsalError::NeverFollows { share: share_of(4 * STEPS) })
}

#[cfg(test)]
mod tests {
    use impromptu_sim::{condition::Condition, controller::Controller, plant::Vehicle};

    use super::*;
    use crate::{Purpose, Recipe, derived};

    fn lab(controller: Controller) -> Loop {
        let vehicle = Vehicle::named("crazyflie").unwrap();
        let closed_loop = Loop::new(vehicle, "stock", Condition::named("lab").unwrap()).unwrap();
        closed_loop.flown_by(controller).unwrap()
    }

    /// How many of `flights` flights of each set are lost, and the smallest share that is flown.
    fn flown(controller: Controller, sets: &[FlightSet], dither: Option<Dither>, seed: u64) -> (usize, f64) {
        let (closed_loop, mut first) = (lab(controller), derived(seed, Purpose::Training));
        let (mut gone, mut least) = (0, 1.0f64);
        for set in sets {
            let Rehearsed { flights, share, largest_error, .. } = rehearse(&closed_loop, set, dither, first).unwrap();
            let logs = closed_loop.collect(&flights.motions(first), dither, first).unwrap();
            // A vehicle that tumbled is metres away from where it should be.
            gone += logs.iter().filter(|log| lost(log, largest_error) || errors(log)[1] > 3.0).count();
            first = first.wrapping_add(u64::from(set.flights));
            least = least.min(share);
        }
        println!("{} seed {seed}: {gone} lost, smallest share {least:.2}", controller.name());
        (gone, least)
    }

    fn fast(flights: u32) -> FlightSet {
        let long = Recipe::long();
        FlightSet { flights, ..*long.training_flights.last().unwrap() }
    }

    /// At twice the speed of the test strokes half of Mellinger's flights are lost with and without feed-forward.
    #[test]
    fn no_flight_is_lost_of_a_loop_that_cannot_fly_what_is_asked() {
        for controller in [Controller::Mellinger { feed_forward: false }, Controller::Mellinger { feed_forward: true }] {
            let (gone, share) = flown(controller, &[fast(8)], None, 1);
            assert!(gone == 0 && (0.4..0.8).contains(&share), "{}: {gone} lost at {share}", controller.name());
        }
    }

    /// What a loop survives is flown as it is asked for.
    #[test]
    fn what_is_survived_is_flown_as_asked() {
        for controller in [Controller::Se3, Controller::Pid] {
            let (gone, share) = flown(controller, &[fast(6).at(0.5)], None, 1);
            assert_eq!((gone, share), (0, 1.0), "{}", controller.name());
        }
    }

    #[test]
    #[ignore = "long"]
    fn long_none_of_eighty_flights_is_lost_whatever_the_loop() {
        let recipe = Recipe::long();
        let sets: Vec<FlightSet> = recipe.training_flights.iter().map(|set| FlightSet { flights: 20, ..*set }).collect();
        let dithered = FlightSet { flights: 20, seconds: 30.0, ..recipe.lane.dithered_flights };
        let dither = Dither { amplitude: recipe.lane.dither, hold_s: recipe.lane.dither_hold_s };
        for controller in Controller::ALL {
            for seed in 1..=3 {
                assert_eq!(flown(controller, &sets, None, seed).0, 0, "{} seed {seed}", controller.name());
            }
            let four = [dithered, dithered.at(1.5), dithered.at(2.0), dithered.at(3.0)];
            assert_eq!(flown(controller, &four, Some(dither), 4).0, 0, "{} with dither", controller.name());
        }
    }
}
