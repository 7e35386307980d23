//! The constants of the equations, prepared: shared by all members, or of one member.

use super::state::{BATCH, Batch};
use super::vehicle::Vehicle;

/// Acceleration of gravity, m/s², along the world's -z.
pub const GRAVITY: f64 = 9.81;

/// How the vehicle in one member differs from its data: factors on the nominal constants, 1 for none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    /// On the mass; the payload sits in the centre of mass, so that the inertia stays. Positive.
    pub payload_factor: f64,
    /// On the thrust coefficient k_eta, for all rotors alike.
    pub thrust_factor: f64,
    /// On the rotor drag k_d, the inflow drag k_z and the parasitic drag c_D.
    pub drag_factor: f64,
    /// On the motors' time constant. Positive.
    pub motor_lag_factor: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self { payload_factor: 1.0, thrust_factor: 1.0, drag_factor: 1.0, motor_lag_factor: 1.0 }
    }
}

/// What the step reads. Arrays over the rotors are in the vehicle's rotor order.
#[derive(Debug, Clone)]
pub(super) struct Constants {
    /// Rotor positions, m, and their products x x, x y, y y, m².
    pub(super) x: [f64; 4],
    pub(super) y: [f64; 4],
    pub(super) z: [f64; 4],
    pub(super) xx: [f64; 4],
    pub(super) xy: [f64; 4],
    pub(super) yy: [f64; 4],
    /// s_i k_m, N m s²/rad².
    pub(super) torque: [f64; 4],
    /// k_h, kg/m.
    pub(super) lift: f64,
    /// k_h times the sums over the rotors of x, y, x x, x y, y y, d, d x, d y with d = x x + y y.
    pub(super) lift_moments: [f64; 8],
    /// k_flap, kg m/rad.
    pub(super) flapping: f64,
    /// J and its inverse, by rows.
    pub(super) inertia: [[f64; 3]; 3],
    pub(super) inverse_inertia: [[f64; 3]; 3],
    /// For principal axes: 1 / J_x, ... and (J_y - J_z) / J_x, ... in cyclic order.
    pub(super) inverse_principal: [f64; 3],
    pub(super) couple: [f64; 3],
    speed_min: f64,
    speed_max: f64,
    inverse_mass: Batch,
    thrust: Batch,
    drag_xy: Batch,
    drag_z: Batch,
    parasitic: [Batch; 3],
    motor_rate: Batch,
}

/// The constants that differ from member to member.
pub(super) struct MemberConstants {
    /// 1 / m, 1/kg.
    pub(super) inverse_mass: f64,
    /// k_eta, N s²/rad².
    pub(super) thrust: f64,
    /// k_d and k_z, kg/rad.
    pub(super) drag_xy: f64,
    pub(super) drag_z: f64,
    /// c_D, kg/m.
    pub(super) parasitic: [f64; 3],
    /// 1 / tau_m, 1/s.
    pub(super) motor_rate: f64,
}

impl Constants {
    pub(super) fn new(vehicle: &Vehicle, variations: &[Variation; BATCH]) -> Self {
        let position = |axis: usize| vehicle.rotors.map(|rotor| rotor.position[axis]);
        let product = |a: [f64; 4], b: [f64; 4]| std::array::from_fn(|rotor| a[rotor] * b[rotor]);
        let (x, y, z) = (position(0), position(1), position(2));
        let (xx, xy, yy): ([f64; 4], [f64; 4], [f64; 4]) = (product(x, x), product(x, y), product(y, y));
        let distance: [f64; 4] = std::array::from_fn(|rotor| xx[rotor] + yy[rotor]);
        let lift_moments = [x, y, xx, xy, yy, distance, product(distance, x), product(distance, y)]
            .map(|values| vehicle.translational_lift * values.iter().sum::<f64>());
        let inertia = vehicle.inertia.matrix();
        // A vehicle that passed its check has a positive definite inertia.
        let inverse = inertia.try_inverse().unwrap_or_else(nalgebra::Matrix3::zeros);
        let rows =
            |matrix: &nalgebra::Matrix3<f64>| std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]));
        let principal = [vehicle.inertia.xx, vehicle.inertia.yy, vehicle.inertia.zz];
        let members =
            |value: f64, factor: fn(&Variation) -> f64| std::array::from_fn(|member| value * factor(&variations[member]));
        let inverses =
            |value: f64, factor: fn(&Variation) -> f64| std::array::from_fn(|member| 1.0 / (value * factor(&variations[member])));
        Self {
            x,
            y,
            z,
            xx,
            xy,
            yy,
            torque: vehicle.rotors.map(|rotor| f64::from(rotor.direction) * vehicle.torque_coefficient),
            lift: vehicle.translational_lift,
            lift_moments,
            flapping: vehicle.flapping,
            inertia: rows(&inertia),
            inverse_inertia: rows(&inverse),
            inverse_principal: principal.map(|moment| 1.0 / moment),
            couple: std::array::from_fn(|axis| (principal[(axis + 1) % 3] - principal[(axis + 2) % 3]) / principal[axis]),
            speed_min: vehicle.rotor_speed_min,
            speed_max: vehicle.rotor_speed_max,
            inverse_mass: inverses(vehicle.mass, |variation| variation.payload_factor),
            thrust: members(vehicle.thrust_coefficient, |variation| variation.thrust_factor),
            drag_xy: members(vehicle.rotor_drag, |variation| variation.drag_factor),
            drag_z: members(vehicle.inflow_drag, |variation| variation.drag_factor),
            parasitic: vehicle.parasitic_drag.map(|drag| members(drag, |variation| variation.drag_factor)),
            motor_rate: inverses(vehicle.motor_time_constant, |variation| variation.motor_lag_factor),
        }
    }

    /// The constants of one member.
    #[inline(always)]
    pub(super) fn member(&self, member: usize) -> MemberConstants {
        MemberConstants {
            inverse_mass: self.inverse_mass[member],
            thrust: self.thrust[member],
            drag_xy: self.drag_xy[member],
            drag_z: self.drag_z[member],
            parasitic: [self.parasitic[0][member], self.parasitic[1][member], self.parasitic[2][member]],
            motor_rate: self.motor_rate[member],
        }
    }

    /// Commands within the range that the motors accept. Not a number stays so: a broken command must be seen.
    #[inline(always)]
    pub(super) fn clamp(&self, commands: [f64; 4]) -> [f64; 4] {
        commands.map(|command| {
            let command = if command < self.speed_min { self.speed_min } else { command };
            if command > self.speed_max { self.speed_max } else { command }
        })
    }
}
