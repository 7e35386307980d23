//! Why a set of logs or settings gives no feedback lane.

use thiserror::Error;

/// Why there is no feedback lane.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DesignRefusal {
    /// A signal's length differs from that of the measured position.
    #[error("log {log}: `{signal}` has {length} samples, `measured_position` {expected}: log all signals at every tick")]
    UnequalLengths {
        /// Index of the log.
        log: usize,
        /// Name of the signal.
        signal: &'static str,
        /// Samples of the signal.
        length: usize,
        /// Samples of the measured position.
        expected: usize,
    },
    /// A sample is infinite or not a number.
    #[error("log {log}: `{signal}` is not finite at tick {tick}: cut the log before it")]
    NotFinite {
        /// Index of the log.
        log: usize,
        /// Name of the signal.
        signal: &'static str,
        /// Tick of the first such sample.
        tick: usize,
    },
    /// Too little flight time for so many coefficients.
    #[error("{rows} rows are too few, {needed} are needed: fly longer (1.5 minutes an axis are enough)")]
    TooFewRows {
        /// Rows with a full past.
        rows: usize,
        /// Rows needed.
        needed: usize,
    },
    /// Nothing independent moves the position reference.
    #[error(
        "no independent excitation: the position reference's innovation is {innovation:.2e} m, {minimum:.2e} m are needed: \
         add a dither to the position reference (1 cm, a new random sign every 50 ms)"
    )]
    NoExcitation {
        /// Median RMS of the innovation, m.
        innovation: f64,
        /// Least innovation, m.
        minimum: f64,
    },
    /// The excitation is too weak for the noise and the length of the logs.
    #[error(
        "the excitation is too weak for these sensors: precision {precision:.1} s, {minimum:.1} s are needed: fly longer or \
         raise the dither's amplitude"
    )]
    WeakExcitation {
        /// Innovation times the square root of the rows over the velocity residual, s.
        precision: f64,
        /// Least precision, s.
        minimum: f64,
    },
    /// The logged dither did not reach the logged reference.
    #[error(
        "the logged dither explains {share:.2} of the position reference's innovation instead of 1: check its unit \
         and sign, and that the reference was logged with it"
    )]
    DitherNotInReference {
        /// Share explained.
        share: f64,
    },
    /// The normal equations are singular.
    #[error("the fit with {lags} lags is singular: raise `regularisation`, or log a livelier flight")]
    SingularRegression {
        /// Memory of the model.
        lags: usize,
    },
    /// The Riccati equation has no solution.
    #[error("no linear-quadratic gain exists for the identified model: its reference does not control it")]
    NoGain,
    /// The lane does not stabilise the model it was designed on.
    #[error("the designed loop is unstable: spectral radius {spectral_radius:.6}")]
    Unstable {
        /// Largest absolute eigenvalue.
        spectral_radius: f64,
    },
    /// The lane has no steady state that its integral could hold.
    #[error(
        "the past-output coefficients add up to {sum:.3}, the firmware needs less than 1: raise `control_weight`, \
         `velocity_weight` or `noise_factor`"
    )]
    NoSteadyState {
        /// Sum of the coefficients.
        sum: f64,
    },
    /// A setting is out of its range.
    #[error("`{field}` {requirement}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// What it must be.
        requirement: String,
    },
}

impl DesignRefusal {
    pub(super) fn setting(field: &'static str, requirement: &'static str) -> Self {
        Self::Setting { field, requirement: format!("must be {requirement}") }
    }

    pub(super) fn out_of_range(field: &'static str, value: f64, low: f64, high: f64) -> Self {
        Self::Setting { field, requirement: format!("is {value}, not from {low} to {high}") }
    }
}
