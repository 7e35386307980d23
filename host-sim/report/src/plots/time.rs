//! One flight over time: position, error, and what the add-on asks the loop for.

use super::axes::{Labels, axes, curve};
use super::canvas::{Ink, panel};
use super::curve::{Point, span, widened};
use crate::{cases::Scene, results::FlightTrace};
use maud::Markup;
use plotters::prelude::Rectangle;
use std::ops::Range;

const AXES: [&str; 3] = ["x", "y", "z"];
const NARROW: (u32, u32) = (340, 230);
const WIDE: (u32, u32) = (520, 270);

/// A curve with its colour and width in pixels.
struct Line {
    points: Vec<Point>,
    ink: Ink,
    pixels: f64,
}

/// Desired and flown position, one panel for each axis.
pub(crate) fn position_over_time(scene: &Scene<'_>) -> anyhow::Result<Vec<Markup>> {
    let first = scene.first();
    let mut panels = Vec::new();
    for (axis, name) in AXES.into_iter().enumerate() {
        let mut lines = vec![Line { points: over_time(first, &first.desired, axis), ink: Ink::Desired, pixels: 5.0 }];
        for (trace, ink) in [(scene.baseline(), Ink::Baseline), (scene.add_on(), Ink::BothLanes)] {
            lines.extend(trace.map(|trace| Line { points: over_time(trace, &trace.flown, axis), ink, pixels: 1.4 }));
        }
        let title = format!("Position along {name} over time, {}", first.trajectory);
        let description = "Desired position, the baseline's and that with the add-on. Scored part shaded.";
        panels.extend(plot(NARROW, &title, description, &format!("{name} [m]"), first, 0.1, &lines)?);
    }
    Ok(panels)
}

/// Distance from the desired position: both flights on one scale, then the add-on alone, enlarged.
pub(crate) fn error_over_time(scene: &Scene<'_>) -> anyhow::Result<Vec<Markup>> {
    let first = scene.first();
    let mut lines: Vec<Line> = [(scene.baseline(), Ink::Baseline), (scene.add_on(), Ink::BothLanes)]
        .into_iter()
        .filter_map(|(trace, ink)| trace.map(|trace| Line { points: error_cm(trace), ink, pixels: 1.4 }))
        .collect();
    let title = format!("Position error over time, {}", first.trajectory);
    let mut panels = Vec::new();
    let both = "Distance from the desired position: baseline and with the add-on, on one scale.";
    panels.extend(plot(WIDE, &title, both, "error [cm]", first, 0.05, &lines)?);
    if scene.baseline().is_some() && scene.add_on().is_some() {
        let enlarged = "Distance from the desired position with the add-on alone, on an enlarged scale.";
        panels.extend(plot(WIDE, &format!("{title}, enlarged"), enlarged, "error [cm]", first, 0.05, &lines.split_off(1))?);
    }
    Ok(panels)
}

/// Reference less desired position of the flight with the add-on, one panel for each axis.
pub(crate) fn correction_over_time(scene: &Scene<'_>) -> anyhow::Result<Vec<Markup>> {
    let Some(trace) = scene.add_on() else {
        return Ok(Vec::new());
    };
    let mut panels = Vec::new();
    for (axis, name) in AXES.into_iter().enumerate() {
        let desired = trace.desired.iter().map(|point| point[axis]);
        let points = desired
            .zip(&trace.reference)
            .enumerate()
            .map(|(i, (desired, reference))| (i as f64 / trace.rate_hz, 100.0 * (reference[axis] - desired)))
            .collect();
        let title = format!("Correction of the reference along {name} over time, {}", trace.trajectory);
        let description = "Position reference given to the loop, less the desired position.";
        let label = format!("{name} ref. \u{2212} desired [cm]");
        let lines = [Line { points, ink: Ink::BothLanes, pixels: 1.4 }];
        panels.extend(plot(NARROW, &title, description, &label, trace, 1.0, &lines)?);
    }
    Ok(panels)
}

fn over_time(trace: &FlightTrace, positions: &[[f64; 3]], axis: usize) -> Vec<Point> {
    positions.iter().enumerate().map(|(i, position)| (i as f64 / trace.rate_hz, position[axis])).collect()
}

fn error_cm(trace: &FlightTrace) -> Vec<Point> {
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let distances = trace.desired.iter().zip(&trace.flown).map(distance);
    distances.enumerate().map(|(i, metres)| (i as f64 / trace.rate_hz, 100.0 * metres)).collect()
}

/// `least` is the smallest height of the vertical axis, so that noise about a constant does not fill the panel.
fn plot(
    size: (u32, u32),
    title: &str,
    description: &str,
    quantity: &str,
    trace: &FlightTrace,
    least: f64,
    lines: &[Line],
) -> anyhow::Result<Option<Markup>> {
    let all = || lines.iter().flat_map(|line| &line.points);
    let (Some(time), Some(value)) = (span(all().map(|point| point.0)), span(all().map(|point| point.1))) else {
        return Ok(None);
    };
    let mut value = widened(&value, 0.06, least);
    if quantity.starts_with("error") {
        value = 0.0..value.end.max(least);
    }
    let time = time.start..widened(&time, 0.0, 1e-3).end;
    let scored = shaded(trace, &time);
    panel(size, title, description, |area| {
        let mut chart = axes(area, time, value.clone(), &Labels { x: "time [s]", y: quantity })?;
        let corners = [(scored.start, value.start), (scored.end, value.end)];
        chart.draw_series([Rectangle::new(corners, Ink::Shade.fill())])?;
        for line in lines {
            curve(&mut chart, &line.points, line.ink.line(line.pixels))?;
        }
        Ok(())
    })
    .map(Some)
}

/// The scored part in seconds, inside the axis.
fn shaded(trace: &FlightTrace, time: &Range<f64>) -> Range<f64> {
    let seconds = |sample: usize| (sample as f64 / trace.rate_hz).clamp(time.start, time.end);
    seconds(trace.scored.start)..seconds(trace.scored.end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn a_flight_without_numbers_or_rate_gives_no_plot_and_no_panic() {
        let mut results = fixture::full();
        results.flights.truncate(2);
        for trace in &mut results.flights {
            trace.rate_hz = 0.0;
            trace.flown.fill([f64::NAN; 3]);
        }
        let scenes = Scene::group(&results.flights);
        assert!(error_over_time(&scenes[0]).unwrap().is_empty());
        position_over_time(&scenes[0]).unwrap();
        correction_over_time(&scenes[0]).unwrap();
    }

    #[test]
    fn the_error_is_the_distance_in_centimetres() {
        let mut trace = fixture::full().flights.swap_remove(0);
        trace.desired = vec![[0.0; 3]];
        trace.flown = vec![[0.03, 0.0, 0.04]];
        assert_eq!(error_cm(&trace), [(0.0, 5.0)]);
    }
}
