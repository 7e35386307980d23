//! What a board starts with: the newest model of its slots that it can fly, and the loop of a Crazyflie until it is sent another.

use impromptu_firmware::{
    model::{Model, Refusal},
    network::{Network, Scratch},
    storage::{Sequence, SlotIndex, Survey, newest, survey},
};
use impromptu_flight::{application::Application, autopilot::Learns, flight::Flight, learning::KEPT};
use static_cell::{ConstStaticCell, StaticCell};

use crate::vehicle::CRAZYFLIE;

/// A board that is ready.
pub struct Start<L: 'static> {
    /// For the control task.
    pub application: &'static mut Application<'static, L>,
    /// For the inference task.
    pub network: Option<&'static Network<'static>>,
    /// The slot for the next upload.
    pub spare: SlotIndex,
    /// Its number.
    pub sequence: Sequence,
    /// For the inference and the storage task, neither of which interrupts the other.
    pub scratch: &'static mut Scratch,
}

/// Looks at the slots and sets the application up; once, since what it needs lies in statics. One that learns goes on with the
/// newest in the slot `learned` that was kept of this vehicle and the model that flies. `None`: the airframe cannot be mixed.
#[inline(never)]
pub fn start<L: Learns>(
    application: &'static mut Application<'static, L>,
    slots: [&'static [u8]; 2],
    learned: &[u8],
) -> Option<Start<L>> {
    static SCRATCH: ConstStaticCell<Scratch> = ConstStaticCell::new(Scratch::new());
    let scratch = SCRATCH.take();
    let autopilot = application.autopilot();
    autopilot.configure(&CRAZYFLIE).ok()?;
    let Survey { flies, spare, sequence } = survey(slots, scratch, fits);
    let model = flies.and_then(|stored| model(stored.file(), scratch));
    if let Some(model) = model {
        // It was checked to fit.
        let _ = autopilot.load(model, Some(u8::from(spare == SlotIndex::First)));
    }
    newest::<KEPT>(learned, |kept| autopilot.recall(kept).is_ok());
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
