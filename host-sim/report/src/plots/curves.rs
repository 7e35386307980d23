//! Curves and dots over two axes: the figures of a study, drawn.

use maud::Markup;
use plotters::prelude::*;

use super::{
    axes::{Labels, axes_with, curve, decimals},
    canvas::{Ink, panel, units},
    curve::{Point, shown, span, widened},
};
use crate::{
    figure::{Axis, Figure, Mark},
    notation::fixed,
};

const SIZE: (u32, u32) = (520, 300);
/// Colours of the curves in order, and the style sheet's variables for them.
const INKS: [(Ink, &str); 6] = [
    (Ink::BothLanes, "both-lanes"),
    (Ink::Baseline, "baseline"),
    (Ink::Network, "network"),
    (Ink::Ridge, "ridge"),
    (Ink::Comparison, "comparison"),
    (Ink::Text, "text"),
];

/// Where a value stands along an axis; what is not positive has no place on a logarithmic one.
fn place(axis: &Axis, value: f64) -> f64 {
    if !axis.logarithmic {
        value
    } else if value > 0.0 {
        value.log10()
    } else {
        f64::NAN
    }
}

fn text(axis: &Axis, value: f64, decimals: usize) -> String {
    let number = 10f64.powf(value);
    match number {
        _ if !axis.logarithmic => fixed(value, decimals),
        // Two digits, as a reader writes them.
        10.0..1e4 => format!("{number:.0}"),
        1.0..10.0 => format!("{number:.1}").trim_end_matches(".0").to_owned(),
        0.1..1.0 => format!("{number:.2}").trim_end_matches('0').to_owned(),
        _ => format!("{number:.1e}").replace(".0e", "e"),
    }
}

/// The style sheet's variable with the colour of a curve.
pub(crate) fn colour_variable(curve: usize) -> &'static str {
    INKS[curve % INKS.len()].1
}

/// The figure as a panel; `None` without a finite point.
pub(crate) fn draw(figure: &Figure) -> anyhow::Result<Option<Markup>> {
    let placed: Vec<Vec<Point>> = figure
        .curves
        .iter()
        .map(|curve| curve.points.iter().map(|&(x, y)| (place(&figure.x, x), place(&figure.y, y))).collect())
        .collect();
    let all = || placed.iter().flatten().filter(|point| shown(point.0) && shown(point.1));
    let (Some(x), Some(y)) = (span(all().map(|point| point.0)), span(all().map(|point| point.1))) else { return Ok(None) };
    let least = |span: &std::ops::Range<f64>| (span.start.abs().max(span.end.abs()) * 1e-3).max(1e-12);
    let (x, y) = (widened(&x, 0.02, least(&x)), widened(&y, 0.06, least(&y)));
    let digits = (decimals(&x), decimals(&y));
    let texts: [&dyn Fn(&f64) -> String; 2] =
        [&|value| text(&figure.x, *value, digits.0), &|value| text(&figure.y, *value, digits.1)];
    let description = figure.curves.iter().map(|curve| curve.label.as_str()).collect::<Vec<_>>().join("; ");
    panel(SIZE, &figure.title, &description, |area| {
        let mut chart = axes_with(area, x, y, &Labels { x: &figure.x.label, y: &figure.y.label }, texts)?;
        for ((data, points), (ink, _)) in figure.curves.iter().zip(&placed).zip(INKS.iter().cycle()) {
            if data.mark != Mark::Dots {
                curve(&mut chart, points, ink.line(1.5))?;
            }
            if data.mark != Mark::Line {
                let seen = points.iter().filter(|point| shown(point.0) && shown(point.1));
                chart.draw_series(seen.map(|&point| Circle::new(point, units(2.6), ink.fill())))?;
            }
        }
        Ok(())
    })
    .map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Curve;

    #[test]
    fn a_figure_without_finite_points_is_left_out_and_zeros_are_gaps_of_a_logarithmic_axis() {
        let mut figure = Figure {
            section: "rates".into(),
            name: "error_by_rate".into(),
            title: "Error by rate".into(),
            x: Axis::linear("rate [Hz]"),
            y: Axis::logarithmic("error [m]"),
            curves: vec![Curve::line_and_dots("a", [(1.0, 0.0), (2.0, f64::NAN)])],
        };
        assert!(draw(&figure).unwrap().is_none());
        figure.curves.push(Curve::dots("b", [(1.0, 1e-3), (2.0, 1e-3)]));
        assert!(draw(&figure).unwrap().unwrap().into_string().contains("1e-3"));
    }
}
