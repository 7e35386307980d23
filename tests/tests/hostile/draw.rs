//! What is drawn: a desired trajectory, a vehicle, an air, and what goes wrong on the way to the loop.

use std::fmt;

use impromptu_reproduction::robustness::Fault;
use impromptu_sim::trajectory::{Sample, Trajectory, figure_eight, strokes};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Length of the flights that are not strokes, s.
const SECONDS: f64 = 16.0;
/// Until then the vehicle hovers, s.
const LEAD: f64 = 2.0;
const HEIGHT: f64 = 1.5;

/// Names of [`Desired`].
pub(crate) const KINDS: [&str; 6] = ["hover", "step", "square", "zigzag", "re-plan", "strokes"];

/// What is desired; m, s, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Desired {
    Hover,
    Step {
        size: f64,
    },
    Square {
        size: f64,
        half: f64,
    },
    Zigzag {
        speed: f64,
        half: f64,
    },
    /// A figure 8 that goes on elsewhere on its curve, from one tick to the next, at each of these times.
    Replan {
        period: f64,
        at: f64,
    },
    Strokes {
        seed: u64,
        speed: f64,
    },
}

/// One flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Draw {
    pub(crate) number: u32,
    pub(crate) desired: Desired,
    /// Where a step goes, rad from the world's x.
    pub(crate) direction: f64,
    pub(crate) vehicle: &'static str,
    pub(crate) condition: &'static str,
    pub(crate) delay_ms: f64,
    pub(crate) thrust: f64,
    pub(crate) drag: f64,
    /// Factor on the position gains, known to the loop.
    pub(crate) gains: f64,
    pub(crate) wind: f64,
    pub(crate) noise: f64,
    pub(crate) fault: Fault,
}

impl Desired {
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Hover => "hover",
            Self::Step { .. } => "step",
            Self::Square { .. } => "square",
            Self::Zigzag { .. } => "zigzag",
            Self::Replan { .. } => "re-plan",
            Self::Strokes { .. } => "strokes",
        }
    }

    /// How far what is desired jumps at once, m.
    pub(crate) fn jump(&self) -> f64 {
        match *self {
            Self::Step { size } | Self::Square { size, .. } => size,
            // From one side of the figure 8 to the other.
            Self::Replan { .. } => 2.0,
            _ => 0.0,
        }
    }

    /// The whole trajectory at a rate, Hz.
    pub(crate) fn trajectory(&self, rate_hz: f64, direction: f64) -> Trajectory {
        let along = |way: f64, speed: f64| Sample {
            position: [way * direction.cos(), way * direction.sin(), HEIGHT],
            velocity: [speed * direction.cos(), speed * direction.sin(), 0.0],
            ..Sample::default()
        };
        let half_turns = |t: f64, half: f64| (t / half).rem_euclid(2.0);
        let at = |t: f64| match *self {
            Self::Step { size } => along(size, 0.0),
            Self::Square { size, half } => along(if half_turns(t, half) < 1.0 { size } else { 0.0 }, 0.0),
            Self::Zigzag { speed, half } => {
                let phase = half_turns(t, half);
                let (way, sign) = if phase < 1.0 { (phase, 1.0) } else { (2.0 - phase, -1.0) };
                along(speed * half * way, sign * speed)
            }
            _ => along(0.0, 0.0),
        };
        match *self {
            Self::Strokes { seed, speed } => strokes(seed, 1, speed, rate_hz).expect("a stroke").swap_remove(0),
            Self::Replan { period, at } => {
                let mut trajectory = figure_eight(2.0, 1.0, period, SECONDS / period).sampled(rate_hz).expect("a figure 8");
                let cut = ((at + LEAD) * rate_hz) as usize;
                let skipped = (0.3 * period * rate_hz) as usize;
                let end = trajectory.samples.len();
                trajectory.samples.drain(cut.min(end)..(cut + skipped).min(end));
                trajectory.scored = 0..trajectory.samples.len();
                trajectory
            }
            _ => {
                let samples: Vec<Sample> = (0..(SECONDS * rate_hz) as usize)
                    .map(|tick| tick as f64 / rate_hz - LEAD)
                    .map(|t| if t < 0.0 { along(0.0, 0.0) } else { at(t) })
                    .collect();
                Trajectory { name: self.kind().into(), rate_hz, scored: 0..samples.len(), samples }
            }
        }
    }
}

