//! A servo with friction, without and with the add-on: `cargo run -p impromptu-firmware --example one_axis`.
//!
//! The model beside this file was trained on logs of this servo; a test of the workspace makes it again, byte for byte.

#[path = "one_axis/servo.rs"]
pub(crate) mod servo;

use std::error::Error;

use impromptu_firmware::{adapter::Lanes, add_on::AddOn, model::Model, network::Scratch};
use servo::{CAPS, RATE_HZ, SIGNALS, Servo, TrackingError, desired};

/// What training left.
const MODEL: &[u8] = include_bytes!("one_axis.impromptu");
/// Ticks of a flight: 20 s.
const TICKS: i32 = 20 * RATE_HZ as i32;

/// Follows the trajectory with these lanes.
pub(crate) fn fly(lanes: Lanes) -> Result<TrackingError, Box<dyn Error>> {
    let model = Model::from_bytes(MODEL)?;
    let mut add_on = AddOn::<1, 1, 1, 128>::new(&model, SIGNALS, RATE_HZ, &CAPS)?;
    let ahead = model.card().preview_span().1 as i32;
    let mut scratch = Scratch::new();
    add_on.switch(lanes);
    let (mut servo, mut error) = (Servo::new(), TrackingError::new());
    for tick in 0..TICKS {
        while add_on.next_tick() <= tick + ahead {
            add_on.push([desired(add_on.next_tick())])?;
        }
        error.add(servo.angle(), desired(tick));
        let [reference] = add_on.step(tick, &[servo.angle()], &mut scratch);
        servo.track(reference);
    }
    Ok(error)
}

/// Prints both errors.
pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    for (name, lanes) in [("the loop alone", Lanes::NONE), ("with the add-on", Lanes::BOTH)] {
        let [mean, largest] = fly(lanes)?.degrees();
        println!("{name}: {mean:.2} degrees RMS, {largest:.2} at most");
    }
    Ok(())
}
