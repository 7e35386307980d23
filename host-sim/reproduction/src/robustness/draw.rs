//! What is drawn, and what a drawn vehicle flew.
//!
//! *in* ranges and a seed; *out* the vehicle and the air of each draw; *never* a draw that depends on other draws.

use impromptu_firmware::{
    guard::{GuardSettings, Trip},
    model::Model,
};
use impromptu_sim::flights::Loop;
use impromptu_training::{Purpose, derived};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::mismatch::Mismatch;

/// From where to where each quantity is drawn, uniformly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ranges {
    /// Factor on the mass.
    pub mass: [f64; 2],
    /// Factor on the thrust.
    pub thrust: [f64; 2],
    /// Factor on rotor and frame drag.
    pub drag: [f64; 2],
    /// Factor on the inertia.
    pub inertia: [f64; 2],
    /// Factor on the motors' time constant.
    pub motor_lag: [f64; 2],
    /// Further delay of the loop's commands, s.
    pub delay_s: [f64; 2],
    /// Mean wind, m/s, from any side.
    pub wind: [f64; 2],
}

impl Default for Ranges {
    /// What a builder of small vehicles does not know better: a battery or a deck of a tenth of the mass, a battery between full
    /// and nearly empty, other propellers, a link that is at most 20 ms later, moving air indoors.
    fn default() -> Self {
        Self {
            mass: [0.95, 1.15],
            thrust: [0.88, 1.04],
            drag: [0.5, 2.0],
            inertia: [0.8, 1.25],
            motor_lag: [0.8, 1.25],
            delay_s: [0.0, 0.02],
            wind: [0.0, 2.0],
        }
    }
}

impl Ranges {
    /// The vehicle and the air of a draw of a run with a seed.
    pub fn mismatch(&self, seed: u64, draw: u32) -> Mismatch {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(derived(seed, Purpose::Test) ^ (u64::from(draw) << 20));
        let mut between = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
        Mismatch {
            mass: between(self.mass),
            thrust: between(self.thrust),
            drag: between(self.drag),
            inertia: between(self.inertia),
            motor_lag: between(self.motor_lag),
            delay_s: between(self.delay_s),
            wind: between(self.wind),
            wind_direction: between([0.0, std::f64::consts::TAU]),
            ..Mismatch::NONE
        }
    }

    /// The first range that no vehicle can be drawn from: its values and what is allowed.
    pub fn fault(&self) -> Option<String> {
        let allowed = [
            ("mass", self.mass, 0.1, 10.0),
            ("thrust", self.thrust, 0.1, 10.0),
            ("drag", self.drag, 0.0, 100.0),
            ("inertia", self.inertia, 0.1, 10.0),
            ("motor_lag", self.motor_lag, 0.1, 10.0),
            ("delay_s", self.delay_s, 0.0, 0.5),
            ("wind", self.wind, 0.0, 50.0),
        ];
        // Written so that what is not a number is refused as well.
        let fits = |[from, to]: [f64; 2], low: f64, high: f64| low <= from && from <= to && to <= high;
        let (name, [from, to], low, high) = allowed.into_iter().find(|(_, range, low, high)| !fits(*range, *low, *high))?;
        Some(format!("`{name}` is [{from}, {to}]; it must be two numbers from {low} to {high}, the smaller one first"))
    }
}

/// Everything that decides what is drawn and flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawSettings {
    /// Seed of everything random.
    pub seed: u64,
    /// Draws of the whole run, over all shards.
    pub draws: u32,
    /// Strokes that each draw flies.
    pub strokes: usize,
    /// Ranges.
    pub ranges: Ranges,
    /// Vehicle, gains and condition in words.
    pub nominal: String,
    /// CRC-32 of all constants of the nominal loop.
    pub nominal_crc32: u32,
    /// CRC-32 of the model file.
    pub model_crc32: u32,
    /// Program that flies.
    pub software: String,
}

impl DrawSettings {
    /// Settings for a loop and a model.
    pub fn new(closed_loop: &Loop, model: &Model<'_>, seed: u64, draws: u32, strokes: usize, ranges: Ranges) -> Self {
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        // The guard's settings are part of the software; vehicle, stack and condition can come from files.
        let constants = serde_json::json!([
            closed_loop.vehicle,
            closed_loop.settings,
            closed_loop.condition,
            closed_loop.guard == GuardSettings::OFF
        ]);
        Self {
            seed,
            draws,
            strokes,
            ranges,
            nominal: name(closed_loop),
            nominal_crc32: crc.checksum(constants.to_string().as_bytes()),
            model_crc32: model.checksum(),
            software: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
        }
    }

    /// The vehicle and the air of a draw.
    pub fn mismatch(&self, draw: u32) -> Mismatch {
        self.ranges.mismatch(self.seed, draw)
    }
}

/// What one vehicle flew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    /// Number of the draw, from 0.
    pub draw: u32,
    /// The vehicle and its air.
    pub mismatch: Mismatch,
    /// RMS errors without the add-on, m; nothing for a flight that left the numbers.
    pub baseline: Vec<Option<f64>>,
    /// With the network lane alone.
    pub network: Vec<Option<f64>>,
    /// With both lanes.
    pub both: Vec<Option<f64>>,
    /// Flights with both lanes in which the guard tripped a lane.
    pub tripped: u32,
    /// Trips in them, by the reasons' indices.
    pub trips: [u32; Trip::ALL.len()],
}

impl Draw {
    /// Reductions of the draw's flights with the given errors, per cent; a flight that left the numbers counts -100 %, or nothing
    /// where the baseline did so too.
    pub fn reductions(&self, errors: &[Option<f64>]) -> Vec<f64> {
        let flights = self.baseline.iter().zip(errors);
        flights
            .filter_map(|flight| match flight {
                (Some(baseline), Some(error)) => Some((100.0 * (1.0 - error / baseline)).max(-100.0)),
                (Some(_), None) => Some(-100.0),
                (None, _) => None,
            })
            .collect()
    }
}

/// Vehicle, gains and condition of a loop in words.
pub fn name(closed_loop: &Loop) -> String {
    format!("{} {} {}", closed_loop.vehicle.name, closed_loop.gains, closed_loop.condition.name)
}

/// The name of a loop as the beginning of names in the JSON document and of files.
pub fn slug(nominal: &str) -> String {
    nominal.replace([' ', '-', '+'], "_")
}

/// The same of a loop.
pub(super) fn slug_of(closed_loop: &Loop) -> String {
    slug(&name(closed_loop))
}
