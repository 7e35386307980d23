//! Seeds for what is random: training, validation and test never share one.
//!
//! *in* the seed of a run; *out* a seed for each purpose; *never* the same for two of them; *source* SplitMix64's finaliser.

/// What a random number is for: training, validation and test never share a seed.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Training flights.
    Training = 1,
    /// Flights with dither.
    Identification = 2,
    /// Validation strokes and flights.
    Validation = 3,
    /// Test strokes and flights.
    Test = 4,
}

/// The seed of a purpose (SplitMix64's finaliser).
pub fn derived(seed: u64, purpose: Purpose) -> u64 {
    let mut mixed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add((purpose as u64) << 56);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}
