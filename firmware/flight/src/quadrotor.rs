//! The flight stack's signals: which channels a quadrotor's models map between.
//!
//! *in* setpoints, states and references; *out* channel arrays; *never* another order than the tables say;
//! *source* Zhou 2017, section V-A (position and velocity references out; position, velocity, attitude, rates in).

use impromptu_firmware::{
    math::{coarse_asin, coarse_atan2},
    model::{Channel, Channels},
    preview::EndRule,
};
use nalgebra::Vector3;

use crate::types::{Reference, Setpoint, State};

/// Desired channels: position, velocity, acceleration, yaw.
pub const DESIRED: usize = 10;
/// Measured channels: position, velocity, roll-pitch-yaw, body rates, vertical acceleration.
pub const MEASURED: usize = 13;
/// Reference channels: position, velocity.
pub const REFERENCE: usize = 6;

const fn metres(name: &'static str) -> Channel<'static> {
    Channel { name, unit: "m", frame: WORLD, end: EndRule::Hold }
}

const fn speed(name: &'static str) -> Channel<'static> {
    Channel { name, unit: "m/s", frame: WORLD, end: EndRule::Zero }
}

const fn acceleration(name: &'static str, end: EndRule) -> Channel<'static> {
    Channel { name, unit: "m/s^2", frame: WORLD, end }
}

const fn angle(name: &'static str, frame: &'static str) -> Channel<'static> {
    Channel { name, unit: "rad", frame, end: EndRule::Hold }
}

const fn rate(name: &'static str) -> Channel<'static> {
    Channel { name, unit: "rad/s", frame: "body FLU", end: EndRule::Hold }
}

const WORLD: &str = "world ENU";
const ATTITUDE: &str = "body FLU to world ENU";
const X: Channel<'_> = metres("position.x");
const Y: Channel<'_> = metres("position.y");
const Z: Channel<'_> = metres("position.z");
const VX: Channel<'_> = speed("velocity.x");
const VY: Channel<'_> = speed("velocity.y");
const VZ: Channel<'_> = speed("velocity.z");
const AX: Channel<'_> = acceleration("acceleration.x", EndRule::Zero);
const AY: Channel<'_> = acceleration("acceleration.y", EndRule::Zero);
const AZ: Channel<'_> = acceleration("acceleration.z", EndRule::Zero);
const RISE: Channel<'_> = acceleration("acceleration.z", EndRule::Hold);
const ROLL: Channel<'_> = angle("roll", ATTITUDE);
const PITCH: Channel<'_> = angle("pitch", ATTITUDE);
const YAW: Channel<'_> = angle("yaw", ATTITUDE);

static DESIRED_CHANNELS: [Channel<'_>; DESIRED] = [X, Y, Z, VX, VY, VZ, AX, AY, AZ, angle("yaw", WORLD)];
static MEASURED_CHANNELS: [Channel<'_>; MEASURED] =
    [X, Y, Z, VX, VY, VZ, ROLL, PITCH, YAW, rate("rate.x"), rate("rate.y"), rate("rate.z"), RISE];
static REFERENCE_CHANNELS: [Channel<'_>; REFERENCE] = [X, Y, Z, VX, VY, VZ];

/// The signals of the flight stack.
pub fn signals() -> Channels<'static> {
    Channels { desired: &DESIRED_CHANNELS, measured: &MEASURED_CHANNELS, reference: &REFERENCE_CHANNELS }
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
    fn end_rules_are_those_of_the_table() {
        assert!(signals().desired.iter().zip(END_RULES).all(|(channel, rule)| channel.end == rule));
    }
}
