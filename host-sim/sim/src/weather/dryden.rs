//! Turbulence near the ground: the Dryden model of MIL-F-8785C for altitudes up to 1,000 feet.
//!
//! White noise through one forming filter for each axis, with V the airspeed, L the scale lengths and sigma the intensities:
//!
//! ```text
//! along the wind   H_u(s) = sigma_u sqrt(2 L_u / (pi V)) / (1 + s L_u / V)
//! across it        H_v(s) = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) s L_v / V) / (1 + s L_v / V)^2
//! vertical         H_w    = H_v with sigma_w and L_w
//!
//! h in feet:  L_w = h   L_u = L_v = h / (0.177 + 0.000823 h)^1.2
//!             sigma_w = 0.1 W_20   sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4
//! ```
//!
//! The turbulence is frozen and carried past the vehicle at V. Altitude and airspeed are taken as constant, so that the
//! filters are linear and time-invariant and can be discretised exactly; below 10 feet, where the standard ends, the
//! values of 10 feet hold.

use rand::RngExt;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::error::{WeatherError, require};

const METRES_PER_FOOT: f64 = 0.3048;

/// Dryden gusts at low altitude (MIL-F-8785C).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dryden {
    /// Mean wind speed at 6 m (20 feet, W_20), m/s: it sets the intensity. 7.7, 15.4 and 23.2 m/s are the standard's light,
    /// moderate and severe turbulence.
    pub wind_at_6_m: f64,
    /// Height above the ground, m, up to 304.8.
    pub altitude: f64,
    /// Speed at which the vehicle meets the air, m/s: about that of the wind when it hovers.
    pub airspeed: f64,
}

impl Dryden {
    pub(super) fn check(&self) -> Result<(), WeatherError> {
        let intensity = self.wind_at_6_m.is_finite() && self.wind_at_6_m >= 0.0;
        require(intensity, "gusts.wind_at_6_m", "zero or positive (m/s)")?;
        let height = self.altitude >= 0.0 && self.altitude <= 1000.0 * METRES_PER_FOOT;
        require(height, "gusts.altitude", "between 0 and 304.8 m")?;
        let speed = self.airspeed.is_finite() && self.airspeed > 0.0;
        require(speed, "gusts.airspeed", "positive (m/s)")
    }

    /// Scale lengths (L_u = L_v, L_w), m.
    fn scale_lengths(&self) -> [f64; 2] {
        let feet = self.feet();
        let horizontal = feet / libm::pow(0.177 + 0.000823 * feet, 1.2);
        [horizontal * METRES_PER_FOOT, feet * METRES_PER_FOOT]
    }

    /// Intensities (sigma_u = sigma_v, sigma_w), m/s.
    fn intensities(&self) -> [f64; 2] {
        let vertical = 0.1 * self.wind_at_6_m;
        let horizontal = vertical / libm::pow(0.177 + 0.000823 * self.feet(), 0.4);
        [horizontal, vertical]
    }

    fn feet(&self) -> f64 {
        (self.altitude / METRES_PER_FOOT).max(10.0)
    }
}

/// First-order filter in units of its output's standard deviation: an Ornstein-Uhlenbeck process.
#[derive(Debug, Clone)]
struct Longitudinal {
    decay: f64,
    spread: f64,
    state: f64,
}

/// Second-order filter in units of its output's standard deviation: two first-order filters in a chain,
/// dx = (noise - x) / T, dy = (x - y) / T, T = L / V, output (sqrt(3) x + (1 - sqrt(3)) y) / sqrt(2).
///
/// With the noise scaled so that x has unit variance, the stationary covariance is P = [[1, 1/2], [1/2, 1/2]] and the
/// output has unit variance. A tick of t = a T multiplies (x, y) by e^-a [[1, 0], [a, 1]] and adds noise of covariance
/// P minus what the multiplication leaves of P, here by its Cholesky factor: exact at any tick.
#[derive(Debug, Clone)]
struct Transverse {
    decay: f64,
    ratio: f64,
    factor: [f64; 3],
    state: [f64; 2],
}

impl Transverse {
    fn new(ratio: f64, random: &mut Xoshiro256PlusPlus) -> Self {
        let square = libm::exp(-2.0 * ratio);
        let first = (-libm::expm1(-2.0 * ratio)).sqrt();
        let mixed = (0.5 - square * (ratio + 0.5)) / first;
        let second = 0.5 - square * (ratio * ratio + ratio + 0.5);
        let (x, y) = (normal(random), normal(random));
        Self {
            decay: libm::exp(-ratio),
            ratio,
            factor: [first, mixed, (second - mixed * mixed).max(0.0).sqrt()],
            state: [x, 0.5 * (x + y)],
        }
    }

    fn advance(&mut self, random: &mut Xoshiro256PlusPlus) {
        let ([x, y], [first, mixed, second]) = (self.state, self.factor);
        let (a, b) = (normal(random), normal(random));
        self.state = [self.decay * x + first * a, self.decay * (self.ratio * x + y) + mixed * a + second * b];
    }

