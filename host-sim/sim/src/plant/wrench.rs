//! Forces and moments of rotors and air on one vehicle, and the accelerations that follow.

use super::constants::{Constants, GRAVITY, MemberConstants};
use super::motion::{Motion, Rotation, cross, dot, multiply, total};

/// Force and moment on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force, N, body FLU.
    pub force: [f64; 3],
    /// Moment about the centre of mass, N m, body FLU.
    pub moment: [f64; 3],
}

/// The terms of the equations that a kind of vehicle has.
pub(super) trait Model {
    /// Wrench of rotors and air. `air`: airspeed v_a, m/s, body; `rates`: w, rad/s, body; `speeds`: O_i, rad/s.
    fn wrench(shared: &Constants, own: &MemberConstants, air: &[f64; 3], rates: &[f64; 3], speeds: &[f64; 4]) -> Wrench;

    /// J^-1 (M - w x J w), rad/s², body.
    fn angular_acceleration(shared: &Constants, moment: &[f64; 3], rates: &[f64; 3]) -> [f64; 3];
}

/// The derivative of velocity, attitude and body rates. `wind` (m/s) and `pushed` (m/s²) are world ENU.
#[inline(always)]
pub(super) fn derivative<M: Model>(
    shared: &Constants,
    own: &MemberConstants,
    motion: &Motion,
    speeds: &[f64; 4],
    wind: &[f64; 3],
    pushed: &[f64; 3],
) -> Motion {
    let v = &motion.velocity;
    let rotation = Rotation::new(&motion.attitude);
    let air = rotation.to_body(&[v[0] - wind[0], v[1] - wind[1], v[2] - wind[2]]);
    let Wrench { force, moment } = M::wrench(shared, own, &air, &motion.body_rates, speeds);
    let force = rotation.to_world(&force);
    let [w, x, y, z] = motion.attitude;
    let [p, q, r] = motion.body_rates;
    let (hp, hq, hr) = (0.5 * p, 0.5 * q, 0.5 * r);
    Motion {
        velocity: [
            force[0] * own.inverse_mass + pushed[0],
            force[1] * own.inverse_mass + pushed[1],
            force[2] * own.inverse_mass + (pushed[2] - GRAVITY),
        ],
        attitude: [-(x * hp + y * hq + z * hr), w * hp + y * hr - z * hq, w * hq + z * hp - x * hr, w * hr + x * hq - y * hp],
        body_rates: M::angular_acceleration(shared, &moment, &motion.body_rates),
    }
}

/// Rotors in the plane of the centre of mass, principal axes, no flapping and no parasitic drag: the sums over the
/// rotors collapse into moments of the speeds over the rotor positions.
pub(super) struct Planar<const LIFT: bool>;

impl<const LIFT: bool> Model for Planar<LIFT> {
    #[inline(always)]
    fn wrench(
        shared: &Constants,
        own: &MemberConstants,
        &[ax, ay, az]: &[f64; 3],
        &[p, q, r]: &[f64; 3],
        speeds: &[f64; 4],
    ) -> Wrench {
        let squares = [speeds[0] * speeds[0], speeds[1] * speeds[1], speeds[2] * speeds[2], speeds[3] * speeds[3]];
        // Moments of the speeds: sum O, sum O x, sum O y, sum O x^2, sum O x y, sum O y^2.
        let s = total(speeds);
        let (sx, sy) = (dot(speeds, &shared.x), dot(speeds, &shared.y));
        let sxx = dot(speeds, &shared.xx);
        let sxy = dot(speeds, &shared.xy);
        let syy = dot(speeds, &shared.yy);
        // With v_i = (ax - r y, ay + r x, az + p y - q x):
        let mut lift = own.thrust * total(&squares) - own.drag_z * (s * az + p * sy - q * sx);
        let mut roll = own.thrust * dot(&squares, &shared.y) - own.drag_z * (sy * az + p * syy - q * sxy);
        let mut pitch = own.drag_z * (sx * az + p * sxy - q * sxx) - own.thrust * dot(&squares, &shared.x);
        if LIFT {
            let square = ax * ax + ay * ay;
            let (turn, rr) = (2.0 * r, r * r);
            let [gx, gy, gxx, gxy, gyy, g, gsx, gsy] = shared.lift_moments;
            lift += shared.lift * 4.0 * square + turn * (ay * gx - ax * gy) + rr * g;
            roll += square * gy + turn * (ay * gxy - ax * gyy) + rr * gsy;
            pitch -= square * gx + turn * (ay * gxx - ax * gxy) + rr * gsx;
        }
        Wrench {
            force: [own.drag_xy * (r * sy - s * ax), -own.drag_xy * (s * ay + r * sx), lift],
            moment: [roll, pitch, dot(&squares, &shared.torque) - own.drag_xy * (sx * ay - sy * ax + r * (sxx + syy))],
        }
    }

    #[inline(always)]
    fn angular_acceleration(shared: &Constants, moment: &[f64; 3], &[p, q, r]: &[f64; 3]) -> [f64; 3] {
        let (inverse, couple) = (&shared.inverse_principal, &shared.couple);
        [
            moment[0] * inverse[0] + couple[0] * (q * r),
            moment[1] * inverse[1] + couple[1] * (r * p),
            moment[2] * inverse[2] + couple[2] * (p * q),
        ]
    }
}

/// Every term, rotor by rotor.
pub(super) struct Full;

impl Model for Full {
    #[inline(always)]
    fn wrench(shared: &Constants, own: &MemberConstants, air: &[f64; 3], rates: &[f64; 3], speeds: &[f64; 4]) -> Wrench {
        let airspeed = (air[0] * air[0] + air[1] * air[1] + air[2] * air[2]).sqrt();
        let mut force =
            [-airspeed * own.parasitic[0] * air[0], -airspeed * own.parasitic[1] * air[1], -airspeed * own.parasitic[2] * air[2]];
        let mut moment = [0.0; 3];
        for (rotor, &speed) in speeds.iter().enumerate() {
            let position = [shared.x[rotor], shared.y[rotor], shared.z[rotor]];
            let turning = cross(rates, &position);
            let local = [air[0] + turning[0], air[1] + turning[1], air[2] + turning[2]];
            let square = speed * speed;
            let push = [
                -own.drag_xy * speed * local[0],
                -own.drag_xy * speed * local[1],
                own.thrust * square - own.drag_z * speed * local[2] + shared.lift * (local[0] * local[0] + local[1] * local[1]),
            ];
            let lever = cross(&position, &push);
            let flap = shared.flapping * speed;
            for axis in 0..3 {
                force[axis] += push[axis];
            }
            moment[0] += lever[0] - flap * local[1];
            moment[1] += lever[1] + flap * local[0];
            moment[2] += lever[2] + shared.torque[rotor] * square;
        }
        Wrench { force, moment }
    }

    #[inline(always)]
    fn angular_acceleration(shared: &Constants, moment: &[f64; 3], rates: &[f64; 3]) -> [f64; 3] {
        let gyration = cross(rates, &multiply(&shared.inertia, rates));
        multiply(&shared.inverse_inertia, &[moment[0] - gyration[0], moment[1] - gyration[1], moment[2] - gyration[2]])
    }
}
