//! Sums of sinusoids (multisines) and the smooth step that fades them in and out.
//!
//! *in* tones and an argument; *out* the value and its first two derivatives; *never* a jump of any of them; *source* the quintic
//! that goes from rest to rest with the least jerk: Flash and Hogan, Journal of Neuroscience 5 (1985).

use libm::{cos, sin};

/// One sinusoid: amplitude * sin(rate * θ + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Unit of the signal.
    pub amplitude: f64,
    /// Radians for each unit of the argument: rad/s for signals in time, a whole number for closed shapes.
    pub rate: f64,
    /// rad.
    pub phase: f64,
}

/// Value and first two derivatives of a sum of tones, summed in their order.
pub fn sum(tones: &[Tone], argument: f64) -> [f64; 3] {
    tones.iter().fold([0.0; 3], |[value, first, second], tone| {
        let angle = tone.rate * argument + tone.phase;
        let (s, c) = (tone.amplitude * sin(angle), tone.amplitude * cos(angle));
        [value + s, first + tone.rate * c, second - tone.rate * tone.rate * s]
    })
}

/// Quintic step from 0 to 1 over 0..=1, flat outside, and its first two derivatives; all three are continuous.
pub fn smooth_step(x: f64) -> [f64; 3] {
    if x <= 0.0 {
        return [0.0; 3];
    }
    if x >= 1.0 {
        return [1.0, 0.0, 0.0];
    }
    [x * x * x * (10.0 - x * (15.0 - 6.0 * x)), 30.0 * x * x * (1.0 - x) * (1.0 - x), 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)]
}

/// Integral of [`smooth_step`] from 0 to x in 0..=1; 1/2 at 1.
pub(crate) fn smooth_step_integral(x: f64) -> f64 {
    x * x * x * x * (2.5 - x * (3.0 - x))
}

/// Window that rises smoothly over `fade` seconds, stays at 1 and falls in the same way, with its first two derivatives.
pub(crate) fn window(seconds: f64, duration: f64, fade: f64) -> [f64; 3] {
    let [up, up1, up2] = smooth_step(seconds / fade);
    let [down, down1, down2] = smooth_step((duration - seconds) / fade);
    product([up, up1 / fade, up2 / (fade * fade)], [down, -down1 / fade, down2 / (fade * fade)])
}

/// Product of two functions given by value and first two derivatives.
pub(crate) fn product(f: [f64; 3], g: [f64; 3]) -> [f64; 3] {
    [f[0] * g[0], f[1] * g[0] + f[0] * g[1], f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_is_flat_at_both_ends_and_its_derivatives_fit() {
        for time in [0.0, 10.0] {
            assert_eq!(window(time, 10.0, 2.0).map(f64::abs), [0.0; 3]);
        }
        assert_eq!(window(5.0, 10.0, 2.0), [1.0, 0.0, 0.0]);
        for time in [0.3, 1.1, 8.4, 9.9] {
            let (before, here, after) = (window(time - 1e-5, 10.0, 2.0), window(time, 10.0, 2.0), window(time + 1e-5, 10.0, 2.0));
            assert!(((after[0] - before[0]) / 2e-5 - here[1]).abs() < 1e-8);
            assert!(((after[1] - before[1]) / 2e-5 - here[2]).abs() < 1e-8);
        }
        assert!((smooth_step_integral(1.0) - 0.5).abs() < 1e-15);
    }
}
