//! Tells from a log of a closed loop whether an add-on that corrects its references will help, why, and by how much.
//!
//! ```text
//! record ──► sub-rate ──► high-order ARX ──► transfer function, covariance ──► properties ──► gates ──► verdict
//!                            (whitens)     (forms that could be true, by AIC)       │                      ▲
//!                                                                                  └──► prediction ───────┘
//! ```
//!
//! The channel is u (reference, in the baseline the desired output) to y (measured). Units are the log's; times are seconds,
//! frequencies hertz, offsets ticks of the sub-rate. Everything random comes from one seed.
//!
//! At the bottom are polynomials, records and the one regression, which whoever trains something uses as well; a model of the
//! loop is identified from them, its properties are read off, a prediction is made, and the gates judge. The report puts it all
//! into words.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `polynomial`, `record`, `cholesky` | roots and filters; signals in step; positive definite systems |
//! | 1 | `columns`, `digits` | a log as it is read; numbers for people |
//! | 2 | `transfer_function`, `least_squares` | a rational function of z; the regression with its covariance |
//! | 2 | `stretches` | time on the ground, uneven rows |
//! | 3 | `plausibility` | whether columns can be what they are taken for |
//! | 3 | `arx`, `excitation`, `add_on` | lagged regressors; what the log can tell at all; the add-on that is assumed |
//! | 4 | `output_error` | a model of one form, its likelihood and covariance |
//! | 5 | `identification` | order, dead time, the forms that the log does not rule out |
//! | 6 | `properties` | gain, zeros, relative degree, lag, each with its interval |
//! | 7 | `prediction` | by how much the error will shrink |
//! | 8 | `verdict` | gates and what they come to |
//! | 9 | `diagnosis` | all of it, at the sub-rate that suits the loop best |
//! | 10 | `report` | the diagnosis in words |

pub mod add_on;
pub mod arx;
pub mod cholesky;
pub mod columns;
pub mod diagnosis;
pub mod digits;
pub mod excitation;
pub mod identification;
pub mod least_squares;
mod output_error;
pub mod plausibility;
pub mod polynomial;
pub mod prediction;
pub mod properties;
pub mod record;
pub mod report;
mod stretches;
pub mod transfer_function;
pub mod verdict;

pub use diagnosis::{Assessment, Diagnosis, DiagnosisError, Settings, assess, diagnose};
pub use record::{Record, RecordError};
pub use verdict::{Gate, Gates, Verdict};
