//! Linear position loop of one axis, for the tests: PD on position and velocity, third-order attitude loop, delayed and noisy
//! measurement, coloured disturbance, and the firmware's own feedback lane. Simulated at 2 ms, position loop at 100 Hz.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use impromptu_firmware::{
    feedback::{AxisState, Lane},
    format::{Authority, Blob, FeedbackAxis, FeedbackLayout, MAX_ERRORS, Margins, Section},
};
use impromptu_sim::trajectory::tones::{self, Tone};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{AxisLog, LaneGain};

const STEP: f64 = 0.002;
const STEPS_PER_TICK: usize = 5;
pub(super) const TICK: f64 = 0.01;
const DELAY: f64 = 0.024;

/// Conditions and settings of one flight.
#[derive(Clone)]
pub(super) struct Flight {
    pub(super) seconds: f64,
    /// Delay of the measurement beyond the 24 ms which the lane knows of, s.
    pub(super) more_delay: f64,
    /// Factor on the acceleration that the loop asks for.
    pub(super) gain: f64,
    /// Standard deviations, m and m/s.
    pub(super) noise: [f64; 2],
    /// Ornstein-Uhlenbeck disturbance (0.4 s), standard deviation in m/s².
    pub(super) gusts: f64,
    /// Constant disturbance, m/s².
    pub(super) push: f64,
    /// Amplitude of the dither, m.
    pub(super) dither: f64,
    /// Multisine (12 tones, periods 1.5 to 20 s) instead of hovering.
    pub(super) moving: bool,
    pub(super) lane: Option<LaneGain>,
    /// Clamps of the lane's fast part and of its integral, m.
    pub(super) limits: [f64; 2],
    pub(super) seed: u64,
}

impl Flight {
    /// Ten seconds of hover in `lab` conditions without a lane.
    pub(super) fn lab() -> Self {
        Self {
            seconds: 10.0,
            more_delay: 0.0,
            gain: 1.0,
            noise: [3e-4, 1e-2],
            gusts: 0.05,
            push: 0.0,
            dither: 0.0,
            moving: false,
            lane: None,
            limits: [0.3, 0.3],
            seed: 1,
        }
    }

    /// The flight from which a lane is designed: 1.5 minutes of multisine with a dither of 1 cm.
    pub(super) fn collecting() -> Self {
        Self { seconds: 90.0, dither: 0.01, moving: true, ..Self::lab() }
    }

    pub(super) fn rough(self) -> Self {
        Self { noise: [7e-4, 2e-2], gusts: 0.12, ..self }
    }
}

/// What was logged at each tick.
#[derive(Default)]
pub(super) struct Log {
    pub(super) measured_position: Vec<f64>,
    pub(super) measured_velocity: Vec<f64>,
    pub(super) reference_position: Vec<f64>,
    pub(super) reference_velocity: Vec<f64>,
    pub(super) dither: Vec<f64>,
    /// True minus desired position.
    pub(super) error: Vec<f64>,
}

impl Log {
    pub(super) fn axis(&self) -> AxisLog<'_> {
        AxisLog {
            measured_position: &self.measured_position,
            measured_velocity: &self.measured_velocity,
            reference_position: &self.reference_position,
            reference_velocity: &self.reference_velocity,
            dither: None,
        }
    }

    /// RMS of the true error after two seconds, m.
    pub(super) fn error_rms(&self) -> f64 {
        let settled = &self.error[200..];
        (settled.iter().map(|error| error * error).sum::<f64>() / settled.len() as f64).sqrt()
    }
}

/// The gain as a model file stores it, with the clamps of its fast and its slow part (m), and the coefficients' bytes.
fn stored(gain: &LaneGain, [fast_limit, integral_limit]: [f64; 2]) -> (FeedbackLayout, Vec<u8>) {
    let blob: Vec<u8> = gain.stored_coefficients().iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    let axis = FeedbackAxis {
        output: 0,
        errors: [(0, 0), (1, 1)].into_iter().collect(),
        coefficients: Section { offset: 0, length: blob.len() as u32 },
        integral: gain.integral_coefficient as f32,
        fast_limit: fast_limit as f32,
        integral_limit: integral_limit as f32,
    };
    // Authority is given at each step; what a flight would take from it plays no part.
    let authority = Authority { channels: [].into_iter().collect(), scale: 1.0, error_scale: 1.0, decay: 1.0 };
    let axes = std::iter::once(axis).collect();
    (FeedbackLayout { lags: gain.lags() as u8, axes, authority, margins: Margins::default() }, blob)
}

