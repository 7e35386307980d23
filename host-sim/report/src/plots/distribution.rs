//! The error of every single flight, method by method, on a logarithmic scale.

use super::canvas::{Ink, panel, units};
use super::curve::span;
use super::rows::{Rows, ink};
use crate::{cases::Case, method::Method, notation::centimetres, results::PerFlight};
use maud::Markup;
use plotters::prelude::*;

/// One dot for each flight, a bar at the median, a ring round the worst; `None` without a positive error.
pub(crate) fn error_distribution(case: &Case<'_>, methods: &[Method], flights: &[PerFlight]) -> anyhow::Result<Option<Markup>> {
    let mut lines: Vec<(Method, usize, Vec<f64>)> = Vec::new();
    for method in methods {
        let mut errors: Vec<f64> = case.flights(flights, *method).iter().map(|flight| flight.rms_cm).collect();
        let flown = errors.len();
        errors.retain(|error| error.is_finite() && *error > 0.0);
        errors.sort_by(f64::total_cmp);
        if flown > 0 {
            lines.push((*method, flown, errors));
        }
    }
    let Some(span) = span(lines.iter().flat_map(|(_, _, errors)| errors).map(|error| error.log10())) else {
        return Ok(None);
    };
    // Whole thirds of a decade: 1, 2, 5, 10, …
    let (low, high) = ((span.start * 3.0 - 0.3).floor() / 3.0, (span.end * 3.0 + 0.3).ceil() / 3.0);
    let chart = Rows::new(low..high, lines.len());
    let title = format!("Error of each flight by method, {} {}, {}", case.vehicle, case.gains, case.condition);
    let description = "One dot for each flight on a logarithmic scale in centimetres; bar: median; ring: worst flight.";
    panel(chart.size(), &title, description, |area| {
        chart.scale(area, &decades(low, high), "RMS error of a flight [cm], log scale")?;
        for (line, (method, flown, errors)) in lines.iter().enumerate() {
            chart.names(area, line, *method, &figure(*flown, errors))?;
            let Some(worst) = errors.last() else {
                continue;
            };
            let colour = ink(*method);
            for (i, error) in errors.iter().enumerate() {
                // Neighbours in size are moved apart in a fixed pattern.
                let offset = [0.0, 0.22, -0.22, 0.11, -0.11][i % 5];
                let place = (chart.x(error.log10()), chart.y(line, offset));
                area.draw(&Circle::new(place, units(1.9), colour.colour().mix(0.55).filled()))?;
            }
            let middle = 0.5 * (errors[(errors.len() - 1) / 2] + errors[errors.len() / 2]);
            let median = chart.x(middle.log10());
            let bar = vec![(median, chart.y(line, -0.36)), (median, chart.y(line, 0.36))];
            area.draw(&PathElement::new(bar, Ink::Text.line(1.8)))?;
            let offset = [0.0, 0.22, -0.22, 0.11, -0.11][(errors.len() - 1) % 5];
            let place = (chart.x(worst.log10()), chart.y(line, offset));
            area.draw(&Circle::new(place, units(4.0), colour.line(1.5)))?;
        }
        Ok(())
    })
    .map(Some)
}

/// The worst of the sorted errors, or how many of the flights have none that can be drawn.
fn figure(flown: usize, errors: &[f64]) -> String {
    match errors.last() {
        Some(worst) if errors.len() == flown => format!("{} cm", centimetres(*worst)),
        _ => format!("{} of {flown} n/a", flown - errors.len()),
    }
}

/// Ticks at 1, 2 and 5 times the powers of ten (powers alone when there are many), between two logarithms.
fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    let factors: &[f64] = if high - low > 2.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let mut ticks = Vec::new();
    for power in low.floor() as i32..=high.ceil() as i32 {
        for factor in factors {
            let value = factor * 10_f64.powi(power);
            let place = value.log10();
            if (low - 1e-9..=high + 1e-9).contains(&place) {
                ticks.push((place, value_label(value)));
            }
        }
    }
    ticks
}

fn value_label(value: f64) -> String {
    let decimals = (-value.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crashed_flight_is_counted_not_dropped() {
        assert_eq!(figure(2, &[0.5, 4.0]), "4.00 cm");
        assert_eq!(figure(30, &[0.5; 29]), "1 of 30 n/a");
        assert_eq!(figure(3, &[]), "3 of 3 n/a");
    }

    #[test]
    fn ticks_are_round_numbers() {
        let labels = |low: f64, high: f64| decades(low, high).into_iter().map(|tick| tick.1).collect::<Vec<_>>().join(" ");
        assert_eq!(labels(-1.0, 1.0), "0.1 0.2 0.5 1 2 5 10");
        assert_eq!(labels(-2.0, 2.0), "0.01 0.1 1 10 100");
    }
}
