//! What is told a vehicle, and what holds of any.
//!
//! *in* bytes; *out* settings, states and setpoints, most of them such as there are; *never* a vehicle that cannot hover, or an
//! answer of one that is no number.

use std::sync::LazyLock;

use impromptu_firmware::Model;
use impromptu_flight::{
    control::{Airframe, AttitudeGains, Mixer, PositionGains},
    flight::{Rates, Settings},
    types::{MotorCommand, Reference, Setpoint, State},
};
use impromptu_model_export::{Precision, encode};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::{bytes::Bytes, mcu::nets::Net};

/// A quadrotor's model, as it is shipped.
pub(super) static MODEL: LazyLock<Model<'static>> = LazyLock::new(|| {
    let Some(net) = Net::all().ok().and_then(|mut nets| nets.pop()) else { panic!("tests/models cannot be read") };
    let file = encode(&net.description, Some(&net.network), Precision::Int8, &net.calibration);
    let Ok(file) = file else { panic!("the shipped model cannot be exported") };
    Model::from_bytes(file.leak()).unwrap_or_else(|refusal| panic!("the shipped model is refused: {refusal}"))
});

/// A Crazyflie 2.1, about.
pub fn crazyflie() -> Settings {
    let arm = 0.0325;
    Settings {
        airframe: Airframe {
            mass: 0.03,
            inertia: [1.43e-5, 1.43e-5, 2.89e-5],
            rotors: [[arm, arm], [arm, -arm], [-arm, -arm], [-arm, arm]],
            directions: [1.0, -1.0, 1.0, -1.0],
            thrust_coefficient: 2.3e-8,
            torque_coefficient: 7.8e-10,
            max_rotor_speed: 2_500.0,
        },
        position: PositionGains { kp: [6.5, 6.5, 15.0], kd: [4.0, 4.0, 9.0], ki: [0.5, 0.5, 0.5], integral_limit: 0.5 },
        attitude: AttitudeGains { kp: 544.0, kd: 46.64 },
        rates: Rates::default(),
    }
}

/// A Crazyflie's settings, of which some numbers are others.
pub(super) fn settings(bytes: &mut Bytes<'_>) -> Settings {
    // As they go over the link: first the numbers, then the divisor.
    const NUMBERS: u8 = 32;
    let mut encoded = postcard::to_allocvec(&crazyflie()).unwrap_or_default();
    for _ in 0..bytes.choice(4) {
        let place = usize::from(bytes.choice(NUMBERS)) * size_of::<f32>();
        let Some(place) = encoded.get_mut(place..).and_then(|rest| rest.first_chunk_mut()) else { break };
        let number = match bytes.choice(4) {
            // Near what it was, so that it may be a vehicle's.
            0..=2 => f32::from_le_bytes(*place) * (0.5 + f32::from(bytes.byte()) / 128.0),
            _ => bytes.number(),
        };
        *place = number.to_le_bytes();
    }
    let mut settings: Settings = postcard::from_bytes(&encoded).unwrap_or_else(|_| crazyflie());
    if bytes.choice(4) == 0 {
        settings.rates.position_divisor = bytes.word() >> bytes.choice(32);
    }
    settings
}

/// What holds of any vehicle: it can hover, and its loops have a rate.
pub(super) fn judge(settings: &Settings) {
    let encoded = postcard::to_allocvec(settings).unwrap_or_default();
    let numbers = encoded.as_chunks().0.iter().take(32).map(|bytes| f32::from_le_bytes(*bytes));
    assert!(numbers.into_iter().all(|number| number.is_finite() && !number.is_subnormal()), "{settings:?}");
    let Some(mixer) = Mixer::new(&settings.airframe) else { panic!("no mixer: {settings:?}") };
    let shares = mixer.hover_shares(settings.airframe.mass);
    assert!(shares.iter().all(|share| *share > 0.0 && *share <= 1.0), "{shares:?} of {settings:?}");
    assert!((20.0..=1e4).contains(&settings.rates.control_hz) && settings.rates.reference_hz() >= 5.0, "{settings:?}");
    let Airframe { mass, inertia, max_rotor_speed, thrust_coefficient, .. } = settings.airframe;
    assert!([mass, max_rotor_speed, thrust_coefficient].iter().chain(&inertia).all(|number| *number > 0.0), "{settings:?}");
}

/// A vehicle's answer: motors and reference, as bits; all of them numbers.
pub(super) fn answer(command: &MotorCommand, reference: &Reference) -> Vec<u32> {
    assert!(command.fractions().iter().all(|fraction| (0.0..=1.0).contains(fraction)), "{command:?}");
    let Reference { position, velocity, yaw } = reference;
    let numbers = position.iter().chain(velocity).chain([yaw]).copied();
    assert!(numbers.clone().all(f32::is_finite), "{reference:?}");
    command.fractions().into_iter().chain(numbers).map(f32::to_bits).collect()
}

/// A state: of unit length in most cases, and where what is desired is.
pub(super) fn state(bytes: &mut Bytes<'_>, near: &Setpoint) -> State {
    let kind = bytes.choice(16);
    let [position, velocity, rates] = [(); 3].map(|()| if kind < 2 { bytes.numbers() } else { small(bytes) }.into());
    let [i, j, k] = if kind == 2 { bytes.numbers() } else { small(bytes) };
    let attitude = match kind {
        2 => UnitQuaternion::new_unchecked(Quaternion::new(bytes.number(), i, j, k)),
        _ => UnitQuaternion::new_normalize(Quaternion::new(1.0, i, j, k)),
    };
    let vertical_acceleration = if kind == 3 { bytes.number() } else { 0.0 };
    let (position, velocity) = if kind < 2 { (position, velocity) } else { (near.position + position, near.velocity + velocity) };
    State { position, velocity, attitude, rates, vertical_acceleration }
}

/// Numbers within ±0.5.
fn small(bytes: &mut Bytes<'_>) -> [f32; 3] {
    [(); 3].map(|()| f32::from(bytes.byte()) / 256.0 - 0.5)
}

/// A setpoint: a slow one in most cases.
pub(super) fn setpoint(bytes: &mut Bytes<'_>) -> Setpoint {
    let any = bytes.choice(8) == 0;
    let [position, velocity, acceleration] = [(); 3].map(|()| if any { bytes.numbers() } else { small(bytes) }.into());
    Setpoint { position, velocity, acceleration, yaw: if any { bytes.number() } else { 0.0 } }
}
