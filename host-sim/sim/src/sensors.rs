//! What the vehicle knows of itself: its true state plus noise, some ticks late.
//!
//! *in*: the true state; *out*: a measurement; *never*: a random number drawn for a source that is switched off;
//! *source*: additive white Gaussian noise, the attitude disturbed by a small rotation in the body frame.

mod delay_line;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::plant::State;

pub use delay_line::{DelayError, DelayLine};

/// Keeps the sensors' random numbers apart from those of other parts of a flight with the same seed.
const SALT: u64 = 0x510e_527f_ade6_82d1;

/// Standard deviations of the white noise in each component of a measurement; 0 switches a source off.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorNoise {
    /// Position, m.
    pub position: f64,
    /// Velocity, m/s.
    pub velocity: f64,
    /// Attitude, rad, about each body axis.
    pub attitude: f64,
    /// Body rates, rad/s.
    pub body_rates: f64,
}

/// A setting that describes no sensor.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("sensor noise: `{field}` must be finite, zero or positive")]
pub struct SensorError {
    /// The offending field.
    pub field: &'static str,
}

/// What the controller is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Position, m, world ENU.
    pub position: [f64; 3],
    /// Velocity, m/s, world ENU.
    pub velocity: [f64; 3],
    /// Attitude: unit Hamilton quaternion (w, x, y, z), body FLU to world ENU.
    pub attitude: [f64; 4],
    /// Body rates, rad/s, body FLU.
    pub body_rates: [f64; 3],
}

impl From<&State> for Measurement {
    /// Without noise.
    fn from(state: &State) -> Self {
        Self { position: state.position, velocity: state.velocity, attitude: state.attitude, body_rates: state.body_rates }
    }
}

/// The sensors of one flight. The fast part (attitude, body rates) and the slow part (position, velocity) have random
/// streams of their own, so that the rate of one does not change the other's noise.
#[derive(Debug, Clone)]
pub struct Sensors {
    noise: SensorNoise,
    fast: Xoshiro256PlusPlus,
    slow: Xoshiro256PlusPlus,
}

impl Sensors {
    /// Sensors of the flight with this seed, which may be that of the flight's weather too.
    ///
    /// # Errors
    /// A standard deviation that is negative or not finite.
    pub fn new(noise: &SensorNoise, seed: u64) -> Result<Self, SensorError> {
        let fields = [
            ("position", noise.position),
            ("velocity", noise.velocity),
            ("attitude", noise.attitude),
            ("body_rates", noise.body_rates),
        ];
        for (field, sigma) in fields {
            if !sigma.is_finite() || sigma < 0.0 {
                return Err(SensorError { field });
            }
        }
        Ok(Self {
            noise: *noise,
            fast: Xoshiro256PlusPlus::seed_from_u64(seed ^ SALT),
            slow: Xoshiro256PlusPlus::seed_from_u64(seed ^ !SALT),
        })
    }

    /// Measures everything.
    pub fn measure(&mut self, state: &State) -> Measurement {
        let (position, velocity) = self.position_and_velocity(state);
        let (attitude, body_rates) = self.attitude_and_body_rates(state);
        Measurement { position, velocity, attitude, body_rates }
    }

    /// Measures position (m) and velocity (m/s), world ENU.
    pub fn position_and_velocity(&mut self, state: &State) -> ([f64; 3], [f64; 3]) {
        (noisy(state.position, self.noise.position, &mut self.slow), noisy(state.velocity, self.noise.velocity, &mut self.slow))
    }

