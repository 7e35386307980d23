//! Numbers as text: units, sensible digits, and `n/a` for what is not finite.

/// Text for a number which is not finite, or for a cell without a flight.
pub(super) const NOT_AVAILABLE: &str = "n/a";

/// Fixed decimals without a negative zero.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return NOT_AVAILABLE.to_owned();
    }
    // Hundreds of digits say less than their number.
    if value.abs() >= 1e15 {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        _ => text,
    }
}

/// Three significant digits for errors in centimetres, never finer than 0.1 mm.
pub(super) fn centimetres(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => NOT_AVAILABLE.to_owned(),
        size if size >= 99.95 => fixed(value, 0),
        size if size >= 9.995 => fixed(value, 1),
        _ => fixed(value, 2),
    }
}

/// A centimetre value with its unit; `n/a` has none.
pub(super) fn centimetres_with_unit(value: f64) -> String {
    if value.is_finite() { format!("{} cm", centimetres(value)) } else { NOT_AVAILABLE.to_owned() }
}

/// Per cent with one decimal, without the sign `%`.
pub(super) fn percent(value: f64) -> String {
    fixed(value, 1)
}

/// Mean and worst reduction, `98.5/95.0`.
pub(super) fn mean_and_worst(mean: f64, worst: f64, separator: &str) -> String {
    if !mean.is_finite() && !worst.is_finite() {
        return NOT_AVAILABLE.to_owned();
    }
    format!("{}{separator}{}", percent(mean), percent(worst))
}

/// Speed factor, `1.35x`.
pub(super) fn speed(value: f64) -> String {
    if value.is_finite() { format!("{value}x") } else { NOT_AVAILABLE.to_owned() }
}

/// Whole numbers with a thin gap every three digits.
pub(super) fn thousands(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A hyphen before a digit becomes the minus sign of typography.
pub(super) fn with_minus_sign(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_size() {
        let shown: Vec<String> = [0.184, 1.2, 9.999, 11.23, 217.4, -0.001, f64::INFINITY].map(centimetres).into();
        assert_eq!(shown, ["0.18", "1.20", "10.0", "11.2", "217", "0.00", "n/a"]);
        assert_eq!(percent(-217.44), "-217.4");
        assert_eq!(mean_and_worst(98.52, 95.0, "/"), "98.5/95.0");
        assert_eq!(mean_and_worst(f64::NAN, f64::NAN, "/"), "n/a");
        assert_eq!(thousands(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!((speed(1.0), speed(1.35)), ("1x".to_owned(), "1.35x".to_owned()));
    }
}
