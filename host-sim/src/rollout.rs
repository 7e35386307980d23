//! Closed-loop flights: eight at once through the plant, each with the firmware's own flight stack.
//!
//! *in* [`FlightPlan`]s; *out* a [`FlightRecord`] each; *never* a result that depends on the order of the plans, on the other flights
//! or on the number of threads; *source* Zhou 2017, Fig. 1; rates of `impromptu_flight::flight::Rates`.

mod faults;
mod pilot;
mod stack;

use impromptu_firmware::{
    adapter::Lanes,
    guard::{GuardSettings, Trips},
    model::Model,
};
use impromptu_flight::{
    control::{Airframe, AttitudeGains, PositionGains},
    flight::{Rates, Settings},
    replay::Recorded,
    types::Setpoint,
};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::{
    condition::Condition,
    flight_log::FlightLog,
    plant::{LANES, Plant, State, States, Variation, Vehicle},
    trajectory::{Sample, Trajectory},
    weather::Weather,
};
pub use faults::FaultyFlight;
use pilot::Pilot;
pub use stack::FlightStack;
use stack::Software;

/// An independent excitation of the position reference: random signs, held for `hold_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dither {
    /// Amplitude on each axis, m.
    pub amplitude: f64,
    /// Time between new signs, s.
    pub hold_s: f64,
}

/// One flight to be flown.
#[derive(Clone, Debug)]
pub struct FlightPlan<'a> {
    /// What is desired.
    pub trajectory: &'a Trajectory,
    /// The add-on, if any, and its lanes.
    pub model: Option<(&'a Model<'a>, Lanes)>,
    /// How the vehicle differs from its data.
    pub variation: Variation,
    /// Seed of noise, disturbance and dither.
    pub seed: u64,
    /// Dither on the position reference.
    pub dither: Option<Dither>,
    /// Gain on the feedback lane's output, unknown to it.
    pub loop_gain: f32,
    /// Guard of the add-on.
    pub guard: GuardSettings,
    /// Whether every reference tick is logged.
    pub log: bool,
    /// Whether the flight stack's inputs and answers are recorded, so that another machine can fly it again (loop gain 1, no command delay, the default guard).
    pub record: bool,
}

impl<'a> FlightPlan<'a> {
    /// A flight of the nominal vehicle without add-on, dither or log.
    pub fn new(trajectory: &'a Trajectory, seed: u64) -> Self {
        Self {
            trajectory,
            model: None,
            variation: Variation::default(),
            seed,
            dither: None,
            loop_gain: 1.0,
            guard: GuardSettings::default(),
            log: false,
            record: false,
        }
    }

    /// The same flight with an add-on.
    #[must_use]
    pub fn with(self, model: &'a Model<'a>, lanes: Lanes) -> Self {
        Self { model: Some((model, lanes)), ..self }
    }
}

/// What came of a flight.
#[derive(Clone, Debug, Default)]
pub struct FlightRecord {
    /// sqrt(mean |p_d - p|²) over the scored part, m, with the true position.
    pub rms: f64,
    /// Root mean square of the correction's position part on each axis over the scored part, m.
    pub correction_rms: [f64; 3],
    /// Trips of the guard.
    pub trips: Trips,
    /// Every reference tick, if asked for.
    pub log: Option<FlightLog>,
    /// Everything that went into the flight stack and came out, if asked for.
    pub recorded: Option<Recorded<Vec<u8>>>,
}

