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
