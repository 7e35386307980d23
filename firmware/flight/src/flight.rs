//! The flight stack: a value in, a value out, time is an argument.
//!
//! *in* the state at every control tick and the desired trajectory ahead of time; *out* a motor command; *never* an allocation, a
//! panic, a global, or a clock of its own; *source* the loop of Zhou 2017, Fig. 1, with the rates of [`Rates`].

mod clock;
mod frozen;
mod loops;
mod trajectory;

use core::num::NonZeroU32;

use impromptu_firmware::{
    AddOn, Caps,
    adapter::{Adapter, Inference, Job, Lanes},
    model::{DEFAULT_AXES, Model, Refusal},
    network::Scratch,
};
use nalgebra::{Matrix3, Vector3};

use crate::{
    caps,
    control::ThrustVector,
    quadrotor::{self, DESIRED, MEASURED, REFERENCE},
    types::{MotorCommand, POSITION_LIMIT, Reference, State, Tick, within},
};

pub use crate::settings::{Rates, Settings};
use clock::Clock;
pub(crate) use frozen::Frozen;
use loops::Loops;

/// Samples of the desired trajectory that the flight stack keeps: 1.92 s at 100 Hz.
pub const PREVIEW: usize = 192;

/// On the ground, by the application's word.
const GROUNDED: u8 = 1;
/// By the word of what measures the loop.
const SUSPENDED: u8 = 2;

/// The adapter of the flight stack.
pub type QuadrotorAdapter<'m> = Adapter<'m, DESIRED, MEASURED, REFERENCE>;

/// The add-on of the flight stack.
pub type QuadrotorAddOn<'m> = AddOn<'m, DESIRED, MEASURED, REFERENCE, PREVIEW>;

/// What is configured and attached: with an add-on exactly if that has a model, which then fits these loops. Not an `enum` of
/// three: to go from one to another would be to copy the loops by way of the stack.
#[derive(Debug)]
struct Stage {
    /// `None`: nothing is known of a vehicle, and its motors are off.
    loops: Option<Loops>,
    /// The loops have the add-on before them.
    adapted: bool,
}

/// The baseline loop with, if a model is attached, the add-on before it.
#[derive(Debug)]
pub struct Flight<'m> {
    stage: Stage,
    add_on: QuadrotorAddOn<'m>,
    wanted: ThrustVector,
    reference: Reference,
    dither: Vector3<f32>,
    clock: Clock,
    /// The newest state that a vehicle can be in.
    state: Option<State>,
    frozen: Frozen,
    /// Why no lane acts: [`GROUNDED`], [`SUSPENDED`]. One byte, since a board has none to spare.
    still: u8,
}

impl<'m> Flight<'m> {
    /// A flight stack that knows no vehicle: its motors are off. It is 12 KB large and all zeros, so a microcontroller has it in
    /// a static and [configures](Flight::configure) it there.
    pub const fn empty() -> Self {
        Self {
            stage: Stage { loops: None, adapted: false },
            add_on: QuadrotorAddOn::empty(),
            wanted: ThrustVector {
                force: Vector3::new(0.0, 0.0, 0.0),
                attitude: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            },
            reference: Reference::ORIGIN,
            dither: Vector3::new(0.0, 0.0, 0.0),
            clock: Clock::EMPTY,
            state: None,
            frozen: Frozen::EMPTY,
            still: 0,
        }
    }

    /// A flight stack on the ground; `None` if no vehicle has these settings ([`Settings::check`] says why). The first setpoint
    /// is that of reference tick 0.
    pub fn new(settings: &Settings) -> Option<Self> {
        let mut flight = Self::empty();
        flight.configure(settings).then_some(flight)
    }

