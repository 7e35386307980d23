//! Mean and worst reduction of every method under one condition.

use super::canvas::{Ink, panel, units};
use super::rows::{Rows, ink};
use crate::report::cases::Case;
use crate::report::method::Method;
use crate::report::notation::{mean_and_worst, with_minus_sign};
use maud::Markup;
use plotters::prelude::*;

/// Reductions below this are drawn at the edge; their figures stand beside them.
const LOWEST: f64 = 0.0;

/// A line from the worst flight to the mean for each method; `None` when the case has no method but the baseline.
pub(in crate::report) fn reduction_by_method(case: &Case<'_>, methods: &[Method]) -> anyhow::Result<Option<Markup>> {
    let rows: Vec<_> =
        methods.iter().filter(|method| **method != Method::Baseline).filter_map(|method| case.row(*method)).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let chart = Rows::new(LOWEST..100.0, rows.len());
    let title = format!("Error reduction by method, {} {}, {}", case.vehicle, case.gains, case.condition);
    let description = "For each method a line from the worst flight (ring) to the mean of all flights (dot), in per cent.";
    panel(chart.size(), &title, description, |area| {
        let ticks: Vec<(f64, String)> = [0.0, 25.0, 50.0, 75.0, 100.0].iter().map(|tick| (*tick, format!("{tick:.0}"))).collect();
        chart.scale(area, &ticks, "reduction of the error [%]")?;
        for (line, row) in rows.iter().enumerate() {
            let figure = with_minus_sign(&mean_and_worst(row.reduction_mean, row.reduction_worst, " / "));
            chart.names(area, line, row.method, &figure)?;
            let (colour, y) = (ink(row.method), chart.y(line, 0.0));
            if row.reduction_mean.is_finite() && row.reduction_worst.is_finite() {
                let ends = vec![(chart.x(row.reduction_worst), y), (chart.x(row.reduction_mean), y)];
                area.draw(&PathElement::new(ends, colour.line(2.0)))?;
            }
            if row.reduction_worst.is_finite() {
                let place = (chart.x(row.reduction_worst), y);
                area.draw(&Circle::new(place, units(4.0), Ink::Paper.fill()))?;
                area.draw(&Circle::new(place, units(4.0), colour.line(1.6)))?;
            }
            if row.reduction_mean.is_finite() {
                area.draw(&Circle::new((chart.x(row.reduction_mean), y), units(4.5), colour.fill()))?;
            }
        }
        Ok(())
    })
    .map(Some)
}
