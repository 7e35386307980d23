//! Curves and dots over two axes: the figures of a study, kept as data.

use maud::Markup;
use plotters::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    axes::{Labels, axes_with, curve, decimals},
    canvas::{Ink, panel, units},
    curve::{Point, span, widened},
};
use crate::report::notation::fixed;

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

/// A figure as data: drawn in the page, whole in the JSON document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Section of the report.
    pub section: String,
    /// Name in the JSON document, in snake case.
    pub name: String,
    /// What is seen, in a sentence.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, at most six, each with a colour of its own.
    pub curves: Vec<Curve>,
}

/// An axis: quantity and unit, linear or logarithmic.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// Quantity and unit, as `error [cm]`.
    pub label: String,
    /// Logarithmic: what is not positive is a gap.
    pub logarithmic: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), logarithmic: false }
    }

    /// A logarithmic axis.
    pub fn logarithmic(label: &str) -> Self {
        Self { label: label.into(), logarithmic: true }
    }

    fn place(&self, value: f64) -> f64 {
        if !self.logarithmic {
            value
        } else if value > 0.0 {
            value.log10()
        } else {
            f64::NAN
        }
    }

    fn text(&self, value: f64, decimals: usize) -> String {
        if self.logarithmic { format!("{:.1e}", 10f64.powf(value)).replace(".0e", "e") } else { fixed(value, decimals) }
    }
}

/// How points are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// A line through them.
    #[default]
    Line,
    /// A dot each.
    Dots,
    /// Both.
    LineAndDots,
}

/// A curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// What it is, for the legend.
    pub label: String,
    /// How it is drawn.
    pub mark: Mark,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// A line.
    pub fn line(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { label: label.into(), mark: Mark::Line, points: points.into_iter().collect() }
    }

    /// Dots.
    pub fn dots(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::Dots, ..Self::line(label, points) }
    }

    /// A line with a dot at each point.
    pub fn line_and_dots(label: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { mark: Mark::LineAndDots, ..Self::line(label, points) }
    }
}

/// The style sheet's variable with the colour of a curve.
pub(in crate::report) fn colour_variable(curve: usize) -> &'static str {
    INKS[curve % INKS.len()].1
}

/// The figure as a panel; `None` without a finite point.
pub(in crate::report) fn draw(figure: &Figure) -> anyhow::Result<Option<Markup>> {
    let placed: Vec<Vec<Point>> = figure
        .curves
        .iter()
        .map(|curve| curve.points.iter().map(|&(x, y)| (figure.x.place(x), figure.y.place(y))).collect())
        .collect();
    let all = || placed.iter().flatten().filter(|point| point.0.is_finite() && point.1.is_finite());
    let (Some(x), Some(y)) = (span(all().map(|point| point.0)), span(all().map(|point| point.1))) else { return Ok(None) };
    let least = |span: &std::ops::Range<f64>| (span.start.abs().max(span.end.abs()) * 1e-3).max(1e-12);
    let (x, y) = (widened(&x, 0.02, least(&x)), widened(&y, 0.06, least(&y)));
    let digits = (decimals(&x), decimals(&y));
    let texts: [&dyn Fn(&f64) -> String; 2] =
        [&|value| figure.x.text(*value, digits.0), &|value| figure.y.text(*value, digits.1)];
    let description = figure.curves.iter().map(|curve| curve.label.as_str()).collect::<Vec<_>>().join("; ");
    panel(SIZE, &figure.title, &description, |area| {
        let mut chart = axes_with(area, x, y, &Labels { x: &figure.x.label, y: &figure.y.label }, texts)?;
        for ((data, points), (ink, _)) in figure.curves.iter().zip(&placed).zip(INKS.iter().cycle()) {
            if data.mark != Mark::Dots {
                curve(&mut chart, points, ink.line(1.5))?;
            }
            if data.mark != Mark::Line {
                let seen = points.iter().filter(|point| point.0.is_finite() && point.1.is_finite());
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