    /// Back on the ground with these settings; `false`, and nothing changes, if no vehicle has them ([`Settings::check`] says
    /// why). An add-on stays, as it was when it was attached but with its lanes off, if its model is for these settings; else it
    /// is detached.
    pub fn configure(&mut self, settings: &Settings) -> bool {
        let Some(loops) = Loops::new(settings) else { return false };
        self.stage.loops = Some(loops);
        self.stage.adapted = self.add_on.model().is_some_and(|model| Self::accepts(model, &settings.rates).is_ok());
        if self.stage.adapted {
            self.add_on.restart(0);
        } else {
            let _ = self.add_on.bypass(quadrotor::signals());
        }
        self.reset();
        true
    }

    /// Back on the ground: the next setpoint is that of reference tick 0, and nothing is left of the last flight but the lanes
    /// that are wanted and the counts.
    pub fn reset(&mut self) {
        if let Some(loops) = &mut self.stage.loops {
            loops.position.reset();
        }
        self.add_on.reset(0);
        (self.wanted, self.reference, self.dither) = (ThrustVector::NONE, Reference::ORIGIN, Vector3::zeros());
        (self.clock, self.state, self.frozen) = (Clock::EMPTY, None, Frozen::EMPTY);
    }

    /// Puts an add-on before the configured loops, with the lanes given, in the place of the one that was there. The trajectory
    /// stays.
    ///
    /// # Errors
    /// If the model is for other signals, another rate, or a longer preview; what was attached then stays. A flight stack without
    /// settings has a rate of 0.
    pub fn attach(&mut self, model: &'m Model<'m>, lanes: Lanes) -> Result<(), Refusal> {
        Self::accepts(model, &self.stage.loops.as_ref().map_or(Rates::NONE, |loops| loops.rates))?;
        self.place(model);
        let (adapter, _) = self.add_on.parts();
        adapter.defer();
        adapter.switch(lanes);
        self.stage.adapted = self.stage.loops.is_some();
        Ok(())
    }

    /// Gives the adapter an accepted model, apart from the check, which needs none of its stack.
    #[inline(never)]
    fn place(&mut self, model: &'m Model<'m>) {
        let sums = self.stage.loops.as_ref().map(|loops| caps::sums(loops.position.gains()));
        let caps = Caps { channels: &caps::CHANNELS, sums: sums.as_ref().map_or(&[], |sums| sums) };
        self.add_on.parts().0.load(model, &quadrotor::signals(), &caps);
    }

    /// Takes the add-on away: the loops fly alone. The trajectory stays.
    pub fn detach(&mut self) {
        let (adapter, _) = self.add_on.parts();
        // The table's references all have the names of desired channels.
        let _ = adapter.bypass(&quadrotor::signals());
        self.stage.adapted = false;
    }

    /// Whether [`Flight::attach`] takes a model, once configured with these rates.
    ///
    /// # Errors
    /// As [`Flight::attach`].
    #[inline(never)]
    pub fn accepts(model: &Model<'_>, rates: &Rates) -> Result<(), Refusal> {
        let caps = Caps { channels: &caps::CHANNELS, sums: &[] };
        QuadrotorAddOn::check(model, quadrotor::signals(), rates.reference_hz(), &caps)
    }

