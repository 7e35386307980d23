//! State-space model of the tracking error, for the Riccati equation and for stability.
//!
//! in: an ARX model of the closed baseline loop; out: dynamics of lagged errors, past outputs and integral; never: the
//! desired trajectory, which cancels: the network lane's residual is one more disturbance.

use nalgebra::{Complex, DMatrix, DVector};

use super::identification::{ArxModel, OutputEquation};
use super::lane::polynomial;

/// `x(k+1) = dynamics x(k) + input u(k)` with
/// x(k) = (e_p(k..k-lags+1), e_v(k..k-lags+1), u(k-1..k-lags+1), I(k)), 3 lags elements, and I(k+1) = I(k) + tick e_p(k).
#[derive(Clone, Debug)]
pub struct ErrorModel {
    /// Square, 3 lags rows.
    pub dynamics: DMatrix<f64>,
    /// Effect of the lane's output, added to the position reference.
    pub input: DVector<f64>,
}

impl ErrorModel {
    /// Errors of the loop that `model` describes, with a state of `lags` (at least those of the model) and a tick in s.
    pub fn new(model: &ArxModel, lags: usize, tick: f64) -> Self {
        let size = 3 * lags;
        let (velocity, output, integral) = (lags, 2 * lags, size - 1);
        let mut dynamics = DMatrix::zeros(size, size);
        let mut input = DVector::zeros(size);
        for (row, equation) in [(0, &model.position), (velocity, &model.velocity)] {
            for lag in 0..model.lags() {
                dynamics[(row, lag)] = equation.position[lag];
                dynamics[(row, velocity + lag)] = equation.velocity[lag];
                if lag > 0 {
                    dynamics[(row, output + lag - 1)] = equation.reference_position[lag];
                }
            }
            input[row] = equation.reference_position[0];
        }
        for lag in 1..lags {
            dynamics[(lag, lag - 1)] = 1.0;
            dynamics[(velocity + lag, velocity + lag - 1)] = 1.0;
        }
        for lag in 1..lags - 1 {
            dynamics[(output + lag, output + lag - 1)] = 1.0;
        }
        if lags > 1 {
            input[output] = 1.0;
        }
        dynamics[(integral, integral)] = 1.0;
        dynamics[(integral, 0)] = tick;
        Self { dynamics, input }
    }
}

/// Frequency response from the position reference to the measured position and velocity, at `z` = exp(j w tick).
pub(super) fn reference_response(model: &ArxModel, z: Complex<f64>) -> [Complex<f64>; 2] {
    let delay = z.inv();
    let row = |equation: &OutputEquation| {
        [
            polynomial(&equation.position, delay),
            polynomial(&equation.velocity, delay),
            polynomial(&equation.reference_position, delay),
        ]
    };
    let [pp, pv, pr] = row(&model.position);
    let [vp, vv, vr] = row(&model.velocity);
    let (pp, vv) = (z - pp, z - vv);
    let determinant = pp * vv - pv * vp;
    [(pr * vv + pv * vr) / determinant, (pp * vr + vp * pr) / determinant]
}
