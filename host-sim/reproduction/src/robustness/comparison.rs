//! One set of trajectories flown three times: without the add-on, with the network lane alone, with both lanes.
//!
//! *in* a loop, a model, trajectories; *out* errors and trips of the guard; *never* a baseline that flew another vehicle or
//! another air than the add-on; *source* Zhou 2017, Table I (reduction of the RMS error).

use impromptu_firmware::{
    adapter::Lanes,
    guard::{Trip, Trips},
    model::Model,
};
use impromptu_sim::{
    flights::{Loop, reduction},
    rollout::{FlightPlan, FlightRecord, RolloutError},
    trajectory::Trajectory,
};

/// The ways in which every trajectory is flown.
const WAYS: [Option<Lanes>; 3] = [None, Some(Lanes { network: true, feedback: false }), Some(Lanes::BOTH)];

/// RMS errors of the flights of one loop, m, one for each trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Without the add-on.
    pub baseline: Vec<f64>,
    /// With the network lane alone.
    pub network: Vec<f64>,
    /// With both lanes.
    pub both: Vec<f64>,
    /// Flights with both lanes in which the guard tripped a lane.
    pub tripped: usize,
    /// Trips of both lanes together in these flights, by [`Trip::index`].
    pub trips: [u32; Trip::ALL.len()],
}

impl Comparison {
    /// Flies the trajectories under the seeds from `seed` on, all three ways.
    ///
    /// # Errors
    /// If the model does not fit the flight stack.
    pub fn fly(closed_loop: &Loop, model: &Model<'_>, trajectories: &[Trajectory], seed: u64) -> Result<Self, RolloutError> {
        let flights: Vec<(&Trajectory, u64)> = trajectories.iter().zip(seed..).collect();
        Self::of(closed_loop, model, &flights)
    }

    /// As [`Comparison::fly`], each trajectory under a seed of its own.
    ///
    /// # Errors
    /// If the model does not fit the flight stack.
    pub fn of(closed_loop: &Loop, model: &Model<'_>, flights: &[(&Trajectory, u64)]) -> Result<Self, RolloutError> {
        let plans: Vec<FlightPlan<'_>> = WAYS
            .iter()
            .flat_map(|lanes| {
                flights.iter().map(|&(trajectory, seed)| FlightPlan {
                    model: lanes.map(|lanes| (model, lanes)),
                    guard: closed_loop.guard,
                    ..FlightPlan::new(trajectory, seed)
                })
            })
            .collect();
        let records = closed_loop.fly(&plans)?;
        let errors = |way: usize| -> Vec<f64> { way_of(&records, way, flights.len()).map(|record| record.rms).collect() };
        let of_both = || way_of(&records, 2, flights.len()).map(|record| &record.trips);
        let tripped = of_both().filter(|trips| **trips != Trips::default()).count();
        let trips = by_reason(of_both());
        Ok(Self { baseline: errors(0), network: errors(1), both: errors(2), tripped, trips })
    }

    /// Mean and worst reduction by the network lane alone, per cent of the baseline's error.
    pub fn network_alone(&self) -> (f64, f64) {
        reduction(&self.baseline, &self.network)
    }

    /// Mean and worst reduction by both lanes, per cent of the baseline's error.
    pub fn both_lanes(&self) -> (f64, f64) {
        reduction(&self.baseline, &self.both)
    }

    /// Mean errors of the baseline, the network lane alone and both lanes, cm.
    pub fn centimetres(&self) -> [f64; 3] {
        [&self.baseline, &self.network, &self.both].map(|errors| 100.0 * errors.iter().sum::<f64>() / errors.len().max(1) as f64)
    }

    /// Trips by reason in words; empty if there were none.
    pub fn trips_text(&self) -> String {
        trips_text(&self.trips)
    }
}

/// Trips of both lanes together, by [`Trip::index`].
pub(super) fn by_reason<'a>(all: impl Iterator<Item = &'a Trips>) -> [u32; Trip::ALL.len()] {
    let mut counts = [0; Trip::ALL.len()];
    for trips in all {
        for (count, trip) in counts.iter_mut().zip(Trip::ALL) {
            *count += u32::from(trips.of(trip));
        }
    }
    counts
}

/// Trips by [`Trip::index`] in words; empty if there were none.
pub(super) fn trips_text(trips: &[u32; Trip::ALL.len()]) -> String {
    let counts = Trip::ALL.iter().zip(trips).filter(|(_, count)| **count > 0);
    counts.map(|(trip, count)| format!("{} {count}", trip.name())).collect::<Vec<_>>().join(", ")
}

fn way_of(records: &[FlightRecord], way: usize, flights: usize) -> impl Iterator<Item = &FlightRecord> {
    records.iter().skip(way * flights).take(flights)
}