    /// The add-on, if there is one.
    pub fn adapter(&mut self) -> Option<&mut QuadrotorAdapter<'m>> {
        self.stage.adapted.then(|| self.add_on.parts().0)
    }

    /// The reference that the loop tracks now.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Reference tick of a control tick.
    pub fn reference_tick(&self, tick: Tick) -> i32 {
        let divisor = self.stage.loops.as_ref().map_or(NonZeroU32::MIN, |loops| loops.position_divisor);
        self.clock.at(tick.0, divisor).reference
    }

    /// Where the vehicle is desired to be at a control tick, m, world ENU; of the position loop's last tick.
    pub fn desired_position(&self, tick: Tick) -> Vector3<f32> {
        let [x, y, z, ..] = self.add_on.desired(self.reference_tick(tick));
        Vector3::new(x, y, z)
    }

    /// States whether the vehicle is in the air, which a loop that is closed on the ground cannot know: until it is, no lane
    /// acts, and nothing is integrated or learned, in the position loop too. It is from the start on.
    pub fn set_airborne(&mut self, airborne: bool) {
        self.keep_still(GROUNDED, !airborne);
    }

    /// Whether no lane acts for the time being, nor learns or judges anything, as on the ground; the loops fly on.
    pub fn suspend_lanes(&mut self, suspended: bool) {
        if suspended != (self.still & SUSPENDED != 0) {
            self.keep_still(SUSPENDED, suspended);
        }
    }

    fn keep_still(&mut self, why: u8, still: bool) {
        self.still = if still { self.still | why } else { self.still & !why };
        self.add_on.parts().0.set_airborne(self.still == 0);
    }

    /// Whether it is in the air, as far as was said ([`Flight::set_airborne`]).
    pub fn airborne(&self) -> bool {
        self.still & GROUNDED == 0
    }

    /// Adds an offset, m, world ENU, to the position reference from the next reference tick on: the independent dither without
    /// which the closed loop cannot be identified. Zero leaves every bit as it is. One that is further than any vehicle flies
    /// changes nothing.
    pub fn set_dither(&mut self, offset: Vector3<f32>) {
        if within(offset.as_slice(), POSITION_LIMIT) {
            self.dither = offset;
        }
    }

    /// One control tick, the network included. A state that no vehicle can be in ([`State::is_physical`]) is a missed sample: the
    /// one before it stays, and until there has been one the motors are off.
    pub fn step<const S: usize>(&mut self, tick: Tick, state: &State, scratch: &mut Scratch<S>) -> MotorCommand {
        let mut job = Job::EMPTY;
        let (command, released) = self.control_into(tick, state, &mut job);
        if released && let Some(network) = self.add_on.model().and_then(Model::network) {
            self.deliver(job.run(network, scratch));
        }
        command
    }

    /// One control tick without the network, whose job a task of lower priority may do until the next reference tick
    /// ([`Flight::deliver`]): the same bits as [`Flight::step`].
    pub fn control(&mut self, tick: Tick, state: &State) -> (MotorCommand, Option<Job>) {
        let mut job = Job::EMPTY;
        let (command, released) = self.control_into(tick, state, &mut job);
        (command, released.then_some(job))
    }

    /// [`Flight::control`] that puts the job, if there is one, where the caller has room for it: `true`.
    pub fn control_into(&mut self, tick: Tick, state: &State, job: &mut Job) -> (MotorCommand, bool) {
        let Some(state) = self.known(state) else { return (MotorCommand::OFF, false) };
        self.control_known(tick, &state, job)
    }

    /// [`Flight::control_into`] for a state that was checked. What else a tick does needs none of its stack.
    #[inline(never)]
    pub(crate) fn control_known(&mut self, tick: Tick, state: &State, job: &mut Job) -> (MotorCommand, bool) {
        let (wanted, released) = self.position_part(tick, state, job, |_| ());
        if let Some(wanted) = wanted {
            self.wanted = wanted;
        }
        (self.attitude_part(&self.wanted, state), released)
    }

    /// The state, or, if no vehicle can be in it, the last one that a vehicle can be in.
    fn known(&mut self, state: &State) -> Option<State> {
        if state.is_physical() {
            self.state = Some(*state);
        }
        self.state
    }

    /// The first half of a control tick: at a reference tick what the position loop wants of the attitude loop, and whether `job`
    /// was written. In flight [`Flight::control`] hands the one to the other at once; a simulator puts here what it wants to know
    /// the effect of: a command that is late, or, in `path`, a feedback lane of which the loop gets more or less than the lane
    /// knows ([`Adapter::finish_through`]).
    pub fn position_step(
        &mut self,
        tick: Tick,
        state: &State,
        job: &mut Job,
        path: impl FnOnce(&mut [f32; DEFAULT_AXES]),
    ) -> (Option<ThrustVector>, bool) {
        let Some(state) = self.known(state) else { return (None, false) };
        self.position_part(tick, &state, job, path)
    }

    fn position_part(
        &mut self,
        tick: Tick,
        state: &State,
        job: &mut Job,
        path: impl FnOnce(&mut [f32; DEFAULT_AXES]),
    ) -> (Option<ThrustVector>, bool) {
        let Stage { loops: Some(loops), adapted: corrected } = &mut self.stage else { return (None, false) };
        self.clock = self.clock.at(tick.0, loops.position_divisor);
        if self.clock.phase != 0 {
            return (None, false);
        }
        let reference_tick = self.clock.reference;
        let (reference, released) = if *corrected {
            adapted(&mut self.add_on, &mut self.frozen, reference_tick, state, job, path)
        } else {
            (desired(&self.add_on, reference_tick), false)
        };
        self.reference = reference;
        if self.dither != Vector3::zeros() {
            self.reference.position += self.dither;
        }
        if self.still & GROUNDED != 0 {
            loops.position.clear_integral();
        }
        (Some(loops.position.step(&self.reference, state)), released)
    }

    /// Share of the largest thrust that the position loop last asked for, above 1 if it asked for more than there is; 0 if
    /// another loop flies.
    pub fn thrust_share(&self) -> f32 {
        self.stage.loops.as_ref().map_or(0.0, |loops| loops.mixer.share(self.wanted.force.norm()))
    }

    /// The second half of a control tick: what the motors get for what the position loop wants.
    pub fn attitude_step(&mut self, wanted: &ThrustVector, state: &State) -> MotorCommand {
        self.wanted = *wanted;
        match if state.is_physical() { Some(state) } else { self.state.as_ref() } {
            Some(state) => self.attitude_part(wanted, state),
            None => MotorCommand::OFF,
        }
    }

    fn attitude_part(&self, wanted: &ThrustVector, state: &State) -> MotorCommand {
        let Some(loops) = self.stage.loops.as_ref() else { return MotorCommand::OFF };
        let (thrust, moment) = loops.attitude.step(wanted, state);
        loops.mixer.mix(thrust, &moment)
    }

    /// Takes what came of a job of [`Flight::control`].
    pub fn deliver(&mut self, inference: Inference) {
        self.add_on.deliver(inference);
    }
}

