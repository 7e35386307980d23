//! One flight of a group: what its flight stack is told, what it commands, what is logged.
//!
//! *in* a plan and the plant's state at each control tick; *out* rotor commands, and at the end a record; *never* the truth
//! where the vehicle would have a measurement; *source* Zhou 2017, Fig. 1.

use impromptu_flight::{
    flight::{PREVIEW, Settings},
    quadrotor,
    replay::Recorder,
    types::{State as FirmwareState, Tick},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{
    conversion::setpoint,
    plan::{Dither, FlightPlan, FlightRecord, RolloutError},
    stack::FlightStack,
};
use crate::{
    condition::Condition,
    flight_log::{FlightLog, LogRow},
    plant::State,
    sensors::{DelayLine, Sensors},
};

/// What one vehicle is told of where it is, and what is remembered of its flight.
pub(super) struct Pilot<'a, S> {
    pub(super) plan: FlightPlan<'a>,
    stack: S,
    sensors: Sensors,
    late: DelayLine<([f64; 3], [f64; 3])>,
    dither: Option<(Dither, Xoshiro256PlusPlus)>,
    known: FirmwareState,
    squares: f64,
    correction_squares: [f64; 3],
    rows: Vec<LogRow>,
    recorder: Option<Recorder<Vec<u8>>>,
}

impl<'a, S: FlightStack> Pilot<'a, S> {
    pub(super) fn new(
        mut stack: S,
        settings: &Settings,
        condition: &Condition,
        plan: FlightPlan<'a>,
        tick: f64,
    ) -> Result<Self, RolloutError> {
        let refuse = |reason: String| RolloutError::Condition { name: condition.name.clone(), reason };
        let expected = f64::from(settings.rates.reference_hz());
        if (plan.trajectory.rate_hz - expected).abs() > 1e-6 * expected {
            return Err(RolloutError::Rate { name: plan.trajectory.name.clone(), found: plan.trajectory.rate_hz, expected });
        }
        let ticks = |seconds: f64| (seconds / tick).round() as usize;
        let mut recorder = plan.record.then(|| Recorder::new(settings, plan.model));
        // As much of the past as the model looks back at has to stay.
        let past = plan.model.map_or(0, |(model, _)| model.card().preview_span().0 as usize);
        for sample in plan.trajectory.samples.iter().take((PREVIEW / 2 + PREVIEW / 4).min(PREVIEW.saturating_sub(past))) {
            let setpoint = setpoint(sample);
            stack.push_setpoint(&setpoint);
            recorder.iter_mut().for_each(|recorder| recorder.setpoint(&setpoint));
        }
        Ok(Self {
            stack,
            sensors: Sensors::new(&condition.noise, plan.seed).map_err(|error| refuse(error.to_string()))?,
            late: DelayLine::new(ticks(condition.measurement_delay_s)).map_err(|error| refuse(error.to_string()))?,
            dither: plan.dither.map(|dither| (dither, Xoshiro256PlusPlus::seed_from_u64(plan.seed ^ 0x9b05_688c_2b3e_6c1f))),
            known: FirmwareState::default(),
            squares: 0.0,
            correction_squares: [0.0; 3],
            rows: Vec::new(),
            recorder,
            plan,
        })
    }

    /// One control tick: what the loop is told, what it commands, what is logged.
    pub(super) fn step(&mut self, tick: usize, divisor: usize, state: &State) -> [f64; 4] {
        let (position, velocity) = self.late.push((state.position, state.velocity));
        let (attitude, rates) = self.sensors.attitude_and_body_rates(state);
        let [w, x, y, z] = attitude.map(|value| value as f32);
        self.known.attitude = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        self.known.rates = Vector3::from(rates.map(|value| value as f32));
        let reference_tick = tick / divisor;
        if tick.is_multiple_of(divisor) {
            let seen = State { position, velocity, ..*state };
            let (position, velocity) = self.sensors.position_and_velocity(&seen);
            self.known.position = Vector3::from(position.map(|value| value as f32));
            let velocity = Vector3::from(velocity.map(|value| value as f32));
            if tick > 0 {
                self.known.vertical_acceleration = (velocity.z - self.known.velocity.z) * self.plan.trajectory.rate_hz as f32;
            }
            self.known.velocity = velocity;
            let next = self.stack.next_setpoint() as usize;
            if let Some(sample) = self.plan.trajectory.samples.get(next) {
                let setpoint = setpoint(sample);
                self.stack.push_setpoint(&setpoint);
                self.recorder.iter_mut().for_each(|recorder| recorder.setpoint(&setpoint));
            }
            self.dither(reference_tick);
        }
        let command = self.stack.step(Tick(tick as u32), &self.known);
        if let Some(recorder) = &mut self.recorder {
            recorder.tick(&self.known, &command, self.stack.reference());
        }
        if tick.is_multiple_of(divisor) {
            self.score(reference_tick, state);
        }
        command.fractions().map(f64::from)
    }

    fn dither(&mut self, reference_tick: usize) {
        let Some((dither, random)) = &mut self.dither else { return };
        let hold = ((dither.hold_s * self.plan.trajectory.rate_hz).round() as usize).max(1);
        if reference_tick.is_multiple_of(hold) {
            let bits = random.random::<u64>();
            let sign = |bit: u32| if (bits >> bit) & 1 == 1 { dither.amplitude } else { -dither.amplitude };
            let offset = Vector3::new(sign(60) as f32, sign(61) as f32, sign(62) as f32);
            self.stack.set_dither(offset);
            self.recorder.iter_mut().for_each(|recorder| recorder.dither(offset));
        }
    }

    fn score(&mut self, reference_tick: usize, state: &State) {
        let trajectory = self.plan.trajectory;
        let Some(desired) = trajectory.samples.get(reference_tick) else { return };
        let reference = self.stack.reference();
        if trajectory.scored.contains(&reference_tick) {
            for axis in 0..3 {
                let error = desired.position[axis] - state.position[axis];
                self.squares += error * error;
                let correction = f64::from(reference.position[axis]) - desired.position[axis];
                self.correction_squares[axis] += correction * correction;
            }
        }
        if self.plan.log {
            let measured = quadrotor::measured(&self.known);
            self.rows.push(LogRow {
                time: reference_tick as f64 / trajectory.rate_hz,
                desired: *desired,
                reference_position: reference.position.map(f64::from).into(),
                reference_velocity: reference.velocity.map(f64::from).into(),
                measured_position: self.known.position.map(f64::from).into(),
                measured_velocity: self.known.velocity.map(f64::from).into(),
                measured_body: Some(std::array::from_fn(|channel| f64::from(measured[6 + channel]))),
                true_position: Some(state.position),
            });
        }
    }

    pub(super) fn finish(mut self) -> FlightRecord {
        let scored = self.plan.trajectory.scored.len().max(1) as f64;
        let rms = (self.squares / scored).sqrt();
        FlightRecord {
            // A flight that left the numbers is as bad as can be, not "not a number".
            rms: if rms.is_finite() { rms } else { f64::INFINITY },
            trips: self.stack.trips(),
            correction_rms: self.correction_squares.map(|sum| (sum / scored).sqrt()),
            recorded: self.recorder.map(Recorder::finish),
            log: self.plan.log.then(|| FlightLog {
                name: self.plan.trajectory.name.clone(),
                rate_hz: self.plan.trajectory.rate_hz,
                scored: self.plan.trajectory.scored.clone(),
                rows: self.rows,
            }),
        }
    }
}
