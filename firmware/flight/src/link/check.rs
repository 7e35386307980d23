//! What a decoded message must fulfil to be delivered.
//!
//! *in* a message; *out* the reason why it is refused, if it is; *never* a number that is not finite past here, a state or a
//! setpoint that no vehicle has, or a change of one that it has; *source* x86 and Arm give NaN other bits, so a NaN would end the
//! equality of both; the limits of [`crate::types`].

use super::{
    CHUNK,
    message::{
        Command, Inertial, LearnedPiece, LearningReport, Message, ModelChunk, Motors, Position, Report, Telemetry, TimedSetpoint,
    },
    outcome::{Quantity, Reason},
};
use impromptu_firmware::math;

use crate::{
    control::{Airframe, AttitudeGains, PositionGains},
    settings::{Rates, Settings},
    types::{ACCELERATION_LIMIT, POSITION_LIMIT, RATE_LIMIT, VELOCITY_LIMIT, YAW_LIMIT, within},
};

/// How far from 1 the length of an attitude's quaternion may be.
const LENGTH_TOLERANCE: f32 = 1e-3;

impl Message for Command<'_> {
    fn check(&self) -> Result<(), Reason> {
        match self {
            Self::Inertial(Inertial { tick: _, attitude, rates }) => {
                finite([attitude])?;
                limited(rates, RATE_LIMIT, Quantity::Rates)?;
                let [w, x, y, z] = attitude;
                let length = math::sqrt(w * w + x * x + y * y + z * z);
                // A square may be infinite where the number is not; then this is infinite too.
                if math::abs(length - 1.0) <= LENGTH_TOLERANCE { Ok(()) } else { Err(Reason::Attitude) }
            }
            Self::Position(Position { tick: _, position, velocity, vertical_acceleration }) => {
                limited(position, POSITION_LIMIT, Quantity::Position)?;
                limited(velocity, VELOCITY_LIMIT, Quantity::Velocity)?;
                limited(&[*vertical_acceleration], ACCELERATION_LIMIT, Quantity::Acceleration)
            }
            Self::Setpoint(timed) | Self::Replan(timed) => {
                let TimedSetpoint { tick: _, position, velocity, acceleration, yaw } = timed;
                limited(position, POSITION_LIMIT, Quantity::Position)?;
                limited(velocity, VELOCITY_LIMIT, Quantity::Velocity)?;
                limited(acceleration, ACCELERATION_LIMIT, Quantity::Acceleration)?;
                limited(&[*yaw], YAW_LIMIT, Quantity::Yaw)
            }
            Self::Settings(settings) => check_settings(settings),
            Self::ModelChunk(ModelChunk { bytes, .. }) if bytes.len() > CHUNK => Err(Reason::Length { limit: CHUNK as u32 }),
            Self::Hello
            | Self::Lanes(_)
            | Self::Arm
            | Self::Disarm
            | Self::Brake
            | Self::ModelBegin { .. }
            | Self::ModelChunk(_)
            | Self::ModelCommit
            | Self::Learn(_)
            | Self::Learned { .. } => Ok(()),
        }
    }

    fn opens(&self) -> bool {
        matches!(self, Self::Hello)
    }
}

impl Message for Report<'_> {
    fn check(&self) -> Result<(), Reason> {
        match self {
            Self::Motors(Motors { tick: _, fractions, reference }) => {
                finite([fractions, reference])?;
                if fractions.iter().all(|fraction| (0.0..=1.0).contains(fraction)) { Ok(()) } else { Err(Reason::Fractions) }
            }
            Self::Telemetry(Telemetry { network, feedback, tracking_error, .. }) => {
                finite([&[network.weight, feedback.weight, *tracking_error]])
            }
            Self::Learning(LearningReport { commissioned, learned_s, share, correction, .. }) => {
                finite([&[*commissioned, *learned_s, *share], correction])
            }
            Self::Learned(LearnedPiece { bytes, .. }) if bytes.len() > CHUNK => Err(Reason::Length { limit: CHUNK as u32 }),
            Self::Identity(_) | Self::Acknowledge { .. } | Self::Inputs(_) | Self::Learned(_) => Ok(()),
        }
    }

    fn opens(&self) -> bool {
        matches!(self, Self::Identity(_))
    }
}

