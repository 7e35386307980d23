//! Flights in which the loop broke down teach nothing of the loop that shall be corrected.
//!
//! *in* flight logs of the baseline; *out* the sound ones, and the names of the others; *never* fewer than half of the logs.
//! Where motors saturate a quadrotor may tumble, and what it flies then is no answer to its reference.

use impromptu_sim::flight_log::FlightLog;

/// Largest tracking error over the median log's at which a log counts as broken down. Saturated but recovered flights reach 3
/// times.
const FACTOR: f64 = 4.0;

/// A log that is left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Breakdown {
    /// Name of the log.
    pub name: String,
    /// Its largest distance between measured and desired position, m; infinite if a number was lost.
    pub largest_error: f64,
}

/// Splits logs into sound ones and those in which the loop broke down.
pub fn sound(logs: &[FlightLog]) -> (Vec<&FlightLog>, Vec<Breakdown>) {
    let errors: Vec<f64> = logs.iter().map(largest_error).collect();
    let bound = largest_sound_error(&errors);
    let (mut kept, mut broken) = (Vec::new(), Vec::new());
    for (log, largest_error) in logs.iter().zip(errors) {
        if largest_error <= bound {
            kept.push(log);
        } else {
            broken.push(Breakdown { name: log.name.clone(), largest_error });
        }
    }
    (kept, broken)
}

/// Largest tracking error at which a log is sound, from those of all logs.
pub fn largest_sound_error(errors: &[f64]) -> f64 {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    // The upper of the two middle ones: half of the logs at least are kept.
    sorted.get(sorted.len() / 2).map_or(0.0, |median| FACTOR * median)
}

fn largest_error(log: &FlightLog) -> f64 {
    let squares = log.rows.iter().map(|row| {
        let axes = row.measured_position.iter().zip(&row.desired.position);
        axes.map(|(measured, desired)| (measured - desired).powi(2)).sum::<f64>()
    });
    // `f64::max` would pass over what is no number.
    squares.fold(0.0, |largest, square| if square <= largest { largest } else { square_or_infinite(square) }).sqrt()
}

fn square_or_infinite(square: f64) -> f64 {
    if square.is_nan() { f64::INFINITY } else { square }
}

#[cfg(test)]
mod tests {
    use super::*;
    use impromptu_sim::flight_log::LogRow;

    fn log(name: &str, error: f64) -> FlightLog {
        let row = |x| LogRow { measured_position: [x, 0.0, 0.0], ..LogRow::default() };
        FlightLog { name: name.into(), rate_hz: 100.0, scored: 0..3, rows: vec![row(0.0), row(error), row(0.1)] }
    }

    #[test]
    fn a_tumble_is_left_out_and_named() {
        let logs = [log("a", 0.4), log("b", 1.3), log("c", 40.0), log("d", f64::NAN), log("e", 0.5)];
        let (kept, broken) = sound(&logs);
        assert_eq!(kept.iter().map(|log| log.name.as_str()).collect::<Vec<_>>(), ["a", "b", "e"]);
        let named: Vec<(&str, f64)> = broken.iter().map(|log| (log.name.as_str(), log.largest_error)).collect();
        assert_eq!(named, [("c", 40.0), ("d", f64::INFINITY)]);
    }

    #[test]
    fn half_of_the_logs_at_least_are_kept() {
        for count in 1..6 {
            let logs: Vec<FlightLog> = (0..count).map(|index| log("x", 10f64.powi(index))).collect();
            let (kept, broken) = sound(&logs);
            assert!(kept.len() * 2 >= logs.len() && kept.len() + broken.len() == logs.len());
        }
    }
}
