//! Numbers for people.
//!
//! *in* a number of any size; *out* three digits of it; *never* a zero for what is none; *source* none.

/// Three digits that say something, of a number of any size.
pub fn digits(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let decimals = (2.0 - magnitude.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_size_has_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.419, "0.419"),
            (418.7, "419"),
            (2666.67, "2667"),
            (-0.00521, "-0.00521"),
            (4.19e-5, "4.19e-5"),
            (2e5, "2.00e5"),
        ] {
            assert_eq!(digits(value), text);
        }
    }
}
