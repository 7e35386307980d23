//! What a board starts with: the newest model of its slots that it can fly, and the loop of a Crazyflie until it is sent another.

use impromptu_firmware::{
    model::{Model, Refusal},
    network::{Network, Scratch},
    storage::{Sequence, SlotIndex, Survey, survey},
};
use impromptu_flight::{application::Application, flight::Flight};
use static_cell::{ConstStaticCell, StaticCell};

use crate::vehicle::CRAZYFLIE;

/// A board that is ready.
pub struct Start {
    /// For the control task.
    pub application: &'static mut Application<'static>,
    /// For the inference task.
    pub network: Option<&'static Network<'static>>,
    /// The slot for the next upload.
    pub spare: SlotIndex,
    /// Its number.
    pub sequence: Sequence,
    /// For the inference and the storage task, neither of which interrupts the other.
    pub scratch: &'static mut Scratch,
}

/// Looks at the slots and sets the application up; once, since it lies in a static. `None`: the airframe cannot be mixed.
#[inline(never)]
pub fn start(slots: [&'static [u8]; 2]) -> Option<Start> {
    static APPLICATION: ConstStaticCell<Application<'static>> = ConstStaticCell::new(Application::new());
    static SCRATCH: ConstStaticCell<Scratch> = ConstStaticCell::new(Scratch::new());
    let (application, scratch) = (APPLICATION.take(), SCRATCH.take());
    let autopilot = application.autopilot();
    autopilot.configure(&CRAZYFLIE).ok()?;
    let Survey { flies, spare, sequence } = survey(slots, scratch, fits);
    let model = flies.and_then(|stored| model(stored.file(), scratch));
    if let Some(model) = model {
        // It was checked to fit.
        let _ = autopilot.load(model, Some(u8::from(spare == SlotIndex::First)));
    }
    Some(Start { application, network: model.and_then(Model::network), spare, sequence, scratch })
}

/// Whether a model is for this vehicle.
///
/// # Errors
/// If its signals, rate or preview are others.
pub fn fits(model: &Model<'_>) -> Result<(), Refusal> {
    Flight::accepts(model, &CRAZYFLIE.rates)
}

#[inline(never)]
fn model(file: &'static [u8], scratch: &mut Scratch) -> Option<&'static Model<'static>> {
    static MODEL: StaticCell<Model<'static>> = StaticCell::new();
    Model::load_into(MODEL.init_with(Model::empty), file, scratch).ok()
}
