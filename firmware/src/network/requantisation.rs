//! What makes a code of an accumulator.
//!
//! *in* a 32-bit accumulator and a multiplier; *out* their product's upper half, rounded; *never* an overflow; *source* Jacob et
//! al. 2018, section 2.2. What differs: no shift after it, so that one SMMULR does it.

/// Upper bits of accumulator × multiplier + 2³¹.
#[inline(always)]
pub fn requantise(accumulator: i32, multiplier: i32) -> i32 {
    let product = i64::from(accumulator) * i64::from(multiplier);
    (product.wrapping_add(1 << 31) >> 32) as i32
}
