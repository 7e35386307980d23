//! Linear position loop of one axis, for the tests: PD on position and velocity, third-order attitude loop, delayed and noisy
//! measurement, coloured disturbance. Simulated at 2 ms, position loop at 100 Hz.

use std::collections::VecDeque;
use std::f64::consts::TAU;

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

/// The lane as the firmware runs it.
struct Lane {
    gain: LaneGain,
    errors: VecDeque<[f64; 2]>,
    outputs: VecDeque<f64>,
    integral: f64,
}

impl Lane {
    fn new(gain: LaneGain) -> Self {
        Self {
            errors: VecDeque::from(vec![[0.0; 2]; gain.error_coefficients.len()]),
            outputs: VecDeque::from(vec![0.0; gain.past_output_coefficients.len() + 1]),
            gain,
            integral: 0.0,
        }
    }

    fn step(&mut self, error: [f64; 2], [fast_limit, slow_limit]: [f64; 2]) -> f64 {
        self.errors.pop_back();
        self.errors.push_front(error);
        let slow = self.gain.steady_integral_coefficient() * self.integral;
        let bounded_slow = slow.clamp(-slow_limit, slow_limit);
        let errors = self.gain.error_coefficients.iter().zip(&self.errors);
        let outputs = self.gain.past_output_coefficients.iter().zip(&self.outputs);
        let fast = errors.map(|(c, e)| c[0] * e[0] + c[1] * e[1]).sum::<f64>()
            + outputs.map(|(c, u)| c * (u - bounded_slow)).sum::<f64>();
        let bounded_fast = fast.clamp(-fast_limit, fast_limit);
        let push = self.gain.steady_integral_coefficient() * error[0];
        // The integral stops at its own clamp only: stopped at the fast one as well, it would never take over a constant
        // disturbance that is larger than that clamp.
        if slow == bounded_slow || push * slow < 0.0 {
            self.integral += TICK * error[0];
        }
        let output = bounded_fast + bounded_slow;
        self.outputs.pop_back();
        self.outputs.push_front(output);
        output
    }
}

/// Sum of tones and its derivative.
fn multisine(tones: &[[f64; 3]], time: f64) -> [f64; 2] {
    tones.iter().fold([0.0; 2], |[position, velocity], [amplitude, rate, phase]| {
        let (sine, cosine) = (rate * time + phase).sin_cos();
        [position + amplitude * sine, velocity + amplitude * rate * cosine]
    })
}

pub(super) fn fly(flight: &Flight) -> Log {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(flight.seed);
    let tones: Vec<[f64; 3]> = (0..12)
        .map(|index| {
            let period = 1.5 * (20.0_f64 / 1.5).powf(f64::from(index) / 11.0);
            [0.05 * period.sqrt(), TAU / period, TAU * random.random::<f64>()]
        })
        .collect();
    let desired_at = |time: f64| {
        if flight.moving { multisine(&tones, time) } else { [0.0; 2] }
    };

    let mut log = Log::default();
    let mut lane = flight.lane.clone().map(Lane::new);
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
        let correction =
            lane.as_mut().map_or(0.0, |lane| lane.step([measured[0] - matched[0], measured[1] - matched[1]], flight.limits));
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
