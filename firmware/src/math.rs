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

/// `x` within `low..=high`; unlike `f32::clamp` without a panic for bounds in the wrong order. NaN does not pass: it becomes the
/// number within the bounds that is nearest to 0, and 0 if they are no bounds either.
#[inline(always)]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x <= high {
        x
    } else if x > high {
        high
    } else if low > 0.0 {
        low
    } else if high < 0.0 {
        high
    } else {
        0.0
    }
}

/// `x` if it is finite, else 0: what an edge does with a value that cannot be trusted.
#[inline(always)]
pub fn finite_or_zero(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// Whether all are finite numbers: what is none is no zero when it is multiplied by zero, and stays so in a sum. Two instructions
/// a number.
#[inline]
pub fn all_finite(values: &[f32]) -> bool {
    values.iter().fold(0.0, |sum, value| sum + value * 0.0) == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nothing_but_a_number_within_the_bounds_passes_a_clamp(x: u32, low: u32, high: u32, like in 0..4) {
            // Every bit pattern, and those of which at least one is no number or an end.
            let [mut x, mut low, mut high] = [x, low, high].map(f32::from_bits);
            match like {
                0 => x = f32::NAN,
                1 => low = f32::NAN,
                2 => high = f32::NAN,
                _ => {}
            }
            let found = clamp(x, low, high);
            prop_assert!(!found.is_nan(), "{x} in {low}..={high}");
            if low <= high {
                prop_assert!(low <= found && found <= high, "{x} in {low}..={high}: {found}");
                if low <= x && x <= high {
                    prop_assert_eq!(found.to_bits(), x.to_bits());
                }
            }
        }
    }

    proptest! {
        #[test]
        fn one_that_is_not_finite_is_found_among_all(bits in prop::collection::vec(any::<u32>(), 0..20), like in 0..4usize) {
            let mut values: Vec<f32> = bits.into_iter().map(f32::from_bits).collect();
            values.extend([f32::NAN, f32::INFINITY, f32::NEG_INFINITY].get(like));
            prop_assert_eq!(all_finite(&values), values.iter().all(|value| value.is_finite()));
            values.retain(|value| value.is_finite());
            prop_assert!(all_finite(&values));
        }
    }

    #[test]
    fn what_is_no_number_becomes_the_nearest_to_zero() {
        assert_eq!([clamp(f32::NAN, -1.0, 1.0), clamp(f32::NAN, 2.0, 3.0), clamp(f32::NAN, -3.0, -2.0)], [0.0, 2.0, -2.0]);
    }

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
