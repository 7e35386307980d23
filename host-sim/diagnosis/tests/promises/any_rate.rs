//! Loops in continuous time, logged at any rate for any time, beside disturbances of any colour.
//!
//! From a seed: two poles of 0.1 to 5 Hz (a pair of damping 0.5 to 1.2, or two real ones), in a third of the loops one more, two
//! to five times as fast; no zero, one in the left half plane, or, in every fourth loop, one in the right half plane; gain 1 in
//! half of the loops, else 0.4 to 0.8 or 1.25 to 2.5; dead time of 0 to 7 rows of the log, or 0.02 to 1 s; log rates of 20 Hz to
//! 2 kHz and lengths of 10 s to 30 min, both log-uniform; a disturbance of 0.01 to 1 times the output's RMS, log-uniform, with a
//! correlation time of a tenth of the loop's to ten times it; white noise of 0.2 %. The reference is one of steps, of twelve
//! tones, or of smooth moves between random places.

use impromptu_diagnosis::Record;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::loops::product;

/// A loop and how it is logged.
#[derive(Clone, Debug)]
pub(crate) struct Logged {
    /// Transition of the states and the reference's column, at the log's rate.
    transition: DMatrix<f64>,
    input: DVector<f64>,
    output: DVector<f64>,
    pub(crate) gain: f64,
    pub(crate) minimum_phase: bool,
    /// Frequency of the zero, Hz; 0 if there is none.
    pub(crate) zero_hz: f64,
    /// Frequency of the slowest poles, Hz.
    pub(crate) pole_hz: f64,
    dead_rows: usize,
    /// Lag of slow signals, s: that of poles, zero and dead time, and of the reference that is held for a row.
    pub(crate) lag_s: f64,
    pub(crate) rate_hz: f64,
    pub(crate) seconds: f64,
    /// Disturbance: RMS as a share of the output's, correlation time in s.
    pub(crate) disturbance: [f64; 2],
    kind: usize,
    level: f64,
}

fn between(random: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random_range(0.0..1.0))
}

impl Logged {
    pub(crate) fn new(index: usize, seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let random = &mut random;
        let rate_hz = between(random, 20.0, 2000.0);
        let pole_hz = between(random, 0.1, (rate_hz / 8.0).min(5.0));
        let natural = std::f64::consts::TAU * pole_hz;
        // Denominator in rising powers of s, with 1 at s = 0.
        let mut denominator = if random.random::<bool>() {
            vec![1.0, 2.0 * random.random_range(0.5..1.2) / natural, natural.powi(-2)]
        } else {
            product(&[1.0, 1.0 / natural], &[1.0, 1.0 / (natural * random.random_range(1.0..4.0))])
        };
        if random.random_range(0..3) == 0 {
            denominator = product(&denominator, &[1.0, 1.0 / (natural * random.random_range(2.0..5.0))]);
        }
        let minimum_phase = !index.is_multiple_of(4);
        let numerator = match (minimum_phase, random.random::<bool>()) {
            (false, _) => vec![1.0, -1.0 / (natural * between(random, 0.4, 2.5))],
            (true, true) => vec![1.0, 1.0 / (natural * between(random, 0.5, 5.0))],
            (true, false) => vec![1.0],
        };
        let gain = match (index / 2).is_multiple_of(2) {
            true => 1.0,
            false if random.random::<bool>() => random.random_range(0.4..0.8),
            false => random.random_range(1.25..2.5),
        };
        let seconds = between(random, 10.0, 1800.0);
        let dead_rows = match random.random::<bool>() {
            true => random.random_range(0..8),
            false => (between(random, 0.02, 1.0).min(0.05 * seconds) * rate_hz) as usize,
        };
        let (transition, input, output) = discretised(&numerator, &denominator, gain, 1.0 / rate_hz);
        let moment = |polynomial: &[f64]| polynomial.get(1).copied().unwrap_or(0.0);
        let mut logged = Self {
            transition,
            input,
            output,
            gain,
            minimum_phase,
            zero_hz: numerator.get(1).map_or(0.0, |c| 1.0 / (c.abs() * std::f64::consts::TAU)),
            pole_hz,
            dead_rows,
            lag_s: moment(&denominator) - moment(&numerator) + (dead_rows as f64 + 0.5) / rate_hz,
            rate_hz,
            seconds,
            disturbance: [between(random, 0.01, 1.0), between(random, 0.1, 10.0) / natural],
            kind: random.random_range(0..3),
            level: 0.0,
        };
        let quiet = logged.answered(&logged.signal((300.0 / pole_hz * rate_hz) as usize, seed ^ 0xabcd));
        let mean = quiet.iter().sum::<f64>() / quiet.len() as f64;
        logged.level = (quiet.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / quiet.len() as f64).sqrt();
        logged
    }

    pub(crate) fn rows(&self) -> usize {
        (self.seconds * self.rate_hz) as usize
    }

