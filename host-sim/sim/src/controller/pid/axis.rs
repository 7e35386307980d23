//! One PID.
//!
//! *in* an error and a measurement; *out* what to do; *never* a kick from a step of the reference: the derivative is the
//! measurement's; *source* the Crazyflie's documentation.

use libm::remainderf;

/// Gains and limits of one PID.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) kp: f32,
    ki: f32,
    kd: f32,
    /// Largest integral of the error.
    integral_limit: f32,
    /// Largest output.
    limit: f32,
}

impl Gains {
    pub(super) const fn new(kp: f32, ki: f32, kd: f32) -> Self {
        Self { kp, ki, kd, integral_limit: 5_000.0, limit: f32::INFINITY }
    }

    pub(super) const fn integrating(self, integral_limit: f32) -> Self {
        Self { integral_limit, ..self }
    }

    pub(super) const fn limited(self, limit: f32) -> Self {
        Self { limit, ..self }
    }
}

/// A PID with its memory.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    gains: Gains,
    hz: f32,
    integral: f32,
    /// `None` before the first step, which has no derivative.
    previous: Option<f32>,
}

impl Axis {
    pub(super) fn new(gains: Gains, hz: f32) -> Self {
        Self { gains, hz, integral: 0.0, previous: None }
    }

    /// The output for an error, with the rate of the measurement.
    pub(super) fn step(&mut self, error: f32, measured: f32) -> f32 {
        let change = measured - self.previous.unwrap_or(measured);
        self.advance(error, measured, change)
    }

    /// The same for angles in degrees, which go round.
    pub(super) fn step_angle(&mut self, error: f32, measured: f32) -> f32 {
        let change = remainderf(measured - self.previous.unwrap_or(measured), 360.0);
        self.advance(error, measured, change)
    }

    fn advance(&mut self, error: f32, measured: f32, change: f32) -> f32 {
        let Gains { kp, ki, kd, integral_limit, limit } = self.gains;
        self.previous = Some(measured);
        let integral = self.integral + error / self.hz;
        // A flight that left the numbers does not come back by its integral.
        self.integral = if integral.is_finite() { integral.clamp(-integral_limit, integral_limit) } else { 0.0 };
        (kp * error + ki * self.integral - kd * change * self.hz).clamp(-limit, limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_output_is_proportional_and_integral_and_what_the_measurement_does() {
        let mut axis = Axis::new(Gains::new(2.0, 10.0, 0.5).integrating(0.3).limited(5.0), 10.0);
        // 2 * 1 + 10 * 0.1; then the measurement rises by 0.1 in 0.1 s; then the integral is at its limit, then the output.
        assert_eq!(axis.step(1.0, 0.0), 3.0);
        assert!((axis.step(0.5, 0.1) - (1.0 + 1.5 - 0.5)).abs() < 1e-5);
        assert!((axis.step(0.9, 0.1) - (1.8 + 2.4)).abs() < 1e-5);
        assert_eq!(axis.step(4.0, 0.1), 5.0);
        assert!((axis.step(0.0, 0.1) - 3.0).abs() < 1e-5);
    }

    #[test]
    fn an_angle_goes_round_and_a_number_that_is_none_is_forgotten() {
        let mut axis = Axis::new(Gains::new(0.0, 0.0, 1.0), 1.0);
        axis.step_angle(0.0, 179.0);
        assert_eq!(axis.step_angle(0.0, -179.0), -2.0);
        let mut axis = Axis::new(Gains::new(1.0, 1.0, 0.0), 1.0);
        axis.step(f32::INFINITY, 0.0);
        assert_eq!(axis.step(1.0, 0.0), 2.0);
    }
}
