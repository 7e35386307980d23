//! A flight stack whose vertical reference is multiplied by 0.5 behind the add-on: a baseline with a DC gain of 0.5 in z.
//!
//! *in* and *out* those of the firmware's flight stack, which flies inside; *never* another loop than the firmware's; *source* Zhou 2017, Fig. 4.

use impromptu_firmware::{
    adapter::{Adapter, Lanes},
    guard::{GuardSettings, Trips},
    model::{Model, Refusal},
    network::Scratch,
    preview::Preview,
};
use impromptu_flight::{
    flight::{Flight, PREVIEW, QuadrotorAdapter, Settings},
    quadrotor::{self, DESIRED, END_RULES},
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use impromptu_sim::rollout::{FaultyFlight, FlightStack};
use nalgebra::Vector3;

/// What the vertical reference is multiplied by.
pub const GAIN: f32 = 0.5;

/// The stack.
pub struct HalfHeight<'m> {
    inside: FaultyFlight<'m>,
    preview: Preview<DESIRED, PREVIEW>,
    adapter: Option<QuadrotorAdapter<'m>>,
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
        let adapter = model
            .map(|model| {
                let mut adapter = Adapter::new(model, quadrotor::signals(), settings.rates.reference_hz(), PREVIEW)?;
                adapter.set_guard(GuardSettings::OFF);
                adapter.switch(Lanes { network: true, feedback: false });
                Ok(adapter)
            })
            .transpose()?;
        let Some(inside) = Flight::new(settings) else { return Ok(None) };
        Ok(Some(Self {
            inside: FaultyFlight::new(inside, 1.0, command_delay),
            preview: Preview::new(END_RULES, 0),
            adapter,
            scratch: Scratch::new(),
            reference: Reference::ORIGIN,
            divisor: settings.rates.position_divisor.max(1),
        }))
    }
}

impl FlightStack for HalfHeight<'_> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        self.preview.push(quadrotor::desired(setpoint));
    }

    fn next_setpoint(&self) -> i32 {
        self.preview.next_tick()
    }

    fn excite(&mut self, _: Vector3<f32>) {}

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        if tick.0.is_multiple_of(self.divisor) {
            let now = (tick.0 / self.divisor) as i32;
            let desired = self.preview.sample(now);
            let [x, y, z, vx, vy, vz, ..] = desired;
            let channels = match &mut self.adapter {
                Some(adapter) => adapter.step(now, &self.preview, &quadrotor::measured(state), &mut self.scratch),
                None => [x, y, z, vx, vy, vz],
            };
            self.reference = quadrotor::reference(&channels, desired[9]);
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