    /// References of this loop's kind, as often as the log has rows.
    pub(crate) fn signal(&self, rows: usize, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut signal = Vec::with_capacity(rows);
        let time = self.rate_hz / self.pole_hz;
        match self.kind {
            0 => {
                while signal.len() < rows {
                    let (height, held) = (random.random_range(-1.0..1.0), random.random_range(0.2..2.0) * time);
                    signal.extend(std::iter::repeat_n(height, held.ceil() as usize));
                }
                signal.truncate(rows);
            }
            1 => {
                let tones: Vec<[f64; 3]> = (0..12)
                    .map(|tone| {
                        let share = 0.04 * 75f64.powf((f64::from(tone) + random.random_range(0.0..1.0)) / 12.0);
                        let angle = std::f64::consts::TAU * share / time;
                        [angle, random.random_range(0.0..std::f64::consts::TAU), 0.4 / (1.0 + share)]
                    })
                    .collect();
                signal.extend((0..rows).map(|row| -> f64 {
                    tones.iter().map(|[angle, phase, size]| size * (angle * row as f64 + phase).sin()).sum()
                }));
            }
            _ => {
                let mut from: f64 = 0.0;
                while signal.len() < rows {
                    let (to, rows) = (random.random_range(-1.0..1.0), (random.random_range(0.3..2.0) * time).ceil() as usize);
                    signal.extend((0..rows).map(|row| {
                        let share = (row + 1) as f64 / rows as f64;
                        from + (to - from) * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
                    }));
                    from = to;
                }
                signal.truncate(rows);
            }
        }
        signal
    }

    /// The loop's own answer.
    fn answered(&self, references: &[f64]) -> Vec<f64> {
        let first = references.first().copied().unwrap_or(0.0);
        let rest = DMatrix::identity(self.input.len(), self.input.len()) - &self.transition;
        let mut state = rest.lu().solve(&(&self.input * first)).expect("the loop is stable");
        (0..references.len())
            .map(|row| {
                let answer = self.output.dot(&state);
                let reference = row.checked_sub(self.dead_rows).map_or(first, |row| references[row]);
                state = &self.transition * &state + &self.input * reference;
                answer
            })
            .collect()
    }

    /// What is measured when the loop is given references.
    pub(crate) fn measured(&self, references: &[f64], seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let [size, time] = self.disturbance;
        let kept = (-1.0 / (time * self.rate_hz)).exp();
        let mut drift = normal();
        self.answered(references)
            .into_iter()
            .map(|answer| {
                drift = kept * drift + (1.0 - kept * kept).sqrt() * normal();
                answer + self.level * (size * drift + 0.002 * normal())
            })
            .collect()
    }

    /// The log.
    pub(crate) fn record(&self, seed: u64) -> Record {
        let time: Vec<f64> = (0..self.rows()).map(|row| row as f64 / self.rate_hz).collect();
        let reference = self.signal(self.rows(), seed);
        let measured = self.measured(&reference, seed ^ 0x5eed);
        Record::new(&time, &reference, &measured).unwrap()
    }

    /// Answer to a sine at a frequency, Hz, against standing still.
    fn amplitude(&self, frequency_hz: f64) -> f64 {
        let turn = nalgebra::Complex::from_polar(1.0, std::f64::consts::TAU * frequency_hz / self.rate_hz);
        let size = self.input.len();
        let complex = |value: f64| nalgebra::Complex::new(value, 0.0);
        let system = DMatrix::from_fn(size, size, |i, j| if i == j { turn } else { complex(0.0) } - self.transition[(i, j)]);
        let state = system.lu().solve(&self.input.map(complex)).expect("no pole lies on the unit circle");
        (self.output.map(complex).dot(&state) / self.gain).norm()
    }

    /// Frequency of -3 dB, Hz.
    pub(crate) fn bandwidth_hz(&self) -> f64 {
        let step = 1.002f64;
        let mut frequency = 0.02 * self.pole_hz;
        while frequency < 0.5 * self.rate_hz && self.amplitude(frequency) > std::f64::consts::FRAC_1_SQRT_2 {
            frequency *= step;
        }
        frequency
    }

    /// Time until a step has settled to 2 %, s.
    pub(crate) fn settling_s(&self) -> f64 {
        let mut step = vec![0.0];
        step.resize((8.0 / self.pole_hz * self.rate_hz) as usize + self.dead_rows, 1.0);
        let answer = self.answered(&step);
        let range = answer.iter().fold(self.gain, |range, value| range.max(value.abs()));
        let away = answer.iter().rposition(|value| (value - self.gain).abs() > 0.02 * range);
        away.map_or(0.0, |row| row as f64 / self.rate_hz)
    }
}

/// gain B(s)/F(s), rising powers, with a reference that is held between rows: exact, by the exponential of states and input.
fn discretised(numerator: &[f64], denominator: &[f64], gain: f64, period_s: f64) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let order = denominator.len() - 1;
    // Time in units of 1/scale keeps the matrix's entries near one.
    let scale = denominator[order].powf(-1.0 / order as f64);
    let of = |polynomial: &[f64], power: usize| polynomial.get(power).copied().unwrap_or(0.0) * scale.powi(power as i32);
    let leading = of(denominator, order);
    let mut system = DMatrix::zeros(order + 1, order + 1);
    for power in 0..order {
        if power + 1 < order {
            system[(power, power + 1)] = 1.0;
        }
        system[(order - 1, power)] = -of(denominator, power) / leading;
    }
    system[(order - 1, order)] = 1.0;
    let exponential = (system * (period_s * scale)).exp();
    let output = DVector::from_fn(order, |power, _| gain * of(numerator, power) / leading);
    (
        exponential.view((0, 0), (order, order)).clone_owned(),
        exponential.view((0, order), (order, 1)).column(0).clone_owned(),
        output,
    )
}
