//! Mean and worst reduction of every method under one condition.

use super::canvas::{Ink, panel, units};
use super::rows::{Rows, ink};
use crate::{
    cases::Case,
    method::Method,
    notation::{mean_and_worst, with_minus_sign},
};
use maud::Markup;
use plotters::prelude::*;

/// Labelled reductions, in per cent; what lies outside is drawn at the edge, with its figure beside it.
const TICKS: [f64; 7] = [0.0, 50.0, 80.0, 90.0, 95.0, 98.0, 99.0];
/// The right end of the scale, in per cent.
const HIGHEST: f64 = 99.5;

/// Place on a scale that is logarithmic in the error that is left: 90 and 99 % are as far apart as 0 and 90 %.
fn place(reduction: f64) -> f64 {
    let remaining = 1.0 - reduction.min(HIGHEST) / 100.0;
    -remaining.log10()
}

/// A line from the worst flight to the mean for each method; `None` when the case has no method but the baseline.
pub(crate) fn reduction_by_method(case: &Case<'_>, methods: &[Method]) -> anyhow::Result<Option<Markup>> {
    let rows: Vec<_> =
        methods.iter().filter(|method| **method != Method::Baseline).filter_map(|method| case.row(*method)).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let chart = Rows::new(place(TICKS[0])..place(HIGHEST), rows.len());
    let title = format!("Error reduction by method, {} {}, {}", case.vehicle, case.gains, case.condition);
    let description = "For each method a line from the worst flight (ring) to the mean of all flights (dot), in per cent.";
    panel(chart.size(), &title, description, |area| {
        let ticks = TICKS.map(|tick| (place(tick), format!("{tick:.0}")));
        chart.scale(area, &ticks, "reduction of the error [%], log scale")?;
        for (line, row) in rows.iter().enumerate() {
            let figure = with_minus_sign(&mean_and_worst(row.reduction_mean, row.reduction_worst, " / "));
            chart.names(area, line, row.method, &figure)?;
            let (colour, y) = (ink(row.method), chart.y(line, 0.0));
            if row.reduction_mean.is_finite() && row.reduction_worst.is_finite() {
                let ends = vec![(chart.x(place(row.reduction_worst)), y), (chart.x(place(row.reduction_mean)), y)];
                area.draw(&PathElement::new(ends, colour.line(2.0)))?;
            }
            if row.reduction_worst.is_finite() {
                let worst = (chart.x(place(row.reduction_worst)), y);
                area.draw(&Circle::new(worst, units(4.0), Ink::Paper.fill()))?;
                area.draw(&Circle::new(worst, units(4.0), colour.line(1.6)))?;
            }
            if row.reduction_mean.is_finite() {
                area.draw(&Circle::new((chart.x(place(row.reduction_mean)), y), units(4.5), colour.fill()))?;
            }
        }
        Ok(())
    })
    .map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_logarithmic_in_what_is_left() {
        assert!((place(99.0) - 2.0 * place(90.0)).abs() < 1e-9);
        assert!(place(-50.0) < 0.0 && place(100.0).is_finite());
    }
}
