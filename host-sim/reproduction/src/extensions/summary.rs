//! Mean and worst, side by side.

use crate::siso::extensions::mean_and_worst;

/// Mean and worst of errors, each with what it adds to a number's name and what it is called.
pub(super) fn summary(
    errors: impl IntoIterator<Item = f64>,
    mean: &'static str,
    worst: &'static str,
) -> [(&'static str, &'static str, f64); 2] {
    let values = mean_and_worst(errors);
    [("", mean, values.0), ("_worst", worst, values.1)]
}