/// Why flights could not be flown.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// The rotors cannot produce every moment.
    #[error("vehicle `{0}`: its rotors cannot produce every moment; check rotor positions and directions")]
    Airframe(String),
    /// The firmware refuses the model.
    #[error("model: {0}")]
    Model(#[from] impromptu_firmware::model::Refusal),
    /// A setting of the condition is impossible.
    #[error("condition `{name}`: {reason}")]
    Condition {
        /// The condition.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// The trajectory is not sampled at the loop's rate.
    #[error("trajectory `{name}` is sampled at {found} Hz, the position loop runs at {expected} Hz")]
    Rate {
        /// The trajectory.
        name: String,
        /// Its rate, Hz.
        found: f64,
        /// The loop's rate, Hz.
        expected: f64,
    },
    /// Unknown gains.
    #[error(transparent)]
    Vehicle(#[from] crate::plant::VehicleError),
}

/// The firmware's settings for a vehicle with the position gains of that name.
pub fn settings(vehicle: &Vehicle, gains: &str) -> Result<Settings, crate::plant::VehicleError> {
    let position = vehicle.position_gains(gains)?;
    let single = |values: [f64; 3]| values.map(|value| value as f32);
    Ok(Settings {
        airframe: Airframe {
            mass: vehicle.mass as f32,
            inertia: single([vehicle.inertia.xx, vehicle.inertia.yy, vehicle.inertia.zz]),
            rotors: std::array::from_fn(|i| [vehicle.rotors[i].position[0] as f32, vehicle.rotors[i].position[1] as f32]),
            directions: std::array::from_fn(|i| f32::from(vehicle.rotors[i].direction)),
            thrust_coefficient: vehicle.thrust_coefficient as f32,
            torque_coefficient: vehicle.torque_coefficient as f32,
            max_rotor_speed: vehicle.rotor_speed_max as f32,
        },
        position: PositionGains {
            kp: single(position.proportional),
            kd: single(position.derivative),
            ki: [0.0; 3],
            integral_limit: 0.0,
        },
        attitude: AttitudeGains { kp: vehicle.attitude_gains.proportional as f32, kd: vehicle.attitude_gains.derivative as f32 },
        rates: Rates::default(),
    })
}

/// A sample as the firmware's setpoint.
pub fn setpoint(sample: &Sample) -> Setpoint {
    let vector = |values: [f64; 3]| Vector3::from(values.map(|value| value as f32));
    Setpoint {
        position: vector(sample.position),
        velocity: vector(sample.velocity),
        acceleration: vector(sample.acceleration),
        yaw: sample.yaw as f32,
    }
}

/// Flies every plan under one condition; results in the plans' order. Groups of eight run on the threads of the current rayon pool.
///
/// # Errors
/// The first plan that cannot be flown.
pub fn fly(
    vehicle: &Vehicle,
    settings: &Settings,
    condition: &Condition,
    plans: &[FlightPlan<'_>],
) -> Result<Vec<FlightRecord>, RolloutError> {
    // Flights of like length share a group, so that few lanes idle.
    let mut order: Vec<usize> = (0..plans.len()).collect();
    order.sort_by_key(|&index| plans[index].trajectory.samples.len());
    let groups: Vec<&[usize]> = order.chunks(LANES).collect();
    let flown: Vec<Vec<(usize, FlightRecord)>> = groups
        .par_iter()
        .map(|group| {
            let plans: Vec<&FlightPlan<'_>> = group.iter().map(|&index| &plans[index]).collect();
            let stacks = plans.iter().map(|plan| Software::new(vehicle, settings, condition, plan)).collect::<Result<_, _>>()?;
            let records = Group::new(vehicle, settings, condition, &plans, stacks)?.fly();
            Ok(group.iter().copied().zip(records).collect())
        })
        .collect::<Result<_, RolloutError>>()?;
    let mut records = vec![FlightRecord::default(); plans.len()];
    for (index, record) in flown.into_iter().flatten() {
        records[index] = record;
    }
    Ok(records)
}

/// Flies one plan with a flight stack of its own: the same flight as [`fly`]'s, to the bit, if the stack gives the same bits.
///
/// # Errors
/// If the plan cannot be flown.
pub fn fly_on(
    stack: impl FlightStack,
    vehicle: &Vehicle,
    settings: &Settings,
    condition: &Condition,
    plan: &FlightPlan<'_>,
) -> Result<FlightRecord, RolloutError> {
    let records = Group::new(vehicle, settings, condition, &[plan], vec![stack])?.fly();
    Ok(records.into_iter().next().unwrap_or_default())
}

/// Flights that run in step.
struct Group<'a, S> {
    plant: Plant,
    states: States,
    weather: Weather,
    pilots: Vec<Pilot<'a, S>>,
    rates: Rates,
    rotor_speed_max: f64,
}

impl<'a, S: FlightStack> Group<'a, S> {
    fn new(
        vehicle: &Vehicle,
        settings: &Settings,
        condition: &Condition,
        plans: &[&FlightPlan<'a>],
        stacks: Vec<S>,
    ) -> Result<Self, RolloutError> {
        let rates = settings.rates;
        let tick = 1.0 / f64::from(rates.control_hz);
        let mut variations = [Variation::default(); LANES];
        let mut seeds = [0; LANES];
        let mut states = States::splat(&State::at_rest([0.0; 3]));
        let mut pilots = Vec::with_capacity(LANES);
        for (lane, (plan, stack)) in plans.iter().zip(stacks).enumerate() {
            variations[lane] = plan.variation;
            seeds[lane] = plan.seed;
            let pilot = Pilot::new(stack, settings, condition, (*plan).clone(), tick)?;
            let hover = plan.variation.payload_factor * vehicle.mass * crate::plant::GRAVITY
                / (4.0 * vehicle.thrust_coefficient * plan.variation.thrust_factor);
            let mut state = State::at_rest(plan.trajectory.samples[0].position);
            let half_yaw = 0.5 * plan.trajectory.samples[0].yaw;
            state.attitude = [half_yaw.cos(), 0.0, 0.0, half_yaw.sin()];
            state.rotor_speeds = [hover.sqrt(); 4];
            states.set_lane(lane, &state);
            pilots.push(pilot);
        }
        let weather = Weather::new(&condition.weather, tick, seeds)
            .map_err(|error| RolloutError::Condition { name: condition.name.clone(), reason: error.to_string() })?;
        Ok(Self {
            plant: Plant::new(vehicle, variations),
            states,
            weather,
            pilots,
            rates,
            rotor_speed_max: vehicle.rotor_speed_max,
        })
    }

    fn fly(mut self) -> Vec<FlightRecord> {
        let divisor = self.rates.position_divisor as usize;
        let duration = 1.0 / f64::from(self.rates.control_hz);
        let ticks = self.pilots.iter().map(|pilot| pilot.plan.trajectory.samples.len()).max().unwrap_or(0) * divisor;
        let mut commands = [[0.0; LANES]; 4];
        for tick in 0..ticks {
            for (lane, pilot) in self.pilots.iter_mut().enumerate() {
                let state = self.states.lane(lane);
                let fractions = pilot.step(tick, divisor, &state);
                for (command, fraction) in commands.iter_mut().zip(fractions) {
                    command[lane] = fraction * self.rotor_speed_max;
                }
            }
            self.plant.step(&mut self.states, &commands, self.weather.now(), duration);
            self.weather.advance();
        }
        self.pilots.into_iter().map(Pilot::finish).collect()
    }
}
