//! The trajectory that tells most of what logs lack.
//!
//! *in* [`Knowledge`]; *out* tones on each axis, sampled; *never* a position, speed or acceleration that no sound log reached;
//! *source* of draws of phases the one that lets most power through the limits.

use std::f64::consts::TAU;

use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::next::{AxisKnowledge, Knowledge};

/// Length, s, and how long it rises from rest and falls back.
const SECONDS: f64 = 60.0;
/// See [`SECONDS`].
const FADE_S: f64 = 3.0;
/// Tones in a band.
const TONES: usize = 3;
/// Draws of phases.
const DRAWS: u64 = 24;
/// Share of the greatest need that every band gets: what is known may change.
const LEAST: f64 = 1e-3;
/// Error of a band in which nothing is known, of 1.
const UNKNOWN: f64 = 1.0;
/// Share of the limits that is used: peaks lie between samples.
const WITHIN: f64 = 0.98;

/// A trajectory to fly next.
#[derive(Clone, Debug, PartialEq)]
pub struct NextFlight {
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// Of each axis its positions.
    pub positions: Vec<Vec<f64>>,
}

/// Square of what an axis' error in each band costs.
fn needs(axis: &AxisKnowledge, beside: &Knowledge) -> Vec<f64> {
    let usual = |band: usize| {
        let others = beside.axes.iter().filter(|other| other.unit == axis.unit && other.excited);
        others.map(|other| other.bands[band].asked).fold(0.0, f64::max)
    };
    let of_band = |(band, of): (usize, &crate::next::Band)| match of.error_percent {
        Some(error) => (usual(band) * error / 100.0).powi(2),
        None => (usual(band) * UNKNOWN).powi(2),
    };
    axis.bands.iter().enumerate().map(of_band).collect()
}

/// The most informative flight inside of what was survived.
pub fn next_flight(known: &Knowledge, rate_hz: f64, seed: u64) -> NextFlight {
    let needs: Vec<Vec<f64>> = known.axes.iter().map(|axis| needs(axis, known)).collect();
    let most = needs.iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut best: Option<(f64, NextFlight)> = None;
    for draw in 0..DRAWS {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_add(draw));
        let mut told = 0.0;
        let positions = known
            .axes
            .iter()
            .zip(&needs)
            .map(|(axis, needs)| {
                let shape = shape(axis, needs, most, rate_hz, &mut random);
                let [middle, extent, speed, acceleration] = axis.survived;
                let [far, fast, hard] = peaks(&shape, rate_hz);
                let scale = WITHIN * (extent / far).min(speed / fast).min(acceleration / hard);
                // An axis of which less is to be learned moves less.
                let share = (needs.iter().copied().fold(0.0, f64::max) / most).powf(0.25).clamp(0.3, 1.0);
                told += scale * scale * share * needs.iter().sum::<f64>() / most;
                shape.iter().map(|value| middle + share * scale * value).collect()
            })
            .collect();
        if best.as_ref().is_none_or(|(most, _)| told > *most) {
            best = Some((told, NextFlight { rate_hz, positions }));
        }
    }
    together(best.map_or(NextFlight { rate_hz, positions: Vec::new() }, |(_, flight)| flight), known)
}

/// Axes that move at once ask for no more together than the one that was asked most of: a flight at the limits of each would be
/// beyond those of the machine.
fn together(mut flight: NextFlight, known: &Knowledge) -> NextFlight {
    for unit in known.axes.iter().map(|axis| axis.unit.clone()).collect::<std::collections::BTreeSet<_>>() {
        let places: Vec<usize> = (0..known.axes.len()).filter(|place| known.axes[*place].unit == unit).collect();
        let of = |order: usize| -> f64 {
            let each: Vec<Vec<f64>> =
                places.iter().map(|place| derivative(&flight.positions[*place], flight.rate_hz, order)).collect();
            let ticks = each.first().map_or(0, Vec::len);
            (0..ticks).map(|tick| each.iter().map(|values| values[tick].powi(2)).sum::<f64>()).fold(0.0, f64::max).sqrt()
        };
        let limit = |index: usize| places.iter().map(|place| known.axes[*place].survived[index]).fold(0.0, f64::max);
        let scale = [(1, 2), (2, 3)].map(|(order, index)| limit(index) / of(order).max(f64::MIN_POSITIVE));
        let scale = scale[0].min(scale[1]).min(1.0);
        for place in places {
            let middle = known.axes[place].survived[0];
            flight.positions[place].iter_mut().for_each(|value| *value = middle + scale * (*value - middle));
        }
    }
    flight
}

