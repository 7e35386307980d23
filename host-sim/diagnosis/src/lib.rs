//! Tells from a log of a closed loop whether an add-on that corrects its references will help, why, and by how much.
//!
//! ```text
//! record ──► sub-rate ──► high-order ARX ──► transfer function, covariance ──► properties ──► gates ──► verdict
//!                            (whitens)          (order, dead time by BIC)          │                      ▲
//!                                                                                  └──► prediction ───────┘
//! ```
//!
//! The channel is u (reference, in the baseline the desired output) to y (measured). Units are the log's; times are seconds,
//! frequencies hertz, offsets ticks of the sub-rate. Everything random comes from one seed.

pub mod add_on;
pub mod arx;
pub mod diagnosis;
pub mod excitation;
pub mod identification;
pub mod least_squares;
pub mod polynomial;
pub mod prediction;
pub mod properties;
pub mod record;
pub mod report;
pub mod transfer_function;
pub mod verdict;

pub use diagnosis::{Assessment, Diagnosis, DiagnosisError, Settings, assess, diagnose};
pub use record::{Record, RecordError};
pub use verdict::{Gate, Gates, Verdict};