    fn value(&self) -> f64 {
        let root = 3.0_f64.sqrt();
        (root * self.state[0] + (1.0 - root) * self.state[1]) * std::f64::consts::FRAC_1_SQRT_2
    }
}

/// The running gusts of one flight.
#[derive(Debug, Clone)]
pub(super) struct Gusts {
    /// Horizontal unit vector along the mean wind (x, y); world x when there is none.
    direction: [f64; 2],
    intensities: [f64; 2],
    along: Longitudinal,
    across: Transverse,
    vertical: Transverse,
    random: Xoshiro256PlusPlus,
}

impl Gusts {
    pub(super) fn new(settings: &Dryden, mean_wind: [f64; 3], tick: f64, mut random: Xoshiro256PlusPlus) -> Self {
        let [horizontal, vertical] = settings.scale_lengths().map(|length| tick * settings.airspeed / length);
        let [x, y, _] = mean_wind;
        let speed = (x * x + y * y).sqrt();
        Self {
            direction: if speed > 0.0 { [x / speed, y / speed] } else { [1.0, 0.0] },
            intensities: settings.intensities(),
            along: Longitudinal {
                decay: libm::exp(-horizontal),
                spread: (-libm::expm1(-2.0 * horizontal)).sqrt(),
                state: normal(&mut random),
            },
            across: Transverse::new(horizontal, &mut random),
            vertical: Transverse::new(vertical, &mut random),
            random,
        }
    }

    /// Gust velocity, m/s, world ENU.
    pub(super) fn value(&self) -> [f64; 3] {
        let [horizontal, vertical] = self.intensities;
        let [cosine, sine] = self.direction;
        let (u, v) = (horizontal * self.along.state, horizontal * self.across.value());
        [cosine * u - sine * v, sine * u + cosine * v, vertical * self.vertical.value()]
    }

    pub(super) fn advance(&mut self) {
        let along = &mut self.along;
        along.state = along.decay * along.state + along.spread * normal(&mut self.random);
        self.across.advance(&mut self.random);
        self.vertical.advance(&mut self.random);
    }
}

fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    random.sample(StandardNormal)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    const SETTINGS: Dryden = Dryden { wind_at_6_m: 7.7, altitude: 6.096, airspeed: 5.0 };

    #[test]
    fn scales_and_intensities_are_the_standards() {
        // 20 feet: 0.177 + 0.000823 * 20 = 0.19346.
        let [horizontal, vertical] = SETTINGS.scale_lengths();
        assert!((horizontal / METRES_PER_FOOT - 143.56).abs() < 0.05, "{horizontal}");
        assert!((vertical - 6.096).abs() < 1e-9);
        let [horizontal, vertical] = SETTINGS.intensities();
        assert!((vertical - 0.77).abs() < 1e-12);
        assert!((horizontal / vertical - 1.929).abs() < 1e-3, "{horizontal}");
        let low = Dryden { altitude: 1.0, ..SETTINGS };
        assert!((low.scale_lengths()[1] - 10.0 * METRES_PER_FOOT).abs() < 1e-12);
    }

    #[test]
    fn variance_and_correlation_follow_the_filters_at_any_tick() {
        // Correlation after a time t: e^-r along the wind, e^-r (1 - r / 2) across it and vertically, r = t V / L.
        let [horizontal, vertical] = SETTINGS.scale_lengths().map(|l| l / SETTINGS.airspeed);
        for ticks_per_length in [4, 40] {
            let tick = vertical / f64::from(ticks_per_length);
            let random = Xoshiro256PlusPlus::seed_from_u64(5);
            let mut gusts = Gusts::new(&SETTINGS, [0.0, -2.0, 0.0], tick, random);
            let values: Vec<[f64; 3]> = (0..50_000 * ticks_per_length)
                .map(|_| {
                    gusts.advance();
                    gusts.value()
                })
                .collect();
            let lag = ticks_per_length as usize;
            let ratio = vertical / horizontal;
            let [wide, high] = SETTINGS.intensities();
            // The mean wind blows to -y: along is y, across is x.
            let expected = [(wide, (-ratio).exp() * (1.0 - 0.5 * ratio)), (wide, (-ratio).exp()), (high, (-1.0_f64).exp() * 0.5)];
            for (axis, (sigma, correlation)) in expected.into_iter().enumerate() {
                let variance = values.iter().map(|value| value[axis].powi(2)).sum::<f64>() / values.len() as f64;
                assert!((variance / (sigma * sigma) - 1.0).abs() < 0.06, "{axis} {variance}");
                let pairs = values.iter().zip(&values[lag..]);
                let covariance = pairs.map(|(a, b)| a[axis] * b[axis]).sum::<f64>() / (values.len() - lag) as f64;
                let found = covariance / variance;
                assert!((found - correlation).abs() < 0.03, "{axis} {found} {correlation}");
            }
        }
    }
}
