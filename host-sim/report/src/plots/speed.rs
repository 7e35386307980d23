//! How the reduction holds up when the same strokes are flown faster.

use super::axes::{Labels, axes, curve};
use super::canvas::{panel, units};
use super::curve::{Point, shown, span, widened};
use super::rows::ink;
use crate::{cases::Case, method::Method};
use maud::Markup;
use plotters::prelude::*;

const SIZE: (u32, u32) = (340, 230);
const SHOWN: [Method; 4] = [Method::FeedforwardFeedback, Method::Ridge, Method::NetInt8, Method::FullInt8];

/// The methods that this plot shows, for its legend.
pub(crate) const fn methods_by_speed() -> [Method; 4] {
    SHOWN
}

/// Mean reduction against the speed factor; `cases` differ in speed only. `None` with fewer than two speeds.
pub(crate) fn reduction_by_speed(cases: &[&Case<'_>]) -> anyhow::Result<Option<Markup>> {
    let lines: Vec<(Method, Vec<Point>)> = SHOWN
        .into_iter()
        .map(|method| {
            let rows = cases.iter().filter_map(|case| case.row(method));
            let mut points: Vec<Point> = rows.map(|row| (row.speed, row.reduction_mean)).collect();
            points.retain(|point| shown(point.0) && shown(point.1));
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            (method, points)
        })
        .collect();
    let all = || lines.iter().flat_map(|(_, points)| points);
    let (Some(first), Some(speed), Some(value)) =
        (cases.first(), span(all().map(|point| point.0)), span(all().map(|point| point.1)))
    else {
        return Ok(None);
    };
    if speed.end <= speed.start {
        return Ok(None);
    }
    let title = format!("Mean error reduction by speed, {} {}, {}", first.vehicle, first.gains, first.condition);
    let description = "Mean reduction of the error in per cent against the factor on the drawn speed.";
    panel(SIZE, &title, description, |area| {
        let labels = Labels { x: "speed factor", y: "mean reduction [%]" };
        let floor = widened(&value, 0.05, 5.0).start;
        let mut chart = axes(area, widened(&speed, 0.06, 0.1), floor..widened(&value, 0.0, 1.0).end.max(100.0), &labels)?;
        for (method, points) in &lines {
            curve(&mut chart, points, ink(*method).line(1.8))?;
            let dots = points.iter().map(|point| Circle::new(*point, units(3.2), ink(*method).fill()));
            chart.draw_series(dots)?;
        }
        Ok(())
    })
    .map(Some)
}
