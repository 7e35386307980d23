//! What the board starts with: a model, if the emulator's folder holds one, and the loop of a Crazyflie until the host sends another.

use impromptu_board::CRAZYFLIE;
use impromptu_firmware::{
    application::Application,
    model::{Model, Place},
    network::Network,
};
use semihosting::{
    fs::File,
    io::{self, Read, Write},
    process,
};
use static_cell::{ConstStaticCell, StaticCell};

/// Most bytes of a model file: what an int8 network of four layers of 128 units has, and as much again.
const MODEL_BYTES: usize = 72 * 1024;

/// The application, and the network for its own task.
pub(crate) fn application() -> (&'static mut Application<'static>, Option<&'static Network<'static>>) {
    static APPLICATION: ConstStaticCell<Application<'static>> = ConstStaticCell::new(Application::new());
    let model = model();
    let application = APPLICATION.take();
    let autopilot = application.autopilot();
    if autopilot.configure(&CRAZYFLIE).is_err() {
        fail("the airframe cannot be mixed");
    }
    if let Some(model) = model
        && autopilot.load(model, None).is_err()
    {
        fail("model.impromptu is not for this flight stack; `inspect` it");
    }
    (application, model.and_then(Model::network))
}

/// The model of the emulator's folder.
#[inline(never)]
fn model() -> Option<&'static Model<'static>> {
    // Made in place: on the stack there is no room for it.
    static IMPROMPTU_WEIGHTS: ConstStaticCell<Place<MODEL_BYTES>> = ConstStaticCell::new(Place::new());
    static MODEL: StaticCell<Model<'static>> = StaticCell::new();
    let mut file = File::open(c"model.impromptu").ok()?;
    let place = IMPROMPTU_WEIGHTS.take();
    let held = place.fill(|bytes| {
        let mut length = 0;
        while let Some(rest) = bytes.get_mut(length..).filter(|rest| !rest.is_empty()) {
            match file.read(rest) {
                Ok(0) => break,
                Ok(read) => length += read,
                Err(_) => fail("model.impromptu cannot be read"),
            }
        }
        length
    });
    match Model::from_bytes(held) {
        Ok(model) => Some(MODEL.init(model)),
        // In words it would take 30 KB of flash.
        Err(_) => fail("model.impromptu is refused; `inspect` says why"),
    }
}

fn fail(reason: &str) -> ! {
    // Formatting takes 10 KB of flash.
    if let Ok(mut stderr) = io::stderr() {
        let _ = ["emulated: ", reason, "\n"].map(|text| stderr.write_all(text.as_bytes()));
    }
    process::exit(1)
}