fn shape(axis: &AxisKnowledge, needs: &[f64], most: f64, rate_hz: f64, random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut tones = Vec::new();
    for (band, need) in axis.bands.iter().zip(needs) {
        let amplitude = (need / most).max(LEAST).powf(0.25);
        for tone in 0..TONES {
            let place = (tone as f64 + random.random_range(0.0..1.0)) / TONES as f64;
            let hz = band.hz[0] * (band.hz[1] / band.hz[0]).powf(place);
            tones.push((amplitude, TAU * hz, random.random_range(0.0..TAU)));
        }
    }
    let ticks = (SECONDS * rate_hz) as usize;
    (0..=ticks)
        .map(|tick| {
            let seconds = tick as f64 / rate_hz;
            let sum: f64 = tones.iter().map(|(amplitude, rate, phase)| amplitude * (rate * seconds + phase).sin()).sum();
            sum * rise(seconds / FADE_S) * rise((SECONDS - seconds) / FADE_S)
        })
        .collect()
}

/// From 0 to 1, at rest at both ends.
fn rise(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 - x * (15.0 - 6.0 * x))
}

/// Samples of a derivative.
pub fn derivative(values: &[f64], rate_hz: f64, order: usize) -> Vec<f64> {
    let mut found = values.to_vec();
    for _ in 0..order {
        found = found.windows(2).map(|pair| (pair[1] - pair[0]) * rate_hz).collect();
    }
    found
}

