//! The linear-quadratic-Gaussian limit: the least error that any feedback on the reference could leave at hover.
//!
//! *in* an axis of the loop at hover, the control weight; *out* the variance of the true position error; *never* a gain or a filter whose closed loop
//! is unstable; *source* Åström and Wittenmark, Computer-Controlled Systems, chapter 11: linear-quadratic regulator, Kalman filter that uses
//! the newest measurement, Lyapunov equation of both together.

use impromptu_training::feedback_design::riccati;
use nalgebra::{DMatrix, DVector, Matrix2, RowDVector};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::hover::{HoverAxis, POSITION};

/// A regulator with its filter, and what they leave.
#[derive(Clone, Debug)]
pub struct Limit {
    /// Feedback on the estimate: r = -gain x.
    pub gain: RowDVector<f64>,
    /// Kalman gain of the newest measurement, n x 2.
    pub filter: DMatrix<f64>,
    /// Expected square of the position error, m².
    pub variance: f64,
    /// Expected square of the correction, m².
    pub mean_square_control: f64,
}

/// Iterations of the filter's Riccati equation: at 100 Hz more than five minutes of flight.
const ITERATIONS: usize = 40_000;

/// Steady covariance of `x(k+1) = dynamics x(k) + w`, by doubling; nothing if it grows without bound.
pub fn lyapunov(dynamics: &DMatrix<f64>, added: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (mut power, mut sum) = (dynamics.clone(), added.clone());
    for _ in 0..40 {
        let growth = &power * &sum * power.transpose();
        sum += &growth;
        if !sum.norm().is_finite() {
            return None;
        }
        if growth.norm() <= 1e-14 * sum.norm() {
            return Some(sum);
        }
        power = &power * &power;
    }
    None
}

/// The loop from tick to tick when it is fed with its own measurements.
fn closed(axis: &HoverAxis) -> DMatrix<f64> {
    &axis.dynamics + &axis.from_measurement * &axis.measurement
}

fn noise(axis: &HoverAxis) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_row_slice(&axis.noise))
}

/// Expected square of the position error without any add-on, m²; nothing if the loop is unstable.
pub fn baseline_variance(axis: &HoverAxis) -> Option<f64> {
    let added = &axis.process + &axis.from_measurement * noise(axis) * axis.from_measurement.transpose();
    lyapunov(&closed(axis), &added).map(|covariance| covariance[(POSITION, POSITION)])
}

/// Steady Kalman gain for the newest measurement.
fn filter(axis: &HoverAxis) -> Option<DMatrix<f64>> {
    let (a, c) = (&axis.dynamics, &axis.measurement);
    let mut prior = axis.process.clone();
    for _ in 0..ITERATIONS {
        let seen = c * &prior;
        let innovation = Matrix2::from_iterator((&seen * c.transpose() + noise(axis)).iter().copied());
        let gain = seen.transpose() * DMatrix::from_iterator(2, 2, innovation.try_inverse()?.iter().copied());
        let posterior = &prior - &gain * &seen;
        let next = a * posterior * a.transpose() + &axis.process;
        let next = (&next + next.transpose()) * 0.5;
        let change = (&next - &prior).norm();
        let size = next.norm();
        prior = next;
        if !size.is_finite() {
            return None;
        }
        if change <= 1e-13 * size {
            return Some(gain);
        }
    }
    None
}

/// The limit at a control weight (weight on r², per m², beside 1 on the square of the position error); nothing if the equations have no solution.
pub fn limit(axis: &HoverAxis, control_weight: f64) -> Option<Limit> {
    let size = axis.dynamics.nrows();
    let mut weight = DMatrix::zeros(size, size);
    weight[(POSITION, POSITION)] = 1.0;
    let closed = closed(axis);
    let gain = riccati::solve(&closed, &axis.input, &weight, control_weight)?.gain;
    let filter = filter(axis)?;

    // State and error of the prior estimate; e_f = (I - L C) e - L n, r = -K x + K e_f.
    let corrected = DMatrix::identity(size, size) - &filter * &axis.measurement;
    let actuated = &axis.input * &gain;
    let mut joint = DMatrix::zeros(2 * size, 2 * size);
    joint.view_mut((0, 0), (size, size)).copy_from(&(&closed - &actuated));
    joint.view_mut((0, size), (size, size)).copy_from(&(&actuated * &corrected));
    joint.view_mut((size, size), (size, size)).copy_from(&(&axis.dynamics * &corrected));
    let mut from_noise = DMatrix::zeros(2 * size, 2);
    from_noise.view_mut((0, 0), (size, 2)).copy_from(&(&axis.from_measurement - &actuated * &filter));
    from_noise.view_mut((size, 0), (size, 2)).copy_from(&(-(&axis.dynamics * &filter)));
    let mut added = &from_noise * noise(axis) * from_noise.transpose();
    for (row, column) in [(0, 0), (0, size), (size, 0), (size, size)] {
        let mut block = added.view_mut((row, column), (size, size));
        block += &axis.process;
    }
    let covariance = lyapunov(&joint, &added)?;
    let mut of_output = RowDVector::zeros(2 * size);
    of_output.columns_mut(0, size).copy_from(&(-&gain));
    of_output.columns_mut(size, size).copy_from(&(&gain * &corrected));
    let through_noise = &gain * &filter;
    let mean_square_control =
        (&of_output * &covariance * of_output.transpose())[0] + (&through_noise * noise(axis) * through_noise.transpose())[0];
    Some(Limit { variance: covariance[(POSITION, POSITION)], mean_square_control, gain, filter })
}

