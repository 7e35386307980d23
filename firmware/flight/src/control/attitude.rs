//! Attitude loop.
//!
//! *in* a thrust vector and a state; *out* collective thrust and moment; *never* a memory of its own, or a moment that is
//! not finite for finite rates; *source* Lee, Leok, McClamroch 2010.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ThrustVector;
use impromptu_firmware::math::clamp;

use crate::types::State;

/// Gains of the attitude loop, common to the three axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AttitudeGains {
    /// Attitude error to angular acceleration, 1/s².
    pub kp: f32,
    /// Body rate to angular acceleration, 1/s.
    pub kd: f32,
}

/// Attitude loop.
#[derive(Clone, Debug)]
pub struct AttitudeLoop {
    gains: AttitudeGains,
    inertia: Vector3<f32>,
}

impl AttitudeLoop {
    /// A loop for a body with these principal moments of inertia, kg m².
    pub fn new(gains: AttitudeGains, inertia: [f32; 3]) -> Self {
        Self { gains, inertia: inertia.into() }
    }

    /// Collective thrust, N, and moment, N m (body FLU): M = J(-kp e_R - kd ω) + ω × Jω,
    /// e_R = vee(RdᵀR - RᵀRd) / 2 (Lee 2010, equations 10 and 16, with gains as angular accelerations).
    pub fn step(&self, wanted: &ThrustVector, state: &State) -> (f32, Vector3<f32>) {
        let attitude: Matrix3<f32> = *state.attitude.to_rotation_matrix().matrix();
        let thrust = wanted.force.dot(&attitude.column(2));
        // vee of the skew part of RdᵀR, from the columns of both: half the sum of their cross products, in body axes.
        let mut error = Vector3::zeros();
        for axis in 0..3 {
            let (next, after) = ((axis + 1) % 3, (axis + 2) % 3);
            error[axis] = 0.5
                * (wanted.attitude.column(after).dot(&attitude.column(next))
                    - wanted.attitude.column(next).dot(&attitude.column(after)));
        }
        // Beyond every gyroscope, so it changes no bit of a flight; the product of larger ones might be infinite.
        let rates = state.rates.map(|rate| clamp(rate, -1e4, 1e4));
        let momentum = self.inertia.component_mul(&rates);
        let acceleration = error * -self.gains.kp - rates * self.gains.kd;
        (thrust, self.inertia.component_mul(&acceleration) + rates.cross(&momentum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finite_rates_give_finite_moments(bits in any::<[u32; 3]>(), angles in prop::array::uniform3(-3.0f32..3.0)) {
            let rates = bits.map(f32::from_bits);
            prop_assume!(rates.iter().all(|x| x.is_finite()));
            let baseline = AttitudeLoop::new(AttitudeGains { kp: 544.0, kd: 46.64 }, [1.43e-5, 1.43e-5, 2.89e-5]);
            let attitude = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
            let state = State { rates: rates.into(), attitude, ..State::ORIGIN };
            let (thrust, moment) = baseline.step(&ThrustVector::NONE, &state);
            prop_assert!(thrust.is_finite() && moment.iter().all(|x| x.is_finite()), "{moment:?}");
        }
    }
}
