//! Numbers for tests.
//!
//! *in* a seed; *out* numbers of -1..1; *never* others for the same seed; *source* Numerical Recipes, 7.1.

/// The next number.
pub(super) fn draw(seed: &mut u32) -> f32 {
    *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    (*seed >> 8) as f32 / 8_388_608.0 - 1.0
}
