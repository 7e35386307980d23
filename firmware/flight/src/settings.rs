//! What a flight stack is told of its vehicle and its loops, and which vehicles there can be.
//!
//! *in* numbers of the vehicle's file, or of the link; *out* settings of the loops, or the first number that no vehicle has;
//! *never* a number that passes for being finite alone; *source* the rates of the Crazyflie's firmware; the ranges reach from
//! the smallest multirotors (a few grams) to those that carry people, gains as far as a loop in samples can be stable.

use core::fmt;

use impromptu_firmware::math;
use serde::{Deserialize, Serialize};

use crate::control::{Airframe, AttitudeGains, Mixer, PositionGains};

/// Rates of the loops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Control ticks (attitude loop) a second.
    pub control_hz: f32,
    /// Control ticks in a tick of the position loop, which is the reference's tick.
    pub position_divisor: u32,
}

impl Default for Rates {
    /// 500 Hz and 100 Hz, as the Crazyflie's firmware runs its attitude and position loops.
    fn default() -> Self {
        Self { control_hz: 500.0, position_divisor: 5 }
    }
}

impl Rates {
    /// Of no loop: the reference's rate is 0.
    pub(crate) const NONE: Self = Self { control_hz: 0.0, position_divisor: 1 };

    /// Rate of the position loop and so of the reference, Hz.
    pub fn reference_hz(&self) -> f32 {
        self.control_hz / self.position_divisor.max(1) as f32
    }
}

/// Settings of the flight stack.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Vehicle constants.
    pub airframe: Airframe,
    /// Position loop.
    pub position: PositionGains,
    /// Attitude loop.
    pub attitude: AttitudeGains,
    /// Rates.
    pub rates: Rates,
}

/// A number of the settings, or what follows from some of them. The link sends its place in this list: new ones come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Setting {
    /// [`Airframe::mass`].
    Mass,
    /// [`Airframe::inertia`].
    Inertia,
    /// [`Airframe::rotors`].
    Rotors,
    /// [`Airframe::directions`].
    Directions,
    /// [`Airframe::thrust_coefficient`].
    ThrustCoefficient,
    /// [`Airframe::torque_coefficient`].
    TorqueCoefficient,
    /// [`Airframe::max_rotor_speed`].
    MaxRotorSpeed,
    /// [`PositionGains::kp`].
    PositionKp,
    /// [`PositionGains::kd`].
    PositionKd,
    /// [`PositionGains::ki`].
    PositionKi,
    /// [`PositionGains::integral_limit`].
    IntegralLimit,
    /// [`AttitudeGains::kp`].
    AttitudeKp,
    /// [`AttitudeGains::kd`].
    AttitudeKd,
    /// [`Rates::control_hz`].
    ControlRate,
    /// [`Rates::position_divisor`].
    PositionDivisor,
    /// Rate of the position loop: control rate over divisor.
    ReferenceRate,
    /// Reaction torque over thrust, m.
    TorqueRatio,
    /// Whether rotors produce every moment.
    Mixing,
    /// The share of its thrust that a rotor gives in hover.
    Hover,
}

impl Setting {
    /// Its name and unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mass => "mass, kg",
            Self::Inertia => "inertia, kg m²",
            Self::Rotors => "a rotor's position, m",
            Self::Directions => "directions (two of 1 and two of -1)",
            Self::ThrustCoefficient => "thrust coefficient, N s²",
            Self::TorqueCoefficient => "torque coefficient, N m s²",
            Self::MaxRotorSpeed => "largest rotor speed, rad/s",
            Self::PositionKp => "position kp, 1/s²",
            Self::PositionKd => "position kd, 1/s",
            Self::PositionKi => "position ki, 1/s³",
            Self::IntegralLimit => "integral limit, m/s²",
            Self::AttitudeKp => "attitude kp, 1/s²",
            Self::AttitudeKd => "attitude kd, 1/s",
            Self::ControlRate => "control rate, Hz",
            Self::PositionDivisor => "position divisor",
            Self::ReferenceRate => "control rate over position divisor, Hz",
            Self::TorqueRatio => "torque over thrust coefficient, m",
            Self::Mixing => "effort of the rotors for a moment (positions and directions)",
            Self::Hover => "share of its largest thrust that a rotor gives in hover (mass, coefficients, speed)",
        }
    }
}

