//! Averages flights into rows of the table.
//!
//! *in* the score of each flight; *out* a [`Row`] for each cell; *never* a mean that hides a crash.

use crate::results::{PerFlight, Row};

/// Averages flights into rows, in order of first appearance: mean RMS, mean and smallest reduction.
///
/// A cell with a flight whose number is not finite is not finite either: a crash must not vanish in a mean.
#[must_use]
pub fn summarise(flights: &[PerFlight]) -> Vec<Row> {
    let mut groups: Vec<Vec<&PerFlight>> = Vec::new();
    for flight in flights {
        let found = groups.iter_mut().find(|group| {
            let first = group[0];
            first.method == flight.method
                && first.vehicle == flight.vehicle
                && first.gains == flight.gains
                && first.condition == flight.condition
                && first.speed.to_bits() == flight.speed.to_bits()
                && first.seed == flight.seed
        });
        match found {
            Some(group) => group.push(flight),
            None => groups.push(vec![flight]),
        }
    }
    groups.iter().map(|group| row_of(group)).collect()
}

fn row_of(group: &[&PerFlight]) -> Row {
    let count = group.len() as f64;
    let least = |worst: f64, value: f64| {
        if worst.is_nan() || value.is_nan() { f64::NAN } else { worst.min(value) }
    };
    let first = group[0];
    Row {
        vehicle: first.vehicle.clone(),
        gains: first.gains.clone(),
        condition: first.condition.clone(),
        speed: first.speed,
        method: first.method,
        rms_cm_mean: group.iter().map(|flight| flight.rms_cm).sum::<f64>() / count,
        reduction_mean: group.iter().map(|flight| flight.reduction).sum::<f64>() / count,
        reduction_worst: group.iter().map(|flight| flight.reduction).fold(f64::INFINITY, least),
        seed: first.seed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fixture, method::Method};

    #[test]
    fn rows_are_means_and_worst_of_their_flights() {
        let flights: Vec<PerFlight> = [(2.0, 80.0), (4.0, 50.0)]
            .into_iter()
            .map(|(rms_cm, reduction)| fixture::flight(Method::Ridge, "stroke", rms_cm, reduction))
            .collect();
        let rows = summarise(&flights);
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].rms_cm_mean, rows[0].reduction_mean, rows[0].reduction_worst), (3.0, 65.0, 50.0));
    }

    #[test]
    fn one_crash_makes_the_whole_cell_not_a_number() {
        let flights = [fixture::flight(Method::NetF32, "a", f64::NAN, f64::NAN), fixture::flight(Method::NetF32, "b", 1.0, 90.0)];
        let row = &summarise(&flights)[0];
        assert!(row.rms_cm_mean.is_nan() && row.reduction_mean.is_nan() && row.reduction_worst.is_nan());
    }
}
