//! What a vehicle tells of itself.
//!
//! *in* the autopilot; *out* reports of the link; *never* a change, but of what was read once.

use impromptu_firmware::{
    guard::Trip,
    math::{finite_or_zero, sqrt},
};

use super::{Autopilot, Learns, Meters};
use crate::{
    course::Now,
    link::message::{FlyingModel, FrameReport, Identity, InputReport, LaneReport, Motors, Telemetry},
    types::{MotorCommand, Tick},
};

impl<L: Learns> Autopilot<'_, L> {
    /// What the motors got in the last tick, as the link says it.
    pub fn motors(&self, command: &MotorCommand) -> Motors {
        Motors::new(Tick(self.tick.0.wrapping_sub(1)), command, self.flight.reference())
    }

    /// Who this is.
    pub fn identity<'a>(&'a self, software: &'a str) -> Identity<'a> {
        let slot = self.slot;
        let model = self.model.map(|model| FlyingModel { name: model.card().name, checksum: model.checksum(), slot });
        Identity::new(software, model)
    }

    /// What became of what it was told.
    pub fn inputs(&self) -> InputReport {
        let Now { tick, .. } = self.now();
        let reach = self.flight.next_setpoint().wrapping_sub(tick).wrapping_sub(1);
        InputReport { tick: self.tick.0, refused: self.refused, reach, braking: self.course.braking() }
    }

    /// How the vehicle is.
    pub fn telemetry(&mut self, meters: &Meters, frames: FrameReport) -> Telemetry {
        let (network, feedback, late_inferences, saturations) = match self.flight.adapter() {
            Some(adapter) => {
                let [network, feedback] = adapter.weights();
                let lane = |weight, counts: [u16; Trip::ALL.len()]| {
                    let mut report = LaneReport { weight: finite_or_zero(weight), ..LaneReport::default() };
                    report.trips.iter_mut().zip(counts).for_each(|(place, count)| *place = count);
                    report
                };
                let trips = adapter.trips();
                (lane(network, trips.network), lane(feedback, trips.feedback), adapter.late(), adapter.saturations())
            }
            None => Default::default(),
        };
        Telemetry {
            tick: self.tick.0,
            armed: self.armed,
            network,
            feedback,
            late_inferences,
            saturations,
            frames,
            tracking_error: finite_or_zero(sqrt(self.error_square)),
            control_max: meters.control_max,
            inference_max: meters.inference_max,
            stack_bytes: meters.stack_bytes,
            entry_latency_max: meters.entry_latency_max,
            deadline_misses: meters.deadline_misses,
        }
    }
}