/// Why no vehicle has these settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingsRefusal {
    /// Which number.
    pub what: Setting,
    /// Its value.
    pub value: f32,
    /// The least that it may be.
    pub low: f32,
    /// The most that it may be.
    pub high: f32,
}

impl fmt::Display for SettingsRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, value, low, high } = self;
        write!(f, "{} is {value:e}, a vehicle's is within {low:e} and {high:e}: correct it", what.name())
    }
}

impl core::error::Error for SettingsRefusal {}

/// Largest [`Mixer::effort`]: thirty times that of four rotors in a square.
const EFFORT: f32 = 10.0;

/// Refuses the first value outside of the range, NaN, or so small that it is denormal.
fn range(what: Setting, values: &[f32], low: f32, high: f32) -> Result<(), SettingsRefusal> {
    match values.iter().find(|value| !(low..=high).contains(*value) || value.is_subnormal()) {
        None => Ok(()),
        Some(value) => Err(SettingsRefusal { what, value: *value, low, high }),
    }
}

/// Refuses gains with which a double integrator that is sampled at `hz` is unstable whatever else is in the loop: with zero-order
/// hold it is stable for kd T < 2 and kp T < 2 kd (Jury's test).
fn stable(names: [Setting; 2], kp: f32, kd: f32, hz: f32) -> Result<(), SettingsRefusal> {
    let [kp_name, kd_name] = names;
    range(kd_name, &[kd], 0.0, 2.0 * hz)?;
    range(kp_name, &[kp], 0.0, 2.0 * kd * hz)
}

