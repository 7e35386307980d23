//! A loop with other gains and more noise, and a flight stack that is told wrong things.
//!
//! *in* a [`Change`] and a loop; *out* the loop that is flown, and a stack that remembers of each reference tick what the lanes
//! did; *never* other bits than those of the plain stack without a fault; *source* what goes wrong with position measurements and
//! trajectories in practice: a frozen pose, a swapped marker, a link that stalls.

use impromptu_firmware::{
    adapter::Lanes,
    guard::{Guard, GuardSettings, Trips},
    model::Model,
    network::Scratch,
};
use impromptu_flight::{
    flight::{Flight, PREVIEW},
    learning::FlightLearning,
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use impromptu_sim::{
    flights::Loop,
    rollout::{FaultyFlight, FlightPlan, FlightRecord, FlightStack, RolloutError, fly_on},
    trajectory::Trajectory,
};
use nalgebra::Vector3;

use super::mismatch::Mismatch;

/// What is wrong with what the loop and the add-on are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Nothing.
    None,
    /// The measured position stands still.
    Frozen {
        /// From this time on, s,
        at: f64,
        /// for so long, s.
        seconds: f64,
    },
    /// The measured position is elsewhere for one reference tick,
    Jumps {
        /// so far away, m,
        size: f64,
        /// each so often, s.
        each: f64,
    },
    /// No setpoint comes: the trajectory reaches less far ahead from then on.
    Starved {
        /// From this time on, s,
        at: f64,
        /// for so long, s; less than what is stored ahead.
        seconds: f64,
    },
}

/// How a flown loop differs from the loop of the training flights, in what it is and in what it is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Vehicle and air.
    pub mismatch: Mismatch,
    /// Factor on the position gains, with the damping that they had; known to the loop.
    pub gains: f64,
    /// Factor on all sensor noise.
    pub noise: f64,
    /// What the loop is told wrong.
    pub fault: Fault,
    /// Where measured positions jump to, rad from the world's x.
    pub direction: f64,
}

impl Change {
    /// The loop of the training flights.
    pub const NONE: Self = Self { mismatch: Mismatch::NONE, gains: 1.0, noise: 1.0, fault: Fault::None, direction: 0.0 };

    /// The loop that is flown.
    #[must_use]
    pub fn applied(&self, closed_loop: &Loop) -> Loop {
        let mut flown = self.mismatch.applied(closed_loop);
        let gains = &mut flown.settings.position;
        gains.kp = gains.kp.map(|gain| gain * self.gains as f32);
        gains.kd = gains.kd.map(|gain| gain * (self.gains as f32).sqrt());
        let noise = &mut flown.condition.noise;
        for sigma in [&mut noise.position, &mut noise.velocity, &mut noise.attitude, &mut noise.body_rates] {
            *sigma *= self.noise;
        }
        flown
    }

    /// Flies a trajectory on a loop that this change was [applied](Change::applied) to, with both lanes of a model if given.
    ///
    /// # Errors
    /// If the model does not fit the flight stack.
    pub fn fly(
        &self,
        flown: &Loop,
        model: Option<&Model<'_>>,
        trajectory: &Trajectory,
        seed: u64,
    ) -> Result<Flown, RolloutError> {
        self.fly_learning(flown, model, None, trajectory, seed)
    }

    /// [`Change::fly`] that goes on with what was learned, if something learns.
    ///
    /// # Errors
    /// If the model does not fit the flight stack.
    pub fn fly_learning(
        &self,
        flown: &Loop,
        model: Option<&Model<'_>>,
        learning: Option<&mut FlightLearning>,
        trajectory: &Trajectory,
        seed: u64,
    ) -> Result<Flown, RolloutError> {
        let mut stack = FaultyStack { learning, ..FaultyStack::new(self, flown, model)? };
        if let Some(learning) = &mut stack.learning {
            learning.restart();
        }
        let plan = FlightPlan { log: true, ..FlightPlan::new(trajectory, seed) };
        let record = fly_on(&mut stack, &flown.vehicle, &flown.settings, &flown.condition, &plan)?;
        Ok(Flown { record, lanes: stack.lanes })
    }
}

/// A flight and what the lanes did in it.
#[derive(Clone, Debug)]
pub struct Flown {
    /// With its log.
    pub record: FlightRecord,
    /// At each reference tick; empty without a model.
    pub lanes: Vec<LaneTick>,
}

