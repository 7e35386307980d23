//! Elementary functions with the same bits on every machine.
//!
//! *in* a finite f32; *out* its function; *never* a method of `f32` (std on the host, something else on the
//! target); *source* `libm`, and `micromath` for the attitude angles that only the network reads.

/// Square root, correctly rounded.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Sine and cosine of an angle in rad, to 1.2e-7 for angles up to 8,192 rad, beyond which they only stay within ±1. In f32
/// throughout: `libm`'s reduce the angle in f64, which the Cortex-M4F computes in software (6 KB and 1,200 instructions).
///
/// *source* Cody and Waite's reduction and the polynomials of Moshier's Cephes (`sinf.c`).
pub fn sin_cos(x: f32) -> (f32, f32) {
    let magnitude = clamp(abs(x), 0.0, 8_192.0);
    // The octant, rounded up to an even one: the rest is within ±pi/4.
    let octant = (magnitude * (4.0 / core::f32::consts::PI)) as u32;
    let even = octant + octant % 2;
    let turns = even as f32;
    let rest = ((magnitude - turns * 0.785_156_25) - turns * 2.418_756_5e-4) - turns * 3.774_895e-8;
    let square = rest * rest;
    let sine = ((-1.951_529_6e-4 * square + 8.332_161e-3) * square - 1.666_665_5e-1) * square * rest + rest;
    let cosine = ((2.443_315_7e-5 * square - 1.388_731_6e-3) * square + 4.166_664_6e-2) * square * square - 0.5 * square + 1.0;
    let (sine, cosine) = match even % 8 {
        0 => (sine, cosine),
        2 => (cosine, -sine),
        4 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    (if x < 0.0 { -sine } else { sine }, cosine)
}

/// Hyperbolic tangent.
#[inline]
pub fn tanh(x: f32) -> f32 {
    libm::tanhf(x)
}

/// Absolute value.
#[inline(always)]
pub fn abs(x: f32) -> f32 {
    libm::fabsf(x)
}

/// `atan2` to 2.8e-3 rad by `micromath`: for network inputs only, where training sees the same approximation.
#[inline]
pub fn coarse_atan2(y: f32, x: f32) -> f32 {
    micromath::F32(y).atan2(micromath::F32(x)).0
}

/// `asin` by [`coarse_atan2`] and an exact square root: for network inputs only.
#[inline]
pub fn coarse_asin(x: f32) -> f32 {
    let x = clamp(x, -1.0, 1.0);
    coarse_atan2(x, sqrt((1.0 - x) * (1.0 + x)))
}

/// `x` within `low..=high`; unlike `f32::clamp` without a panic for bounds in the wrong order. NaN stays NaN.
#[inline(always)]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// `x` if it is finite, else 0: what an edge does with a value that cannot be trusted.
#[inline(always)]
pub fn finite_or_zero(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_angles_stay_within_the_documented_error() {
        for i in -100..=100 {
            let angle = i as f32 * 0.0157;
            let error = coarse_asin(angle.sin()) - angle;
            assert!(error.abs() < 4e-3, "asin at {angle}: {error}");
        }
    }

    #[test]
    fn sines_stay_within_the_documented_error() {
        for i in -81_920..=81_920 {
            let angle = i as f32 * 0.1;
            let (sine, cosine) = sin_cos(angle);
            let exact = f64::from(angle);
            let error = (f64::from(sine) - exact.sin()).abs().max((f64::from(cosine) - exact.cos()).abs());
            assert!(error < 1.2e-7, "{angle}: {error:e}");
        }
        for angle in [1e9, f32::INFINITY, f32::NAN, -1e30] {
            let (sine, cosine) = sin_cos(angle);
            assert!(sine.abs() <= 1.0 && cosine.abs() <= 1.0 || angle.is_nan(), "{angle}: {sine} {cosine}");
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }
}