impl Settings {
    /// Whether a vehicle can have these settings. The flight stack takes no others, and takes all of them or none.
    ///
    /// # Errors
    /// The first number that no vehicle has.
    #[inline(never)]
    pub fn check(&self) -> Result<(), SettingsRefusal> {
        // Without `..`: a new number must be added here too.
        let Self { airframe, position, attitude, rates } = self;
        let Airframe { mass, inertia, rotors, directions, thrust_coefficient, torque_coefficient, max_rotor_speed } = airframe;
        let PositionGains { kp, kd, ki, integral_limit } = position;
        let Rates { control_hz, position_divisor } = rates;
        range(Setting::Mass, &[*mass], 1e-3, 1e3)?;
        range(Setting::Inertia, inertia, 1e-9, 1e4)?;
        for (axis, moment) in inertia.iter().enumerate() {
            // Of a body each is at most the sum of the others; measured ones a little more.
            let others = inertia.iter().sum::<f32>() - inertia[axis];
            range(Setting::Inertia, &[*moment], 1e-9, 1.25 * others)?;
        }
        range(Setting::Rotors, rotors.as_flattened(), -20.0, 20.0)?;
        for [x, y] in rotors {
            range(Setting::Rotors, &[math::sqrt(x * x + y * y)], 1e-3, 30.0)?;
        }
        for direction in directions {
            let sign = if *direction < 0.0 { -1.0 } else { 1.0 };
            range(Setting::Directions, &[*direction], sign, sign)?;
        }
        range(Setting::Directions, &[directions.iter().sum()], 0.0, 0.0)?;
        range(Setting::ThrustCoefficient, &[*thrust_coefficient], 1e-11, 10.0)?;
        range(Setting::TorqueCoefficient, &[*torque_coefficient], 1e-14, 10.0)?;
        range(Setting::TorqueRatio, &[torque_coefficient / thrust_coefficient], 1e-4, 1.0)?;
        range(Setting::MaxRotorSpeed, &[*max_rotor_speed], 10.0, 20_000.0)?;
        range(Setting::ControlRate, &[*control_hz], 20.0, 10_000.0)?;
        range(Setting::PositionDivisor, &[*position_divisor as f32], 1.0, 1_000.0)?;
        range(Setting::ReferenceRate, &[rates.reference_hz()], 5.0, 2_000.0)?;
        for (kp, kd) in kp.iter().zip(kd) {
            range(Setting::PositionKd, &[*kd], 0.0, 200.0)?;
            range(Setting::PositionKp, &[*kp], 0.0, 1_000.0)?;
            stable([Setting::PositionKp, Setting::PositionKd], *kp, *kd, rates.reference_hz())?;
        }
        range(Setting::PositionKi, ki, 0.0, 1_000.0)?;
        range(Setting::IntegralLimit, &[*integral_limit], 0.0, 100.0)?;
        range(Setting::AttitudeKd, &[attitude.kd], 0.1, 1e4)?;
        range(Setting::AttitudeKp, &[attitude.kp], 1.0, 1e6)?;
        stable([Setting::AttitudeKp, Setting::AttitudeKd], attitude.kp, attitude.kd, *control_hz)?;
        let mixing = SettingsRefusal { what: Setting::Mixing, value: f32::INFINITY, low: 0.0, high: EFFORT };
        let mixer = Mixer::new(airframe).ok_or(mixing)?;
        range(Setting::Mixing, &[mixer.effort(airframe)], 0.0, EFFORT)?;
        range(Setting::Hover, &mixer.hover_shares(*mass), 1e-3, 1.0)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A Crazyflie.
    pub(crate) const GOOD: Settings = Settings {
        airframe: Airframe {
            mass: 0.03,
            inertia: [1.43e-5, 1.43e-5, 2.89e-5],
            rotors: [[0.03077, 0.03077], [0.03077, -0.03077], [-0.03077, -0.03077], [-0.03077, 0.03077]],
            directions: [1.0, -1.0, 1.0, -1.0],
            thrust_coefficient: 2.3e-8,
            torque_coefficient: 7.8e-10,
            max_rotor_speed: 2_500.0,
        },
        position: PositionGains { kp: [6.5, 6.5, 15.0], kd: [4.0, 4.0, 9.0], ki: [0.0; 3], integral_limit: 0.0 },
        attitude: AttitudeGains { kp: 544.0, kd: 46.64 },
        rates: Rates { control_hz: 500.0, position_divisor: 5 },
    };

    /// The numbers of the settings, to be changed one at a time.
    pub(crate) fn numbers(settings: &mut Settings) -> Vec<&mut f32> {
        let Settings { airframe: a, position: p, attitude, rates } = settings;
        let mut all = vec![&mut a.mass, &mut a.thrust_coefficient, &mut a.torque_coefficient, &mut a.max_rotor_speed];
        all.extend(a.inertia.iter_mut().chain(a.rotors.as_flattened_mut()).chain(&mut a.directions));
        all.extend(p.kp.iter_mut().chain(&mut p.kd).chain(&mut p.ki).chain([&mut p.integral_limit]));
        all.extend([&mut attitude.kp, &mut attitude.kd, &mut rates.control_hz]);
        all
    }

    #[test]
    fn what_no_vehicle_has_is_refused_by_name() {
        let changed = |change: fn(&mut Settings)| {
            let mut settings = GOOD;
            change(&mut settings);
            settings.check().map_err(|refusal| refusal.what)
        };
        assert_eq!(GOOD.check(), Ok(()));
        type Change = fn(&mut Settings);
        let cases: [(Change, Setting); 24] = [
            (|s| s.airframe.mass = 0.0, Setting::Mass),
            (|s| s.airframe.mass = -1.0, Setting::Mass),
            (|s| s.airframe.mass = 1e38, Setting::Mass),
            (|s| s.airframe.inertia[0] = -1.0, Setting::Inertia),
            (|s| s.airframe.inertia[1] = 1.0, Setting::Inertia),
            (|s| s.airframe.max_rotor_speed = 0.0, Setting::MaxRotorSpeed),
            (|s| s.airframe.max_rotor_speed = -2500.0, Setting::MaxRotorSpeed),
            (|s| s.airframe.thrust_coefficient = 0.0, Setting::ThrustCoefficient),
            (|s| s.airframe.thrust_coefficient = -2.3e-8, Setting::ThrustCoefficient),
            (|s| s.airframe.thrust_coefficient = 1e-44, Setting::ThrustCoefficient),
            (|s| s.airframe.torque_coefficient = 0.0, Setting::TorqueCoefficient),
            (|s| s.airframe.directions = [1.0; 4], Setting::Directions),
            (|s| s.airframe.directions = [2.0, -2.0, 2.0, -2.0], Setting::Directions),
            (|s| s.airframe.rotors[1] = s.airframe.rotors[3], Setting::Mixing),
            (|s| s.airframe.mass = 0.3, Setting::Hover),
            (|s| s.position.kp[2] = -15.0, Setting::PositionKp),
            (|s| s.position.kp[2] = 1e38, Setting::PositionKp),
            (|s| s.position.ki[0] = 1e-44, Setting::PositionKi),
            (|s| s.position.integral_limit = -1.0, Setting::IntegralLimit),
            (|s| s.attitude.kp = -544.0, Setting::AttitudeKp),
            (|s| s.attitude.kd = 1001.0, Setting::AttitudeKd),
            (|s| s.rates.control_hz = 1e9, Setting::ControlRate),
            (|s| s.rates.position_divisor = 0, Setting::PositionDivisor),
            (|s| s.rates.position_divisor = u32::MAX, Setting::PositionDivisor),
        ];
        for (index, (change, expected)) in cases.into_iter().enumerate() {
            assert_eq!(changed(change), Err(expected), "case {index}");
        }
        let message = Settings { airframe: Airframe { mass: -1.0, ..GOOD.airframe }, ..GOOD }.check().unwrap_err().to_string();
        assert_eq!(message, "mass, kg is -1e0, a vehicle's is within 1e-3 and 1e3: correct it");
    }

    proptest! {
        #[test]
        fn no_bits_of_any_number_make_a_vehicle_that_cannot_hover(
            index in 0usize..32, bits in any::<u32>(), divisor in any::<u32>()
        ) {
            let mut settings = GOOD;
            settings.rates.position_divisor = divisor % 40;
            *numbers(&mut settings)[index] = f32::from_bits(bits);
            if settings.check().is_ok() {
                let mut all = settings;
                prop_assert!(numbers(&mut all).iter().all(|x| x.is_finite() && !x.is_subnormal()));
                let shares = Mixer::new(&settings.airframe).unwrap().hover_shares(settings.airframe.mass);
                prop_assert!(shares.iter().all(|share| *share > 0.0 && *share <= 1.0), "{shares:?}");
                prop_assert!((20.0..=1e4).contains(&settings.rates.control_hz));
                prop_assert!(settings.rates.reference_hz() >= 5.0);
            }
        }

        #[test]
        fn vehicles_of_any_size_are_taken(scale in 0.33f32..30.0, lift in 1.2f32..8.0) {
            // From a gram on. Mass with the volume, thrust with mass, inertia with mass and area, frequencies with 1 over the
            // root of the size.
            let mass = 0.03 * scale.powi(3);
            let speed = 2500.0 / scale.sqrt();
            let thrust = lift * mass * 9.81 / 4.0 / speed.powi(2);
            let airframe = Airframe {
                mass,
                inertia: GOOD.airframe.inertia.map(|x| x * scale.powi(5)),
                rotors: GOOD.airframe.rotors.map(|rotor| rotor.map(|x| x * scale)),
                thrust_coefficient: thrust,
                torque_coefficient: thrust * 0.03 * scale.sqrt(),
                max_rotor_speed: speed,
                ..GOOD.airframe
            };
            let attitude = AttitudeGains { kp: 544.0 / scale, kd: 46.64 / scale.sqrt() };
            prop_assert_eq!(Settings { airframe, attitude, ..GOOD }.check(), Ok(()));
        }
    }
}
