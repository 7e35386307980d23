//! Attitude loop.
//!
//! *in* a thrust vector and a state; *out* collective thrust and moment; *never* a memory of its own; *source* Lee, Leok,
//! McClamroch 2010.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ThrustVector;
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
        let rates = state.rates;
        let momentum = self.inertia.component_mul(&rates);
        let acceleration = error * -self.gains.kp - rates * self.gains.kd;
        (thrust, self.inertia.component_mul(&acceleration) + rates.cross(&momentum))
    }
}
