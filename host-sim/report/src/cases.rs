//! Groups rows and flights by what was flown.

use crate::{
    method::Method,
    results::{FlightTrace, PerFlight, Row},
};

/// One line of the table: all methods under the same vehicle, gains, condition, speed and seed.
pub(super) struct Case<'a> {
    pub(super) vehicle: &'a str,
    pub(super) gains: &'a str,
    pub(super) condition: &'a str,
    pub(super) speed: f64,
    pub(super) seed: u64,
    rows: Vec<&'a Row>,
}

impl<'a> Case<'a> {
    /// Groups rows in order of first appearance.
    pub(super) fn group(rows: &'a [Row]) -> Vec<Self> {
        let mut cases: Vec<Self> = Vec::new();
        for row in rows {
            let found = cases.iter_mut().find(|case| {
                case.vehicle == row.vehicle
                    && case.gains == row.gains
                    && case.condition == row.condition
                    && case.speed.to_bits() == row.speed.to_bits()
                    && case.seed == row.seed
            });
            match found {
                Some(case) => case.rows.push(row),
                None => cases.push(Self {
                    vehicle: &row.vehicle,
                    gains: &row.gains,
                    condition: &row.condition,
                    speed: row.speed,
                    seed: row.seed,
                    rows: vec![row],
                }),
            }
        }
        cases
    }

    pub(super) fn row(&self, method: Method) -> Option<&'a Row> {
        self.rows.iter().copied().find(|row| row.method == method)
    }

    /// The flights behind one cell.
    pub(super) fn flights(&self, flights: &'a [PerFlight], method: Method) -> Vec<&'a PerFlight> {
        flights
            .iter()
            .filter(|flight| {
                flight.method == method
                    && flight.vehicle == self.vehicle
                    && flight.gains == self.gains
                    && flight.condition == self.condition
                    && flight.speed.to_bits() == self.speed.to_bits()
                    && flight.seed == self.seed
            })
            .collect()
    }
}

/// The methods that occur in the table, in column order.
pub(super) fn methods(rows: &[Row]) -> Vec<Method> {
    Method::ALL.into_iter().filter(|method| rows.iter().any(|row| row.method == *method)).collect()
}

/// `30`, `28 to 30`, or `None` when no flights are listed: how many flights stand behind a cell.
pub(super) fn flights_in_words(cases: &[Case<'_>], flights: &[PerFlight]) -> Option<String> {
    let counts: Vec<usize> =
        cases.iter().flat_map(|case| case.rows.iter().map(|row| case.flights(flights, row.method).len())).collect();
    let (least, most) = (counts.iter().min()?, counts.iter().max()?);
    match (least, most) {
        (_, 0) => None,
        (least, most) if least == most => Some(most.to_string()),
        (least, most) => Some(format!("{least} to {most}")),
    }
}

/// All traces over one trajectory under one condition.
pub(super) struct Scene<'a> {
    traces: Vec<&'a FlightTrace>,
}

impl<'a> Scene<'a> {
    /// Groups traces in order of first appearance.
    pub(super) fn group(flights: &'a [FlightTrace]) -> Vec<Self> {
        let mut scenes: Vec<Self> = Vec::new();
        for trace in flights {
            let found = scenes.iter_mut().find(|scene| {
                let first = scene.traces[0];
                first.trajectory == trace.trajectory
                    && first.vehicle == trace.vehicle
                    && first.gains == trace.gains
                    && first.condition == trace.condition
                    && first.speed.to_bits() == trace.speed.to_bits()
            });
            match found {
                Some(scene) => scene.traces.push(trace),
                None => scenes.push(Self { traces: vec![trace] }),
            }
        }
        scenes
    }

    /// The trace whose desired path and description stand for all.
    pub(super) fn first(&self) -> &'a FlightTrace {
        self.traces[0]
    }

    pub(super) fn baseline(&self) -> Option<&'a FlightTrace> {
        self.traces.iter().copied().find(|trace| trace.method == Method::Baseline)
    }

    /// The trace to set against the baseline: the last method in column order, which is the most complete one.
    pub(super) fn add_on(&self) -> Option<&'a FlightTrace> {
        self.traces.iter().copied().filter(|trace| trace.method != Method::Baseline).max_by_key(|trace| trace.method)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fixture, summary::summarise};

    #[test]
    fn methods_and_seeds_stay_apart() {
        let mut flights = vec![fixture::flight(Method::Ridge, "a", 1.0, 90.0); 3];
        flights[1].seed += 1;
        flights[2].method = Method::NetF32;
        assert_eq!(summarise(&flights).len(), 3);
        assert_eq!(Case::group(&summarise(&flights)).len(), 2);
    }
}
