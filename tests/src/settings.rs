//! What the flight stack must survive: any settings, states, setpoints and commands.
//!
//! *in* bytes that say which; *out* how many settings were taken and ticks flown by them; *never* a panic, settings that no
//! vehicle has, a motor command outside of 0..=1, a reference that is not finite, or a refused value that changed something: that
//! is what the fuzz target and the test on stable Rust look for.
//!
//! Beside each vehicle stands another one that is not told what the first one refuses: both fly alike, to the bit.

mod flights;
mod lines;
mod vehicle;

use crate::bytes::Bytes;
use flights::Flights;
use lines::Lines;
pub use vehicle::crazyflie;

/// Flies as the bytes say, by calls and by the link; gives how many settings were taken and ticks flown.
pub fn survive(bytes: &[u8]) -> [usize; 2] {
    let mut bytes = Bytes(bytes);
    match bytes.choice(2) {
        0 => Flights::new().fly(&mut bytes),
        _ => Lines::new().fly(&mut bytes),
    }
}
