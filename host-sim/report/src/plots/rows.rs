//! A chart with a named line for each method: label at the left, marks on one scale, a figure at the right.

use super::canvas::{Area, Drawn, HPos, Ink, VPos, units};
use crate::method::{Family, Method};
use plotters::prelude::*;
use std::ops::Range;

const LABELS: f64 = 104.0;
const FIGURES: f64 = 74.0;
const TOP: f64 = 6.0;
const BOTTOM: f64 = 40.0;
/// Height of one line in pixels.
pub(super) const LINE: f64 = 21.0;
/// Width of a panel in pixels.
pub(super) const WIDTH: u32 = 350;

/// Where values and methods lie on a panel.
pub(super) struct Rows {
    span: Range<f64>,
    count: usize,
}

impl Rows {
    /// `span` holds the values at both ends of the scale, in the unit in which marks are given.
    pub(super) const fn new(span: Range<f64>, count: usize) -> Self {
        Self { span, count }
    }

    pub(super) fn size(&self) -> (u32, u32) {
        (WIDTH, (TOP + BOTTOM + LINE * self.count as f64).round() as u32)
    }

    /// Horizontal place of a value, in drawing units; values outside are put on the edge.
    pub(super) fn x(&self, value: f64) -> i32 {
        let width = f64::from(WIDTH) - LABELS - FIGURES;
        let share = ((value - self.span.start) / (self.span.end - self.span.start)).clamp(0.0, 1.0);
        units(LABELS + share * width)
    }

    /// Vertical centre of a line, in drawing units; `offset` in lines.
    pub(super) fn y(&self, line: usize, offset: f64) -> i32 {
        units(TOP + LINE * (line as f64 + 0.5 + offset))
    }

    /// Grid lines with their labels, and the name of the scale.
    pub(super) fn scale(&self, area: &Area<'_>, ticks: &[(f64, String)], name: &str) -> Drawn {
        let bottom = units(TOP + LINE * self.count as f64);
        for (value, label) in ticks {
            let x = self.x(*value);
            area.draw(&PathElement::new(vec![(x, units(TOP)), (x, bottom)], Ink::Grid.line(1.0)))?;
            let place = (x, bottom + units(5.0));
            area.draw(&Text::new(label.clone(), place, Ink::Muted.text(HPos::Center, VPos::Top)))?;
        }
        let middle = (self.x(self.span.start) + self.x(self.span.end)) / 2;
        let place = (middle, bottom + units(22.0));
        area.draw(&Text::new(name.to_owned(), place, Ink::Muted.text(HPos::Center, VPos::Top)))
    }

    /// The method's name at the left of its line and a figure at the right.
    pub(super) fn names(&self, area: &Area<'_>, line: usize, method: Method, figure: &str) -> Drawn {
        let y = self.y(line, 0.0);
        let name = (units(LABELS - 10.0), y);
        area.draw(&Text::new(method.label(), name, Ink::Text.text(HPos::Right, VPos::Center)))?;
        let place = (units(f64::from(WIDTH) - 2.0), y);
        area.draw(&Text::new(figure.to_owned(), place, Ink::Muted.text(HPos::Right, VPos::Center)))
    }
}

/// The style sheet's class with a method's colour.
pub(crate) const fn colour_class(method: Method) -> &'static str {
    match method.family() {
        Family::Baseline => "baseline",
        Family::Comparison => "comparison",
        Family::Ridge => "ridge",
        Family::Network => "network",
        Family::BothLanes => "both-lanes",
        Family::Learned => "learned",
    }
}

/// The colour of a method's marks.
pub(super) const fn ink(method: Method) -> Ink {
    match method.family() {
        Family::Baseline => Ink::Baseline,
        Family::Comparison => Ink::Comparison,
        Family::Ridge => Ink::Ridge,
        Family::Network => Ink::Network,
        Family::BothLanes => Ink::BothLanes,
        Family::Learned => Ink::Learned,
    }
}
