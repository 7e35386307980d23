//! A flight stack whose vertical reference is multiplied by 0.5 behind the add-on: a baseline with a DC gain of 0.5 in z.
//!
//! *in* and *out* those of the firmware's flight stack, which flies inside; *never* another loop than the firmware's; *source*
//! Zhou 2017, Fig. 4.

use impromptu_firmware::{
    AddOn,
    adapter::Lanes,
    caps::Caps,
    guard::{GuardSettings, Trips},
    model::{Model, Refusal},
    network::Scratch,
};
use impromptu_flight::{
    caps,
    flight::{Flight, PREVIEW, Settings},
    quadrotor::{self, DESIRED, MEASURED, REFERENCE},
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use impromptu_sim::rollout::{FaultyFlight, FlightStack};
use nalgebra::Vector3;

/// What the vertical reference is multiplied by.
pub const GAIN: f32 = 0.5;

/// The stack.
pub struct HalfHeight<'m> {
    inside: FaultyFlight<'m>,
    add_on: AddOn<'m, DESIRED, MEASURED, REFERENCE, PREVIEW>,
    scratch: Scratch,
    reference: Reference,
    divisor: u32,
}

impl<'m> HalfHeight<'m> {
    /// A stack with the command delay in control ticks, and an add-on if given; `None` if the airframe cannot be mixed.
    ///
    /// # Errors
    /// If the model is refused.
    pub fn new(settings: &Settings, command_delay: u32, model: Option<&'m Model<'m>>) -> Result<Option<Self>, Refusal> {
        let (mut add_on, signals) = (AddOn::empty(), quadrotor::signals());
        match model {
            Some(model) => {
                let sums = caps::sums(&settings.position);
                let caps = Caps { channels: &caps::CHANNELS, sums: &sums };
                add_on.load(model, signals, settings.rates.reference_hz(), &caps)?;
                add_on.set_guard(GuardSettings::OFF);
                add_on.switch(Lanes { network: true, feedback: false });
            }
            None => add_on.bypass(signals)?,
        }
        let Some(inside) = Flight::new(settings) else { return Ok(None) };
        Ok(Some(Self {
            inside: FaultyFlight::new(inside, 1.0, command_delay),
            add_on,
            scratch: Scratch::new(),
            reference: Reference::ORIGIN,
            divisor: settings.rates.position_divisor.max(1),
        }))
    }
}

impl FlightStack for HalfHeight<'_> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        self.add_on.push(quadrotor::desired(setpoint)).expect("trajectories are finite");
    }

    fn next_setpoint(&self) -> i32 {
        self.add_on.next_tick()
    }

    fn set_dither(&mut self, _: Vector3<f32>) {}

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        if tick.0.is_multiple_of(self.divisor) {
            let now = (tick.0 / self.divisor) as i32;
            let yaw = self.add_on.desired(now)[9];
            let channels = self.add_on.step(now, &quadrotor::measured(state), &mut self.scratch);
            self.reference = quadrotor::reference(&channels, yaw);
            let halved = |vector: &Vector3<f32>| Vector3::new(vector.x, vector.y, GAIN * vector.z);
            self.inside.flight.push_setpoint(&Setpoint {
                position: halved(&self.reference.position),
                velocity: halved(&self.reference.velocity),
                acceleration: Vector3::zeros(),
                yaw: self.reference.yaw,
            });
        }
        self.inside.step(tick, state, &mut self.scratch)
    }

    fn reference(&self) -> &Reference {
        &self.reference
    }

    fn trips(&mut self) -> Trips {
        Trips::default()
    }
}