/// Largest distance from 0, speed and acceleration.
fn peaks(values: &[f64], rate_hz: f64) -> [f64; 3] {
    [0, 1, 2].map(|order| derivative(values, rate_hz, order).iter().fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        built_in::quadrotor,
        description::LoopDescription,
        next::{NextError, knowledge},
        reading::{AxisLog, AxisSignals},
    };

    const RATE_HZ: f64 = 50.0;

    /// Of the quadrotor's axes two.
    fn described() -> LoopDescription {
        let (mut described, _) = quadrotor(false);
        described.axes.truncate(2);
        described
    }

    /// A loop of second order, 3 rad/s, over tones with dither; `share` of them reaches the axis.
    fn axis(share: f64, seed: u64, seconds: f64) -> AxisLog {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let tones: Vec<(f64, f64)> = (0..6).map(|index| (0.2 * 1.6f64.powi(index), random.random_range(0.0..TAU))).collect();
        let (mut signals, mut y, mut v, mut dither) = (AxisSignals::default(), 0.0, 0.0, 0.01);
        for tick in 0..(seconds * RATE_HZ) as usize {
            let t = tick as f64 / RATE_HZ;
            let sum = |of: &dyn Fn(f64, f64) -> f64| share * tones.iter().map(|(rate, phase)| of(*rate, *phase)).sum::<f64>();
            let desired = sum(&|rate, phase| 0.1 / rate * (rate * t + phase).sin());
            if tick % 3 == 0 {
                dither = if random.random_bool(0.5) { 0.01 } else { -0.01 };
            }
            let reference = desired + share.signum() * dither;
            signals.desired.push(desired);
            signals.base.push(desired);
            signals.desired_velocity.push(sum(&|rate, phase| 0.1 * (rate * t + phase).cos()));
            signals.reference.push(reference);
            signals.reference_velocity.push(0.0);
            signals.measured.push(y + random.random_range(-0.03..0.03));
            signals.velocity.push(v + random.random_range(-0.15..0.15));
            v += (9.0 * (reference - y) - 4.2 * v) / RATE_HZ;
            y += v / RATE_HZ;
        }
        AxisLog { file: format!("{seed}.csv"), rate_hz: RATE_HZ, signals, notes: Vec::new() }
    }

    fn logs(shares: [f64; 2], count: u64) -> Vec<Vec<AxisLog>> {
        (0..count).map(|index| vec![axis(shares[0], 2 * index, 60.0), axis(shares[1], 2 * index + 1, 60.0)]).collect()
    }

    /// No sample of an axis is further from the middle, faster or harder than what was survived.
    fn inside(flight: &NextFlight, known: &Knowledge) {
        for (values, axis) in flight.positions.iter().zip(&known.axes) {
            let [middle, survived @ ..] = axis.survived;
            let from_middle: Vec<f64> = values.iter().map(|value| value - middle).collect();
            let asked = peaks(&from_middle, flight.rate_hz);
            assert!(asked.iter().zip(survived).all(|(asked, most)| *asked <= most), "{}: {asked:?} {survived:?}", axis.axis);
            assert!(values.first() == Some(&middle) && (values[values.len() - 1] - middle).abs() < 1e-9);
        }
    }

    #[test]
    fn an_axis_that_was_not_excited_is_excited_within_half_of_what_the_other_survived() {
        let known = knowledge(&described(), &logs([1.0, 0.0], 3), true, 1).unwrap();
        assert!(known.axes[0].excited && !known.axes[1].excited && known.pays && known.gain_percent.is_none());
        let [x, y] = [0, 1].map(|place: usize| known.axes[place].survived);
        assert_eq!([y[1], y[2], y[3]], [0.5 * x[1], 0.5 * x[2], 0.5 * x[3]]);
        for seed in 0..4 {
            let flight = next_flight(&known, RATE_HZ, seed);
            inside(&flight, &known);
            // x is known: y is asked for what it may be asked for, and x for less.
            let [x, y] = [0, 1].map(|place: usize| {
                let asked = peaks(&flight.positions[place], RATE_HZ).into_iter().zip(&known.axes[place].survived[1..]);
                asked.map(|(asked, most)| asked / most).fold(0.0, f64::max)
            });
            assert!(y > 0.5 && y > x, "seed {seed}: {x} {y} of the limits");
        }
    }

    #[test]
    fn a_minute_pays_another_and_twelve_do_not() {
        let of = |minutes| knowledge(&described(), &logs([1.0, 0.8], minutes), true, 1).unwrap();
        let [one, twelve] = [of(1), of(12)];
        assert!((one.minutes - 1.0).abs() < 0.01 && (twelve.minutes - 12.0).abs() < 0.01);
        let [first, last] = [&one, &twelve].map(|known| known.gain_percent.unwrap());
        assert!(one.pays && !twelve.pays && last < 0.5 * first, "{first} {last} % of the error");
        inside(&next_flight(&twelve, RATE_HZ, 3), &twelve);
    }

    #[test]
    fn a_lost_flight_widens_no_limit_and_stillness_is_an_error() {
        let mut flown = logs([1.0, 1.0], 4);
        let before = knowledge(&described(), &flown, true, 1).unwrap();
        let mut lost = vec![axis(3.0, 90, 60.0), axis(3.0, 91, 60.0)];
        lost[0].signals.measured.iter_mut().skip(2000).for_each(|value| *value += 50.0);
        flown.push(lost);
        let after = knowledge(&described(), &flown, true, 1).unwrap();
        assert_eq!(after.left_out, ["90.csv"]);
        assert_eq!(after.axes[0].survived, before.axes[0].survived);
        assert!(matches!(knowledge(&described(), &logs([0.0, 0.0], 2), true, 1), Err(NextError::Still)));
    }
}
