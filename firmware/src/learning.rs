//! Parts of a correction that are learned while the loop runs, of one axis: nothing is trained before.
//!
//! *in* the desired trajectory around now and what is measured, at every tick of the learner; *out* the correction of the
//! reference; *never* a number that is not finite, or a correction beyond its bounds; *source* ours: least squares whose
//! regressors are what the loop makes of each feature, after Pereida, Helwa, Schoellig 2018 (a map that corrects references) and
//! the filtered-x of Widrow and Walach 1996.
//!
//! The loop answers a correction u with G u. What is left of the error without one, e - G u, is to be taken away by a linear map
//! of features: so the map is the least squares solution of G(features) . x = -(e - G u).

mod axis;
mod judge;
mod least_squares;
mod response;
mod ring;

pub use axis::{AHEAD, BEHIND, Learned, Learner, Limits, Measured, Parts};
pub use least_squares::{LeastSquares, above};
pub use response::{Filter, Response};
