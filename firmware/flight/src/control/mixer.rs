//! Mixer: thrust and moment to rotor speeds.
//!
//! *in* collective thrust, N, and moment, N m, body FLU; *out* fractions of the largest rotor speed; *never* one outside of
//! 0..=1; *source* thrust and reaction torque proportional to the squared rotor speed.

use nalgebra::{Matrix4, Vector3, Vector4};

use super::{Airframe, GRAVITY};
use impromptu_firmware::math;

use crate::types::MotorCommand;

/// Inverse of the map from rotor thrusts to collective thrust and moment.
#[derive(Clone, Debug)]
pub struct Mixer {
    inverse: Matrix4<f32>,
    /// Squared speed fraction for a rotor thrust of 1 N.
    fraction_squared: f32,
}

impl Mixer {
    /// Mixer of an airframe; `None` if its rotors cannot produce every moment.
    pub fn new(airframe: &Airframe) -> Option<Self> {
        let ratio = airframe.torque_coefficient / airframe.thrust_coefficient;
        let columns: [Vector4<f32>; 4] = core::array::from_fn(|rotor| {
            let [x, y] = airframe.rotors[rotor];
            Vector4::new(1.0, y, -x, airframe.directions[rotor] * ratio)
        });
        let largest = airframe.thrust_coefficient * airframe.max_rotor_speed * airframe.max_rotor_speed;
        let inverse = Matrix4::from_columns(&columns).try_inverse()?;
        let fraction_squared = 1.0 / largest;
        (inverse.iter().all(|x| x.is_finite()) && largest.is_normal() && fraction_squared.is_finite())
            .then_some(Self { inverse, fraction_squared })
    }

    /// The share of its largest thrust that each rotor gives in hover; negative or above 1 if it cannot.
    pub fn hover_shares(&self, mass: f32) -> [f32; 4] {
        self.rotor_thrusts(mass * GRAVITY, &Vector3::zeros()).map(|force| force * self.fraction_squared)
    }

    /// The share of the largest thrust of all rotors that a collective thrust, N, is.
    pub fn share(&self, thrust: f32) -> f32 {
        0.25 * thrust * self.fraction_squared
    }

    /// How much thrust of a rotor a unit of moment takes at most, as a multiple of what a rotor with nothing else to do would
    /// need: about a third for four rotors in a square, without bound for rotors that can hardly produce some moment.
    pub fn effort(&self, airframe: &Airframe) -> f32 {
        let arm = airframe.rotors.iter().fold(0.0, |longest: f32, [x, y]| longest.max(math::sqrt(x * x + y * y)));
        let ratio = airframe.torque_coefficient / airframe.thrust_coefficient;
        let column =
            |index: usize, scale: f32| self.inverse.column(index).iter().fold(0.0, |m: f32, x| m.max(math::abs(x * scale)));
        column(1, arm).max(column(2, arm)).max(column(3, ratio))
    }

    /// Thrust of each rotor, N, before any limit.
    pub fn rotor_thrusts(&self, thrust: f32, moment: &Vector3<f32>) -> [f32; 4] {
        (self.inverse * Vector4::new(thrust, moment.x, moment.y, moment.z)).into()
    }

    /// Rotor speeds for a collective thrust, N, and a moment, N m. Thrusts that a rotor cannot give are clipped.
    pub fn mix(&self, thrust: f32, moment: &Vector3<f32>) -> MotorCommand {
        MotorCommand::saturated(self.rotor_thrusts(thrust, moment).map(|force| {
            let squared = force * self.fraction_squared;
            if squared > 0.0 { math::sqrt(squared) } else { 0.0 }
        }))
    }
}
