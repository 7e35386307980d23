//! Parts of a correction that are learned while the loop runs, of one axis: nothing is trained before.
//!
//! *in* the desired trajectory around now and what is measured, at every tick of the learner; *out* the correction of the
//! reference; *never* a number that is not finite, or a correction beyond its bounds; *source* ours: least squares whose
//! regressors are what the loop makes of each feature, after Pereida, Helwa, Schoellig 2018 (a map that corrects references) and
//! the filtered-x of Widrow and Walach 1996.
//!
//! The loop answers a correction u with G u. What is left of the error without one, e - G u, is to be taken away by a linear map
//! of features: so the map is the least squares solution of G(features) . x = -(e - G u).

//!
//! [`LearningAddOn`] is all of it for a loop: it measures the response of each axis ([`Commission`]) or is given it, learns
//! ([`Learner`]), and goes on with what was kept ([`Kept`]). It needs no model:
//!
//! ```
//! use impromptu_firmware::learning::{AxisSettings, LearningAddOn, Limits, Measured, Probe, Response};
//!
//! // A servo: 100 Hz, natural frequency about 7 rad/s, corrections of at most 0.5 rad.
//! let response = Response::second_order(1.0, 7.0, 0.7, 0.02, 100.0);
//! let limits = Limits { scale: 1.0, correction: 0.5, feedback: 0.2, rate: 20.0 };
//! let axis = AxisSettings { response, limits, probe: Probe { size: 0.05, seconds: 4.0 } };
//! let mut add_on = LearningAddOn::new(&[axis], 100.0, 0.0).expect("settings of a loop");
//! // Or `commission()`: the response is measured first, at rest.
//! add_on.learn().expect("the response is known");
//! let desired = |tick: i32| [0.3 * (0.02 * tick as f32).sin()];
//! let mut angle = 0.0;
//! for tick in 0..100 {
//!     let [correction] = add_on.step(tick, desired, &[Some(Measured { value: angle, rate: None })], true);
//!     let [reference] = desired(tick).map(|desired| desired + correction);
//!     // The loop gets the reference; here a machine that follows slowly.
//!     angle += 0.07 * (reference - angle);
//! }
//! ```

mod add_on;
mod axis;
mod commission;
#[cfg(test)]
mod draw;
mod fit;
mod judge;
mod kept;
mod least_squares;
mod response;
mod ring;
mod state;
mod swing;
mod values;
mod work;

pub use add_on::LearningAddOn;
pub use axis::{AHEAD, BEHIND, Learner, SMOOTHING};
pub use commission::{Commission, Probe, Unfit};
pub use kept::{Covariances, Kept, KeptAxis, NotKept, identity};
pub use least_squares::{Factors, LeastSquares, above};
pub use response::{Filter, Response};
pub use state::{AxisSettings, Phase, Problem, Progress};
pub use values::{Learned, Limits, Measured, Parts, lags, offsets};