impl Draw {
    /// The draw of this number.
    pub(crate) fn new(number: u32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(0x05ee_d0fa_11e5_u64 ^ (u64::from(number) << 20));
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let desired = match between(0.0, 6.0) as usize {
            0 => Desired::Hover,
            1 => Desired::Step { size: between(0.3, 3.0) },
            2 => Desired::Square { size: between(0.2, 1.0), half: between(1.0, 4.0) },
            3 => Desired::Zigzag { speed: between(0.5, 2.0), half: between(0.4, 1.5) },
            4 => Desired::Replan { period: between(4.0, 8.0), at: between(3.0, 8.0) },
            _ => Desired::Strokes { seed: between(0.0, 1e6) as u64, speed: between(0.7, 1.7) },
        };
        let mut often = |share: f64| between(0.0, 1.0) < share;
        let (delayed, weak, dragged, other_gains, windy, noisy) =
            (often(0.4), often(0.3), often(0.3), often(0.3), often(0.3), often(0.2));
        let vehicle = if often(0.5) { "crazyflie" } else { "crazyflie-brushless" };
        let condition = ["clean", "lab", "rough"][between(0.0, 3.0) as usize];
        let direction = between(0.0, std::f64::consts::TAU);
        // Equally likely to be smaller and larger, in proportion.
        let mut factor = |low: f64, high: f64| between(low.ln(), high.ln()).exp();
        let (drag, gains) = (factor(0.3, 6.0), factor(0.5, 2.0));
        let gains = if other_gains { gains } else { 1.0 };
        // Firm gains are lost from some 85 ms on, the softest from 150 ms.
        let longest = 80.0 / f64::max(gains, 0.53);
        let at = between(3.0, 8.0);
        let fault = match between(0.0, 8.0) as usize {
            0 => Fault::Frozen { at, seconds: between(0.3, 1.5) },
            1 => Fault::Jumps { size: between(0.05, 1.0), each: between(0.5, 3.0) },
            2 => Fault::Starved { at, seconds: between(0.1, 0.8) },
            _ => Fault::None,
        };
        Self {
            number,
            desired,
            direction,
            vehicle,
            condition,
            delay_ms: if delayed { between(5.0, longest).round() } else { 0.0 },
            thrust: if weak { between(0.75, 1.25) } else { 1.0 },
            drag: if dragged { drag } else { 1.0 },
            gains,
            wind: if windy { between(0.5, 8.0) } else { 0.0 },
            noise: if noisy { between(1.0, 5.0) } else { 1.0 },
            fault,
        }
    }

    /// The plainest draw that is still `worse`: one thing after the other is left out.
    pub(crate) fn shrunk(&self, worse: impl Fn(&Self) -> bool) -> Self {
        let plainer: [fn(&mut Self); 8] = [
            |draw| draw.fault = Fault::None,
            |draw| draw.noise = 1.0,
            |draw| draw.wind = 0.0,
            |draw| draw.gains = 1.0,
            |draw| draw.drag = 1.0,
            |draw| draw.thrust = 1.0,
            |draw| draw.delay_ms = 0.0,
            |draw| draw.desired = Desired::Hover,
        ];
        let mut plainest = *self;
        for change in plainer {
            let mut next = plainest;
            change(&mut next);
            if next != plainest && worse(&next) {
                plainest = next;
            }
        }
        plainest
    }
}

impl fmt::Display for Draw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.vehicle, self.condition)?;
        match self.desired {
            Desired::Hover => write!(f, ", hover")?,
            Desired::Step { size } => write!(f, ", step {size:.2} m")?,
            Desired::Square { size, half } => write!(f, ", square {size:.2} m {half:.2} s")?,
            Desired::Zigzag { speed, half } => write!(f, ", zigzag {speed:.2} m/s {half:.2} s")?,
            Desired::Replan { period, at } => write!(f, ", re-plan of {period:.2} s at {at:.2} s")?,
            Desired::Strokes { seed, speed } => write!(f, ", stroke {seed} x{speed:.2}")?,
        }
        let factors = [("thrust", self.thrust), ("drag", self.drag), ("gains", self.gains), ("noise", self.noise)];
        for (name, factor) in factors.into_iter().filter(|(_, factor)| *factor != 1.0) {
            write!(f, ", {name} x{factor:.2}")?;
        }
        for (name, value, unit) in [("delay", self.delay_ms, "ms"), ("wind", self.wind, "m/s")] {
            if value > 0.0 {
                write!(f, ", {name} {value:.1} {unit}")?;
            }
        }
        match self.fault {
            Fault::None => Ok(()),
            Fault::Frozen { at, seconds } => write!(f, ", frozen at {at:.2} s for {seconds:.2} s"),
            Fault::Jumps { size, each } => write!(f, ", jumps of {size:.2} m each {each:.2} s"),
            Fault::Starved { at, seconds } => write!(f, ", starved at {at:.2} s for {seconds:.2} s"),
        }
    }
}