/// Which settings a vehicle can have is its own affair ([`Settings::check`]), since it answers by name.
fn check_settings(settings: &Settings) -> Result<(), Reason> {
    // Without `..`: a new number must be added here too.
    let Settings { airframe, position, attitude, rates } = settings;
    let Airframe { mass, inertia, rotors, directions, thrust_coefficient, torque_coefficient, max_rotor_speed } = airframe;
    let PositionGains { kp, kd, ki, integral_limit } = position;
    let AttitudeGains { kp: attitude_kp, kd: attitude_kd } = attitude;
    let Rates { control_hz, position_divisor: _ } = rates;
    finite([
        inertia,
        rotors.as_flattened(),
        directions,
        kp,
        kd,
        ki,
        &[*mass, *thrust_coefficient, *torque_coefficient, *max_rotor_speed],
        &[*integral_limit, *attitude_kp, *attitude_kd, *control_hz],
    ])
}

fn finite<const N: usize>(groups: [&[f32]; N]) -> Result<(), Reason> {
    if groups.iter().all(|group| group.iter().all(|value| value.is_finite())) { Ok(()) } else { Err(Reason::NotFinite) }
}

fn limited(values: &[f32], limit: f32, what: Quantity) -> Result<(), Reason> {
    if within(values, limit) {
        return Ok(());
    }
    finite([values])?;
    Err(Reason::Range { what })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frozen;
    use proptest::prelude::*;

    #[test]
    fn every_number_of_every_command_is_guarded() {
        // Where the numbers of a command start in its bytes, and how many they are.
        let numbers = |command: &Command<'_>| match command {
            Command::Inertial(_) | Command::Position(_) => (3, 7),
            Command::Setpoint(_) | Command::Replan(_) => (3, 10),
            Command::Settings(_) => (1, 32),
            _ => (0, 0),
        };
        for command in frozen::commands() {
            let (start, count) = numbers(&command);
            for (index, bad) in (0..count).flat_map(|index| [f32::NAN, f32::INFINITY].map(|bad| (index, bad))) {
                let mut bytes = [0; 256];
                postcard::to_slice(&command, &mut bytes).unwrap();
                bytes[start + 4 * index..][..4].copy_from_slice(&bad.to_le_bytes());
                let changed: Command<'_> = postcard::from_bytes(&bytes).unwrap();
                assert_eq!(changed.check(), Err(Reason::NotFinite), "number {index} of {command:?}");
            }
        }
    }

    #[test]
    fn what_no_vehicle_measures_or_can_be_asked_for_is_refused_by_name() {
        let range = |what| Err(Reason::Range { what });
        let position = Position { tick: 1, position: [0.0; 3], velocity: [0.0; 3], vertical_acceleration: 0.0 };
        let far = Position { position: [3e19, 0.0, 1.5], ..position };
        assert_eq!(Command::Position(far).check(), range(Quantity::Position));
        let fast = Position { velocity: [0.0, -401.0, 0.0], ..position };
        assert_eq!(Command::Position(fast).check(), range(Quantity::Velocity));
        let rough = Position { vertical_acceleration: 1e38, ..position };
        assert_eq!(Command::Position(rough).check(), range(Quantity::Acceleration));
        let turning = Inertial { tick: 1, attitude: [1.0, 0.0, 0.0, 0.0], rates: [0.0, 0.0, 200.0] };
        assert_eq!(Command::Inertial(turning).check(), range(Quantity::Rates));
        let setpoint = TimedSetpoint { tick: 1, position: [0.0; 3], velocity: [0.0; 3], acceleration: [0.0; 3], yaw: 0.0 };
        assert_eq!(Command::Setpoint(TimedSetpoint { yaw: -1e4, ..setpoint }).check(), range(Quantity::Yaw));
        let far = TimedSetpoint { position: [1e30, 0.0, 1.5], ..setpoint };
        assert_eq!(Command::Setpoint(far).check(), range(Quantity::Position));
    }

    proptest! {
        #[test]
        fn attitudes_pass_within_a_thousandth_of_unit_length(
            direction in prop::array::uniform4(-1.0f32..1.0), scale in 0.9f32..1.1
        ) {
            let length = direction.iter().map(|x| x * x).sum::<f32>().sqrt();
            prop_assume!(length > 0.1 && (math::abs(scale - 1.0) - 1e-3).abs() > 1e-5);
            let attitude = direction.map(|x| x / length * scale);
            let result = Command::Inertial(Inertial { tick: 0, attitude, rates: [0.0; 3] }).check();
            prop_assert_eq!(result.is_ok(), (scale - 1.0).abs() < 1e-3);
        }

        #[test]
        fn any_bits_of_an_attitude_are_near_unit_length_or_refused(bits in any::<[u32; 4]>()) {
            let attitude = bits.map(f32::from_bits);
            if Command::Inertial(Inertial { tick: 0, attitude, rates: [0.0; 3] }).check().is_ok() {
                let square: f64 = attitude.iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
                prop_assert!((square.sqrt() - 1.0).abs() < 1.01e-3);
            }
        }
    }
}
