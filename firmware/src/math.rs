//! Elementary functions with the same bits on every machine.
//!
//! *in* a finite f32; *out* its function; *never* a method of `f32` (std on the host, something else on the
//! target); *source* `libm`, and `micromath` for the attitude angles that only the network reads.

/// Square root, correctly rounded.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Sine and cosine of an angle in rad. Calculates in f64, which the microcontroller does in software; a function of its own, so that a
/// binary shows where that is reached from.
#[inline(never)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
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

/// Nearest integer, halves away from zero, saturated to ±`limit`; NaN gives 0.
#[inline(always)]
pub fn round_to_i32(x: f32, limit: i32) -> i32 {
    let rounded = (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i32;
    rounded.clamp(-limit, limit)
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
    fn sine_and_cosine_together_have_the_bits_of_each_alone() {
        for bits in (0..=u32::MAX).step_by(104_729) {
            let x = f32::from_bits(bits);
            if x.is_finite() {
                let (sine, cosine) = sin_cos(x);
                assert_eq!((sine.to_bits(), cosine.to_bits()), (libm::sinf(x).to_bits(), libm::cosf(x).to_bits()), "{x:e}");
            }
        }
    }

    #[test]
    fn rounding_is_symmetric_and_saturates() {
        assert_eq!(round_to_i32(2.5, 100), 3);
        assert_eq!(round_to_i32(-2.5, 100), -3);
        assert_eq!(round_to_i32(1e30, 32_767), 32_767);
        assert_eq!(round_to_i32(f32::NAN, 32_767), 0);
    }
}
