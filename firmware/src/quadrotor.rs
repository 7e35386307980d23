//! The flight stack's signals: which channels a quadrotor's models map between.
//!
//! *in* setpoints, states and references; *out* channel arrays; *never* another order than the tables say;
//! *source* Zhou 2017, section V-A (position and velocity references out; position, velocity, attitude, rates in).

use nalgebra::Vector3;

use crate::{
    math::{coarse_asin, coarse_atan2},
    model::{Channel, MAX_CHANNELS, SignalTable},
    preview::EndRule,
    types::{Reference, Setpoint, State},
};

/// Desired channels: position, velocity, acceleration, yaw.
pub const DESIRED: usize = 10;
/// Measured channels: position, velocity, roll-pitch-yaw, body rates, vertical acceleration.
pub const MEASURED: usize = 13;
/// Reference channels: position, velocity.
pub const REFERENCE: usize = 6;

const POSITION: [&str; 3] = ["position.x", "position.y", "position.z"];
const VELOCITY: [&str; 3] = ["velocity.x", "velocity.y", "velocity.z"];

fn channels<'a>(
    names: impl IntoIterator<Item = &'a str>,
    unit: &'a str,
    frame: &'a str,
    end: EndRule,
) -> impl Iterator<Item = Channel<'a>> {
    names.into_iter().map(move |name| Channel { name, unit, frame, end })
}

/// The channels as a list. Unlike `collect` it has no panic, whether the compiler can count them or not; a test counts them.
fn listed<'a>(channels: impl Iterator<Item = Channel<'a>>) -> heapless::Vec<Channel<'a>, MAX_CHANNELS> {
    let mut list = heapless::Vec::new();
    for channel in channels {
        let _ = list.push(channel);
    }
    list
}

/// The signal table of the flight stack.
pub fn signals() -> SignalTable<'static> {
    let world = "world ENU";
    let position = || channels(POSITION, "m", world, EndRule::Hold);
    let velocity = || channels(VELOCITY, "m/s", world, EndRule::Zero);
    let acceleration = channels(["acceleration.x", "acceleration.y", "acceleration.z"], "m/s^2", world, EndRule::Zero);
    let angles = channels(["roll", "pitch", "yaw"], "rad", "body FLU to world ENU", EndRule::Hold);
    let rates = channels(["rate.x", "rate.y", "rate.z"], "rad/s", "body FLU", EndRule::Hold);
    SignalTable {
        desired: listed(position().chain(velocity()).chain(acceleration).chain(channels(["yaw"], "rad", world, EndRule::Hold))),
        measured: listed(position().chain(velocity()).chain(angles).chain(rates).chain(channels(
            ["acceleration.z"],
            "m/s^2",
            world,
            EndRule::Hold,
        ))),
        reference: listed(position().chain(velocity())),
    }
}

/// End rules of the desired channels.
pub const END_RULES: [EndRule; DESIRED] = {
    let (hold, zero) = (EndRule::Hold, EndRule::Zero);
    [hold, hold, hold, zero, zero, zero, zero, zero, zero, hold]
};

/// A setpoint as desired channels.
pub fn desired(setpoint: &Setpoint) -> [f32; DESIRED] {
    let Setpoint { position: p, velocity: v, acceleration: a, yaw } = setpoint;
    [p.x, p.y, p.z, v.x, v.y, v.z, a.x, a.y, a.z, *yaw]
}

/// A state as measured channels. Angles are approximate ([`coarse_atan2`]); only the network reads them.
pub fn measured(state: &State) -> [f32; MEASURED] {
    let State { position: p, velocity: v, attitude, rates: w, vertical_acceleration } = state;
    let [x, y, z, s] = [attitude.i, attitude.j, attitude.k, attitude.w];
    let roll = coarse_atan2(2.0 * (s * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let pitch = coarse_asin(2.0 * (s * y - z * x));
    let yaw = coarse_atan2(2.0 * (s * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [p.x, p.y, p.z, v.x, v.y, v.z, roll, pitch, yaw, w.x, w.y, w.z, *vertical_acceleration]
}

/// Reference channels as the baseline loop's reference; yaw is not adapted.
pub fn reference(channels: &[f32; REFERENCE], yaw: f32) -> Reference {
    let [px, py, pz, vx, vy, vz] = *channels;
    Reference { position: Vector3::new(px, py, pz), velocity: Vector3::new(vx, vy, vz), yaw }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_count_as_many_channels_as_the_arrays() {
        let table = signals();
        assert_eq!([table.desired.len(), table.measured.len(), table.reference.len()], [DESIRED, MEASURED, REFERENCE]);
        assert!(table.desired.iter().zip(END_RULES).all(|(channel, rule)| channel.end == rule));
    }
}