/// The firmware's lane on one axis, with all its authority.
struct Pilot<'a> {
    lane: Lane<'a>,
    state: AxisState,
}

impl Pilot<'_> {
    fn step(&mut self, error: [f64; 2]) -> f64 {
        let mut errors = [0.0; MAX_ERRORS];
        errors.iter_mut().zip(error).for_each(|(stored, error)| *stored = error as f32);
        let output = self.state.step(&self.lane, &self.lane.axes()[0], errors, 1.0, TICK as f32, true);
        self.state.applied(&self.lane, output);
        f64::from(output)
    }
}

pub(super) fn fly(flight: &Flight) -> Log {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(flight.seed);
    let tones: Vec<Tone> = (0..12)
        .map(|index| {
            let period = 1.5 * (20.0_f64 / 1.5).powf(f64::from(index) / 11.0);
            Tone { amplitude: 0.05 * period.sqrt(), rate: TAU / period, phase: TAU * random.random::<f64>() }
        })
        .collect();
    let desired_at = |time: f64| {
        let [position, velocity, _] = if flight.moving { tones::sum(&tones, time) } else { [0.0; 3] };
        [position, velocity]
    };

    let mut log = Log::default();
    let stored = flight.lane.as_ref().map(|gain| stored(gain, flight.limits));
    let mut pilot = stored.as_ref().map(|(layout, blob)| Pilot {
        lane: Lane::new(layout, &Blob::new(blob)).expect("a lane that the firmware takes"),
        state: AxisState::EMPTY,
    });
    let [mut position, mut velocity] = desired_at(0.0);
    let mut attitude = [0.0_f64; 3];
    let mut gust = 0.0;
    let mut dither = flight.dither;
    let delay_steps = ((DELAY + flight.more_delay) / STEP).round() as usize;
    let mut past = VecDeque::from(vec![[position, velocity]; delay_steps + 1]);
    let ticks = (flight.seconds / TICK) as usize;
    for tick in 0..ticks {
        let time = tick as f64 * TICK;
        let [true_position, true_velocity] = past[delay_steps];
        let noise: [f64; 2] = flight.noise.map(|sigma| {
            let normal: f64 = StandardNormal.sample(&mut random);
            sigma * normal
        });
        let measured = [true_position + noise[0], true_velocity + noise[1]];
        let desired = desired_at(time);
        let matched = desired_at(time - DELAY);
        let correction = pilot.as_mut().map_or(0.0, |pilot| pilot.step([measured[0] - matched[0], measured[1] - matched[1]]));
        if tick % 5 == 0 && random.random::<bool>() {
            dither = -dither;
        }
        let reference = [desired[0] + dither + correction, desired[1]];
        let command = flight.gain * (6.5 * (reference[0] - measured[0]) + 4.0 * (reference[1] - measured[1]));
        log.measured_position.push(measured[0]);
        log.measured_velocity.push(measured[1]);
        log.reference_position.push(reference[0]);
        log.reference_velocity.push(reference[1]);
        log.dither.push(dither);
        log.error.push(position - desired[0]);
        for _ in 0..STEPS_PER_TICK {
            let normal: f64 = StandardNormal.sample(&mut random);
            gust += -gust * STEP / 0.4 + flight.gusts * (2.0 * STEP / 0.4_f64).sqrt() * normal;
            // 310 / (0.072 s³ + s² + 57 s + 310), semi-implicit: the newest derivative is used at once.
            attitude[2] += STEP * (310.0 * (command - attitude[0]) - 57.0 * attitude[1] - attitude[2]) / 0.072;
            attitude[1] += STEP * attitude[2];
            attitude[0] += STEP * attitude[1];
            velocity += STEP * (attitude[0] + gust + flight.push);
            position += STEP * velocity;
            past.pop_back();
            past.push_front([position, velocity]);
        }
    }
    log
}