    /// Measures attitude (unit quaternion w, x, y, z, body to world) and body rates (rad/s).
    ///
    /// The attitude is the true one times (1, e / 2), normalised, with e the noise (rad, body frame): a rotation by |e|
    /// up to |e|³ / 12, which is nothing at the noise of any attitude estimate.
    pub fn attitude_and_body_rates(&mut self, state: &State) -> ([f64; 4], [f64; 3]) {
        let attitude = if self.noise.attitude == 0.0 {
            state.attitude
        } else {
            let [x, y, z] = noisy([0.0; 3], 0.5 * self.noise.attitude, &mut self.fast);
            let [qw, qx, qy, qz] = state.attitude;
            let turned = [
                qw - qx * x - qy * y - qz * z,
                qx + qw * x + qy * z - qz * y,
                qy + qw * y + qz * x - qx * z,
                qz + qw * z + qx * y - qy * x,
            ];
            let length = turned.iter().map(|value| value * value).sum::<f64>().sqrt();
            turned.map(|value| value / length)
        };
        let rates = noisy(state.body_rates, self.noise.body_rates, &mut self.fast);
        (attitude, rates)
    }
}

/// The value plus noise.
#[inline]
fn noisy(value: [f64; 3], sigma: f64, random: &mut Xoshiro256PlusPlus) -> [f64; 3] {
    if sigma == 0.0 {
        return value;
    }
    value.map(|component| component + sigma * random.sample::<f64, _>(StandardNormal))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAB: SensorNoise = SensorNoise { position: 0.3e-3, velocity: 0.01, attitude: 2e-3, body_rates: 0.02 };

    fn state() -> State {
        State {
            position: [1.0, 2.0, 3.0],
            velocity: [0.1, 0.2, 0.3],
            attitude: [0.5, -0.5, 0.5, 0.5],
            body_rates: [1.0, -1.0, 0.0],
            rotor_speeds: [0.0; 4],
        }
    }

    #[test]
    fn noise_has_the_standard_deviations_that_were_set() {
        let mut sensors = Sensors::new(&LAB, 3).unwrap();
        let truth = state();
        let count = 20_000;
        let mut squares = [0.0; 4];
        for _ in 0..count {
            let found = sensors.measure(&truth);
            let length: f64 = found.attitude.iter().map(|value| value * value).sum();
            assert!((length - 1.0).abs() < 1e-12);
            for axis in 0..3 {
                squares[0] += (found.position[axis] - truth.position[axis]).powi(2);
                squares[1] += (found.velocity[axis] - truth.velocity[axis]).powi(2);
                squares[3] += (found.body_rates[axis] - truth.body_rates[axis]).powi(2);
            }
            // Angle between the two attitudes, from their inner product c: sin² (angle / 2) = 1 - c².
            let inner: f64 = (0..4).map(|i| found.attitude[i] * truth.attitude[i]).sum();
            squares[2] += 4.0 * (1.0 - inner * inner);
        }
        let sigmas = [LAB.position, LAB.velocity, LAB.attitude, LAB.body_rates];
        for (square, sigma) in squares.into_iter().zip(sigmas) {
            let found = (square / f64::from(3 * count)).sqrt();
            assert!((found / sigma - 1.0).abs() < 0.02, "{found} {sigma}");
        }
    }

    #[test]
    fn silent_sensors_draw_nothing_and_tell_the_truth() {
        let mut sensors = Sensors::new(&SensorNoise::default(), 3).unwrap();
        let (fast, slow) = (sensors.fast.clone(), sensors.slow.clone());
        assert_eq!(sensors.measure(&state()), Measurement::from(&state()));
        assert_eq!((sensors.fast, sensors.slow), (fast, slow));
    }

    #[test]
    fn the_seed_decides_the_bits_and_the_slow_rate_does_not_touch_the_fast_noise() {
        let new = |seed| Sensors::new(&LAB, seed).unwrap();
        let (mut a, mut b, mut c) = (new(9), new(9), new(10));
        let first = a.measure(&state());
        let (attitude, rates) = b.attitude_and_body_rates(&state());
        assert_eq!((first.attitude, first.body_rates), (attitude, rates));
        assert_ne!(first, c.measure(&state()));
    }

    #[test]
    fn impossible_noise_is_refused_by_name() {
        let noise = SensorNoise { attitude: -1.0, ..LAB };
        assert_eq!(Sensors::new(&noise, 0).unwrap_err().field, "attitude");
        assert!(toml::from_str::<SensorNoise>("gyro = 1.0").is_err());
    }
}