/// The corrected reference at a reference tick, and whether the network has a job.
fn adapted(
    add_on: &mut QuadrotorAddOn<'_>,
    frozen: &mut Frozen,
    tick: i32,
    state: &State,
    job: &mut Job,
    path: impl FnOnce(&mut [f32; DEFAULT_AXES]),
) -> (Reference, bool) {
    tell_standing(add_on, frozen, tick, state);
    let measured = quadrotor::measured(state);
    let (adapter, preview) = add_on.parts();
    let released = adapter.begin_into(tick, preview, &measured, job);
    let reference = adapter.finish_through(tick, preview, &measured, path);
    let yaw = preview.channel(tick, DESIRED - 1);
    (quadrotor::reference(&reference, yaw), released)
}

/// Tells the adapter for how long the measured position has stood still. What else a tick does needs none of its stack.
#[inline(never)]
fn tell_standing(add_on: &mut QuadrotorAddOn<'_>, frozen: &mut Frozen, tick: i32, state: &State) {
    let (adapter, preview) = add_on.parts();
    let [vx, vy, vz] = [3, 4, 5].map(|channel| preview.channel(tick, channel));
    adapter.set_standing(frozen.ticks(state, &Vector3::new(vx, vy, vz), adapter.rate_hz()));
}

/// The reference without an add-on at a reference tick. The adapter would give the same bits, but for the state's angles first.
fn desired(add_on: &QuadrotorAddOn<'_>, tick: i32) -> Reference {
    let [px, py, pz, vx, vy, vz, .., yaw] = add_on.desired(tick);
    quadrotor::reference(&[px, py, pz, vx, vy, vz], yaw)
}

#[cfg(test)]
mod tests;
