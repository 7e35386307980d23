//! The computation that is compared with the host's: an attitude, turned tick by tick.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Seconds for each tick (500 Hz, the attitude loop's rate).
const TICK: f32 = 0.002;

/// Turns `attitude` (body to world, Hamilton) by the body rate `rate` (rad/s, body FLU) over one tick.
pub(crate) fn step(attitude: &UnitQuaternion<f32>, rate: &Vector3<f32>) -> UnitQuaternion<f32> {
    let turned = attitude * UnitQuaternion::from_scaled_axis(rate * TICK);
    let Quaternion { coords } = *turned.quaternion();
    UnitQuaternion::new_unchecked(Quaternion::from(coords / libm::sqrtf(coords.norm_squared())))
}
