//! Rigid-body motion and the vector algebra of its equations, of one vehicle.
//!
//! Everything is inlined into the loop over the members, where each scalar becomes a vector of eight flights.

/// What moves and turns, of one vehicle: the state without position and rotors. Its derivative has the same shape.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    pub(super) velocity: [f64; 3],
    pub(super) attitude: [f64; 4],
    pub(super) body_rates: [f64; 3],
}

impl Motion {
    /// Self + factor * rate.
    #[inline(always)]
    pub(super) fn advance(&self, rate: &Self, factor: f64) -> Self {
        let ([vx, vy, vz], [p, q, r]) = (self.velocity, self.body_rates);
        let [qw, qx, qy, qz] = self.attitude;
        Self {
            velocity: [vx + factor * rate.velocity[0], vy + factor * rate.velocity[1], vz + factor * rate.velocity[2]],
            attitude: [
                qw + factor * rate.attitude[0],
                qx + factor * rate.attitude[1],
                qy + factor * rate.attitude[2],
                qz + factor * rate.attitude[3],
            ],
            body_rates: [p + factor * rate.body_rates[0], q + factor * rate.body_rates[1], r + factor * rate.body_rates[2]],
        }
    }

    /// Self + 2 b + 2 c + d: six times the Runge-Kutta mean of four derivatives.
    #[inline(always)]
    pub(super) fn weighted_sum(&self, b: &Self, c: &Self, d: &Self) -> Self {
        #[inline(always)]
        fn sum<const N: usize>(a: &[f64; N], b: &[f64; N], c: &[f64; N], d: &[f64; N]) -> [f64; N] {
            let mut sum = [0.0; N];
            for i in 0..N {
                sum[i] = (a[i] + d[i]) + 2.0 * (b[i] + c[i]);
            }
            sum
        }
        Self {
            velocity: sum(&self.velocity, &b.velocity, &c.velocity, &d.velocity),
            attitude: sum(&self.attitude, &b.attitude, &c.attitude, &d.attitude),
            body_rates: sum(&self.body_rates, &b.body_rates, &c.body_rates, &d.body_rates),
        }
    }
}

/// Rotation body to world of a quaternion of any length: the matrix of the normalised quaternion, by rows.
pub(super) struct Rotation([[f64; 3]; 3]);

impl Rotation {
    #[inline(always)]
    pub(super) fn new(&[w, x, y, z]: &[f64; 4]) -> Self {
        let scale = 2.0 / ((w * w + x * x) + (y * y + z * z));
        let (sx, sy, sz) = (scale * x, scale * y, scale * z);
        let (xx, yy, zz) = (x * sx, y * sy, z * sz);
        let (xy, xz, yz) = (x * sy, x * sz, y * sz);
        let (wx, wy, wz) = (w * sx, w * sy, w * sz);
        Self([[1.0 - (yy + zz), xy - wz, xz + wy], [xy + wz, 1.0 - (xx + zz), yz - wx], [xz - wy, yz + wx, 1.0 - (xx + yy)]])
    }

    #[inline(always)]
    pub(super) fn to_world(&self, v: &[f64; 3]) -> [f64; 3] {
        multiply(&self.0, v)
    }

    #[inline(always)]
    pub(super) fn to_body(&self, v: &[f64; 3]) -> [f64; 3] {
        let [a, b, c] = &self.0;
        [
            a[0] * v[0] + b[0] * v[1] + c[0] * v[2],
            a[1] * v[0] + b[1] * v[1] + c[1] * v[2],
            a[2] * v[0] + b[2] * v[1] + c[2] * v[2],
        ]
    }
}

/// Matrix (by rows) times vector.
#[inline(always)]
pub(super) fn multiply(m: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    [
        m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
        m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
        m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2],
    ]
}

/// Vector product a x b.
#[inline(always)]
pub(super) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Sum over the rotors of a times b.
#[inline(always)]
pub(super) fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// Sum over the rotors.
#[inline(always)]
pub(super) fn total(a: &[f64; 4]) -> f64 {
    (a[0] + a[1]) + (a[2] + a[3])
}