impl Flown {
    /// Squared error at each reference tick, m².
    pub fn squared_errors(&self) -> Vec<f64> {
        let square = |row: &impromptu_sim::flight_log::LogRow| {
            let position = row.true_position.unwrap_or(row.measured_position);
            (0..3).map(|axis| (row.desired.position[axis] - position[axis]).powi(2)).sum::<f64>()
        };
        self.record.log.iter().flat_map(|log| &log.rows).map(square).collect()
    }
}

/// What the lanes do at a reference tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct LaneTick {
    /// How far network and feedback lane act, 0..=1: faded in, and of the feedback lane what the guard lets act.
    pub weights: [f32; 2],
    /// Which lanes the guard lets act.
    pub allowed: Lanes,
    /// Trips so far.
    pub trips: Trips,
}

/// A flight stack to which faults happen.
struct FaultyStack<'m> {
    inside: FaultyFlight<'m>,
    scratch: Scratch,
    fault: Fault,
    direction: f64,
    control_hz: f64,
    /// Control ticks in a reference tick.
    divisor: u32,
    /// Of the references, s.
    period: f64,
    /// Time of flight, s.
    seconds: f64,
    /// Position that stands still.
    held: Option<Vector3<f32>>,
    lanes: Vec<LaneTick>,
    learning: Option<&'m mut FlightLearning>,
}

impl<'m> FaultyStack<'m> {
    fn new(change: &Change, flown: &Loop, model: Option<&'m Model<'m>>) -> Result<Self, RolloutError> {
        let settings = &flown.settings;
        let refused = || RolloutError::Airframe(format!("`{}`", flown.vehicle.name));
        let mut flight = Flight::new(settings).ok_or_else(refused)?;
        if let Some(model) = model {
            flight.attach(model, Lanes::BOTH)?;
        }
        if let Some(adapter) = flight.adapter().filter(|_| flown.guard != GuardSettings::default()) {
            adapter.set_guard(flown.guard);
        }
        let control_hz = f64::from(settings.rates.control_hz);
        Ok(Self {
            inside: FaultyFlight::new(flight, 1.0, flown.condition.command_delay_ticks(control_hz)),
            scratch: Scratch::new(),
            fault: change.fault,
            direction: change.direction,
            control_hz,
            divisor: settings.rates.position_divisor,
            period: 1.0 / flown.rate_hz(),
            seconds: 0.0,
            held: None,
            lanes: Vec::new(),
            learning: None,
        })
    }
}

impl FlightStack for FaultyStack<'_> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        let starved = match self.fault {
            Fault::Starved { at, seconds } => (at..at + seconds).contains(&self.seconds),
            _ => false,
        };
        if !starved {
            self.inside.flight.push_setpoint(setpoint);
        }
    }

    fn next_setpoint(&self) -> i32 {
        self.inside.flight.next_setpoint()
    }

    fn set_dither(&mut self, offset: Vector3<f32>) {
        self.inside.flight.set_dither(offset);
    }

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        self.seconds = f64::from(tick.0) / self.control_hz;
        let mut told = *state;
        match self.fault {
            Fault::Frozen { at, seconds } if (at..at + seconds).contains(&self.seconds) => {
                told.position = *self.held.get_or_insert(state.position);
            }
            Fault::Jumps { size, each } if self.seconds.rem_euclid(each) < self.period => {
                told.position += Vector3::new(self.direction.cos(), self.direction.sin(), 0.0).map(|part| (size * part) as f32);
            }
            _ => {}
        }
        if let Some(learning) = &mut self.learning {
            learning.step(&mut self.inside.flight, tick, Some(&told));
        }
        let command = self.inside.step(tick, &told, &mut self.scratch);
        if tick.0.is_multiple_of(self.divisor)
            && let Some(adapter) = self.inside.flight.adapter()
        {
            let allowed = adapter.guard().map_or(Lanes::NONE, |guard| guard.allowed(Lanes::BOTH));
            let monitored = adapter.model().is_some_and(|model| model.monitor().is_some());
            let share = adapter.guard().filter(|_| monitored).map_or(1.0, Guard::feedback_share);
            let [network, feedback] = adapter.weights();
            self.lanes.push(LaneTick { weights: [network, feedback * share], allowed, trips: adapter.trips() });
        }
        command
    }

    fn reference(&self) -> &Reference {
        self.inside.flight.reference()
    }

    fn trips(&mut self) -> Trips {
        self.inside.flight.adapter().map(|adapter| adapter.trips()).unwrap_or_default()
    }
}

// A flight starves for less than what is stored ahead.
const _: () = assert!(PREVIEW > 80);
