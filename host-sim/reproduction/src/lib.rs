//! The paper, reproduced row by row: what was found, beside what the paper states.
//!
//! *in* settings and a seed; *out* an [`impromptu_report::study::Study`]: numbers and figures by name; *never* a number without a
//! name; *source* Zhou, Helwa, Schoellig, CDC 2017, and the rows of its promises (1 to 31).
//!
//! At the bottom are the paper's small single-input single-output loops, with laws, networks and the firmware's kernels on them.
//! Each study above answers rows of the paper and knows none of the others.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `siso` | the add-on on small loops: laws, samples, a network by Levenberg-Marquardt, deployment |
//! | 2 | `lti`, `extensions` | linear systems; what the paper leaves to later work |
//! | 2 | `quadrotor`, `robustness` | the quadrotor; other vehicles, loops and air |
//! | 3 | `learning` | what is learned in flight, also where `robustness` found a loss |

#[cfg(test)]
mod checks;
pub mod extensions;
pub mod learning;
pub mod lti;
pub mod quadrotor;
pub mod robustness;
pub mod siso;
