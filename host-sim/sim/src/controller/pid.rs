//! The Crazyflie's cascade of PIDs: position to velocity to angles and thrust at the reference's rate (100 Hz), angles to body
//! rates to torques at the control rate (500 Hz).
//!
//! *in* a target and a state; *out* angles and thrust, then rotor speeds; *never* a use of a velocity reference or an
//! acceleration: the firmware makes none of either while it is told positions; *source* the Crazyflie's documentation ("cascaded
//! PID") and the gains, limits and rates of its firmware. What differs: this is another implementation, which of the same states
//! makes the firmware's powers to 4 of 65535 (the firmware rounds torques); angles are about the body's axes FLU (the firmware's
//! pitch has the other sign); the low-pass filters of the derivatives of position and velocity are left out, as the gains behind
//! them are zero; rates have no derivative at the first tick.

mod axis;

use impromptu_flight::types::{MotorCommand, State};
use libm::{asinf, atan2f, cosf, sinf};

use super::{
    motors::{Demand, FULL, Motors, largest_thrust},
    target::Target,
};
use crate::plant::{GRAVITY, PositionGains, Vehicle};
use axis::{Axis, Gains};

/// Position (m) to velocity (m/s), across and up; velocity to tilt (degrees), and to a thousandth of the motors' power; angles
/// (degrees) to body rates (degrees/s), roll and pitch, and yaw; body rates to motor power, roll and pitch, and yaw.
const POSITION: [Gains; 2] = [Gains::new(2.0, 0.0, 0.0), Gains::new(2.0, 0.5, 0.0)];
const VELOCITY: [Gains; 2] = [Gains::new(25.0, 1.0, 0.0), Gains::new(25.0, 15.0, 0.0)];
const ANGLE: [Gains; 2] = [Gains::new(6.0, 3.0, 0.0).integrating(20.0), Gains::new(6.0, 1.0, 0.35).integrating(360.0)];
const RATE: [Gains; 2] = [Gains::new(250.0, 500.0, 2.5).integrating(33.3), Gains::new(120.0, 16.7, 0.0).integrating(166.7)];

/// Largest velocity that is asked for, m/s: 1, and a tenth more.
const SPEED: f32 = 1.1;
/// Largest tilt that is asked for, degrees.
const TILT: f32 = 20.0;
/// Power in hover before the loop knows better, and the least.
const HOVER: f32 = 36_000.0;
const LEAST: f32 = 20_000.0;
/// Power of a unit of the vertical velocity's PID, and the most units.
const UNIT: f32 = 1_000.0;
const UNITS: f32 = 32.767;
/// Largest torque, in motor power.
const TORQUE: f32 = 32_767.0;

/// What the position part wants of the attitude part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Roll, pitch and yaw, degrees, of the body FLU in the world ENU.
    pub angles: [f32; 3],
    /// Power of each motor, of 65535.
    pub thrust: f32,
}

impl Attitude {
    /// Level, at the least power.
    pub const LEVEL: Self = Self { angles: [0.0; 3], thrust: LEAST };
}

/// The cascade.
#[derive(Clone, Debug)]
pub struct Pid {
    position: [Axis; 3],
    velocity: [Axis; 3],
    angle: [Axis; 3],
    rate: [Axis; 3],
    motors: Motors,
}

impl Pid {
    /// A cascade whose position part runs at `reference_hz` and whose attitude part runs at `control_hz`.
    pub fn new(vehicle: &Vehicle, reference_hz: f32, control_hz: f32) -> Self {
        let slow = |[across, up]: [Gains; 2]| [across, across, up].map(|gains| Axis::new(gains, reference_hz));
        let fast = |[tilt, yaw]: [Gains; 2]| [tilt, tilt, yaw].map(|gains| Axis::new(gains, control_hz));
        Self {
            position: slow(POSITION.map(|gains| gains.limited(SPEED))),
            velocity: slow([VELOCITY[0].limited(1.1 * TILT), VELOCITY[1].limited(UNITS)]),
            angle: fast(ANGLE),
            rate: fast(RATE),
            motors: Motors::new(vehicle),
        }
    }

    /// Position part: a tilt towards the velocity that leads to the reference, in axes that turn with the vehicle's yaw.
    pub fn position_step(&mut self, target: &Target, state: &State) -> Attitude {
        let [.., yaw] = angles(state);
        let (sine, cosine) = (sinf(yaw.to_radians()), cosf(yaw.to_radians()));
        let turned = |[x, y, z]: [f32; 3]| [x * cosine + y * sine, y * cosine - x * sine, z];
        let wanted = turned(target.reference.position.into());
        let (position, velocity) = (turned(state.position.into()), turned(state.velocity.into()));
        let [ahead, left, up]: [f32; 3] = std::array::from_fn(|axis| {
            let speed = self.position[axis].step(wanted[axis] - position[axis], position[axis]);
            self.velocity[axis].step(speed - velocity[axis], velocity[axis])
        });
        let thrust = (up * UNIT + HOVER).clamp(LEAST, FULL);
        // Nose down to go ahead, right side down to go to the right.
        Attitude { angles: [(-left).clamp(-TILT, TILT), ahead.clamp(-TILT, TILT), target.reference.yaw.to_degrees()], thrust }
    }

    /// Attitude part: rotor speeds.
    pub fn attitude_step(&mut self, wanted: &Attitude, state: &State) -> MotorCommand {
        let found = angles(state);
        let torque = std::array::from_fn(|axis| {
            let error = wrapped(wanted.angles[axis] - found[axis]);
            let rate = self.angle[axis].step_angle(error, found[axis]);
            let measured = state.rates[axis].to_degrees();
            self.rate[axis].step(rate - measured, measured).clamp(-TORQUE, TORQUE)
        });
        self.motors.command(&Demand { thrust: wanted.thrust, torque })
    }
}

/// Gains for small errors, 1/s² and 1/s: a degree of tilt is 0.171 m/s².
pub(super) fn position_gains(vehicle: &Vehicle) -> PositionGains {
    let lift = f64::from(UNIT / FULL) * 4.0 * largest_thrust(vehicle) / vehicle.mass;
    let tilt = GRAVITY.to_radians();
    let of = |axis: usize, scale: f64| (f64::from(VELOCITY[axis].kp) * scale, f64::from(POSITION[axis].kp));
    let [(across, lead), (up, climb)] = [of(0, tilt), of(1, lift)];
    PositionGains { proportional: [across * lead, across * lead, up * climb], derivative: [across, across, up] }
}

/// Roll, pitch and yaw, degrees: the body turned by yaw about z, then by pitch about its y, then by roll about its x.
fn angles(state: &State) -> [f32; 3] {
    let q = &state.attitude;
    let [w, x, y, z] = [q.w, q.i, q.j, q.k];
    let roll = atan2f(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let pitch = asinf((2.0 * (w * y - x * z)).clamp(-1.0, 1.0));
    let yaw = atan2f(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, yaw].map(f32::to_degrees)
}

/// The same angle, degrees, from -180 to 180.
fn wrapped(angle: f32) -> f32 {
    libm::remainderf(angle, 360.0)
}
