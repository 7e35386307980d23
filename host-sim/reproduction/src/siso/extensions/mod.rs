//! What the paper names but does not show, or leaves to later work, tried on loops that are known exactly.
//!
//! *in* a seed; *out* errors of several modules on signals that none was trained on; *never* a choice made on those signals;
//! *source* Zhou 2017: equations (6) and (7), local relative degrees (section III-A), non-minimum-phase loops (section VI); what
//! differs stands in each file.

pub mod flights;
pub mod input_affine;
pub mod preview;
pub mod two_regions;

/// Sampling period of all trials on known plants, s.
pub(crate) const PERIOD: f64 = crate::siso::fixtures::PERIOD;

/// Mean and largest of some errors.
pub fn mean_and_worst(errors: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let errors: Vec<f64> = errors.into_iter().collect();
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    (mean, errors.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}