/// Mean square of the position error over so many simulated ticks under the limit's regulator, m², with random numbers from `seed`.
pub fn simulated_variance(axis: &HoverAxis, limit: &Limit, ticks: usize, seed: u64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let size = axis.dynamics.nrows();
    // A square root of the process' covariance, which has no full rank: Cholesky would refuse it.
    let root = axis.process.clone().symmetric_eigen();
    let spread = root.eigenvectors * DMatrix::from_diagonal(&root.eigenvalues.map(|value| value.max(0.0).sqrt()));
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let (mut state, mut prior) = (DVector::zeros(size), DVector::zeros(size));
    let (mut sum, mut counted) = (0.0, 0);
    for tick in 0..ticks {
        let told = DVector::from_fn(2, |row, _| axis.noise[row].sqrt() * normal());
        let measured = &axis.measurement * &state + told;
        let estimate = &prior + &limit.filter * (&measured - &axis.measurement * &prior);
        let correction = -(&limit.gain * &estimate)[0];
        // From rest to the steady state takes some seconds.
        if tick >= ticks / 10 {
            sum += state[POSITION] * state[POSITION];
            counted += 1;
        }
        let known = &axis.input * correction + &axis.from_measurement * measured;
        prior = &axis.dynamics * estimate + &known;
        let pushed = &spread * DVector::from_fn(size, |_, _| normal());
        state = &axis.dynamics * state + known + pushed;
    }
    sum / f64::from(counted.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robustness::hover::linearise;
    use impromptu_sim::{
        condition::Condition,
        flights::Loop,
        plant::Vehicle,
        rollout::FlightPlan,
        trajectory::{Sample, Trajectory},
    };

    fn lab() -> Loop {
        Loop::new(Vehicle::named("crazyflie").unwrap(), "stock", Condition::named("lab").unwrap()).unwrap()
    }

    /// The linear loop jitters at hover as the simulated one does: the matrices are right, noise and delay among them.
    #[test]
    fn the_linear_loop_hovers_as_the_simulated_one() {
        let closed_loop = lab();
        let expected: f64 = (0..3).map(|axis| baseline_variance(&linearise(&closed_loop, axis).unwrap()).unwrap()).sum();
        let place = Sample { position: [0.0, 0.0, 1.0], ..Sample::default() };
        let trajectory =
            Trajectory { name: "hover".into(), rate_hz: closed_loop.rate_hz(), samples: vec![place; 6_000], scored: 500..6_000 };
        let plans: Vec<FlightPlan<'_>> = (0..16).map(|seed| FlightPlan::new(&trajectory, seed)).collect();
        let flown = closed_loop.fly(&plans).unwrap();
        let found = flown.iter().map(|record| record.rms * record.rms).sum::<f64>() / 16.0;
        let (found, expected) = (found.sqrt(), expected.sqrt());
        assert!((found / expected - 1.0).abs() < 0.03, "found {found}, expected {expected}");
    }

    /// The expected variance is what a simulation of filter, regulator and loop shows, and more control never costs.
    #[test]
    fn the_limit_is_what_a_simulation_shows_and_falls_with_cheaper_control() {
        let axis = linearise(&lab(), 0).unwrap();
        let limits: Vec<Limit> = [3e-2, 3e-3, 3e-4].iter().map(|control_weight| limit(&axis, *control_weight).unwrap()).collect();
        assert!(
            limits
                .windows(2)
                .all(|pair| pair[1].variance <= pair[0].variance && pair[1].mean_square_control >= pair[0].mean_square_control)
        );
        assert!(limits[0].variance < baseline_variance(&axis).unwrap());
        let found = simulated_variance(&axis, &limits[1], 60_000, 3);
        assert!((found / limits[1].variance - 1.0).abs() < 0.08, "{found} {}", limits[1].variance);
    }
}
