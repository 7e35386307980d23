//! Numbers outside of their ranges are refused by name.
//!
//! *in* numbers of a model file and the [`Range`] that they must be in; *out* nothing, or the refusal; *never* NaN, which is in
//! no range; *source* [`super::ranges`].

use super::{Floats, Refusal, ranges::Range};

impl Range {
    /// Refuses what does not hold.
    pub(crate) fn demand(&self, holds: bool) -> Result<(), Refusal> {
        if holds { Ok(()) } else { Err(Refusal::Value { what: self.what }) }
    }

    /// Refuses a number that is outside.
    pub(crate) fn check(&self, value: f32) -> Result<(), Refusal> {
        self.demand(self.holds(value))
    }

    /// Refuses numbers of which one is outside.
    pub(crate) fn all(&self, values: Floats<'_>) -> Result<(), Refusal> {
        self.demand(values.iter().all(|value| self.holds(value)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::ranges::{RANGES, named};

    #[test]
    fn every_range_has_a_name_of_its_own_by_which_its_refusal_finds_it() {
        for range in RANGES {
            assert_eq!(named(range.what), Some(&range), "{}", range.what);
            assert!(range.least.is_finite() && range.most.is_finite() && range.least < range.most);
            for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let words = range.check(wrong).unwrap_err().to_string();
                assert!(words.contains(range.what) && words.contains(&range.most.to_string()), "{words}");
            }
            assert!([range.least, range.most].iter().all(|value| range.check(*value).is_ok()));
        }
    }
}
