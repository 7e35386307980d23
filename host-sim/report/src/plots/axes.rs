//! Linear axes with a light grid and labelled units.

use super::canvas::{Area, Drawn, HPos, Ink, UNITS_PER_PIXEL, VPos, units};
use super::curve::{Point, polylines};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::ops::Range;

pub(super) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Room for the labels at the left and the bottom, in pixels.
pub(super) const LEFT: f64 = 50.0;
pub(super) const BOTTOM: f64 = 40.0;
const TOP: f64 = 8.0;
const RIGHT: f64 = 10.0;

/// What stands at the axes: quantity and unit.
pub(super) struct Labels<'a> {
    pub(super) x: &'a str,
    pub(super) y: &'a str,
}

/// The plotting area's size in pixels in a panel of the given size.
pub(super) fn inner_size((width, height): (u32, u32)) -> (f64, f64) {
    (f64::from(width) - LEFT - RIGHT, f64::from(height) - BOTTOM - TOP)
}

/// Draws axes over the whole of `area`; both ranges must be finite and not empty.
pub(super) fn axes<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    labels: &Labels<'_>,
) -> Result<Chart<'a, 'b>, DrawingAreaErrorKind<std::io::Error>> {
    let decimals = (decimals(&x), decimals(&y));
    let texts: [&dyn Fn(&f64) -> String; 2] =
        [&|value| super::super::notation::fixed(*value, decimals.0), &|value| super::super::notation::fixed(*value, decimals.1)];
    axes_with(area, x, y, labels, texts)
}

/// [`axes`] with the texts at the ticks of either axis.
pub(super) fn axes_with<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    labels: &Labels<'_>,
    texts: [&dyn Fn(&f64) -> String; 2],
) -> Result<Chart<'a, 'b>, DrawingAreaErrorKind<std::io::Error>> {
    let (width, height) = area.dim_in_pixel();
    let ticks = |units: u32, pixels: u32| (units / UNITS_PER_PIXEL.unsigned_abs() / pixels).max(3) as usize;
    let mut chart = ChartBuilder::on(area)
        .margin_top(units(TOP))
        .margin_right(units(RIGHT))
        .x_label_area_size(units(BOTTOM))
        .y_label_area_size(units(LEFT))
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_labels(ticks(width, 60))
        .y_labels(ticks(height, 38))
        .x_label_formatter(texts[0])
        .y_label_formatter(texts[1])
        .light_line_style(TRANSPARENT)
        .bold_line_style(Ink::Grid.line(1.0))
        .axis_style(Ink::Grid.line(1.0))
        .set_all_tick_mark_size(units(3.0))
        .label_style(Ink::Muted.text(HPos::Left, VPos::Center))
        .axis_desc_style(Ink::Muted.text(HPos::Left, VPos::Center))
        .x_desc(labels.x)
        .y_desc(labels.y)
        .draw()?;
    Ok(chart)
}

/// Decimals that tell neighbouring ticks apart.
pub(super) fn decimals(range: &Range<f64>) -> usize {
    let step = (range.end - range.start) / 4.0;
    (-step.log10().floor()).clamp(0.0, 4.0) as usize
}

/// Draws a curve, thinned to a fifth of a pixel.
pub(super) fn curve(chart: &mut Chart<'_, '_>, points: &[Point], style: ShapeStyle) -> Drawn {
    let (x, y) = (chart.x_range(), chart.y_range());
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let fifth = 0.2 * f64::from(UNITS_PER_PIXEL);
    let tolerance = ((x.end - x.start) / f64::from(width) * fifth, (y.end - y.start) / f64::from(height) * fifth);
    chart.draw_series(polylines(points, tolerance).into_iter().map(|line| PathElement::new(line, style)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_ticks_have_different_labels() {
        assert_eq!((decimals(&(0.0..400.0)), decimals(&(0.0..3.0)), decimals(&(0.0..0.1))), (0, 1, 2));
    }
}
