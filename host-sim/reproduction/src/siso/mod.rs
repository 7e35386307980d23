//! The add-on on small single-input single-output loops (Zhou 2017, sections III and V).
//!
//! ```text
//! loop ──► tones ──► run ──► rows (features, target) ──► network (Levenberg-Marquardt) ──► firmware kernel (f32, int16, int8)
//!  │                                                          │                                  │
//!  └──► exact law ─────────────────► simulation ◄─────────────┴──────────────────────────────────┘
//! ```
//!
//! - *in*: a plant, its desired trajectory, a seed.
//! - *out*: runs of the loop with the exact law, the network, or the network as the microcontroller evaluates it.
//! - *never*: two threads, two results; everything random comes from a seed.
//! - *source*: Zhou, Helwa, Schoellig, CDC 2017; what differs stands in each file.
//!
//! The desired output, the reference and the states are pure numbers, time is counted in samples.

pub mod deployment;
pub mod extensions;
pub mod feature_set;
pub mod fixtures;
pub mod lag;
pub mod law;
pub mod learning;
pub mod levenberg_marquardt;
pub mod linear_map;
pub mod multisine;
pub mod network;
pub mod nonlinear;
pub mod samples;
pub mod scalar;
pub mod signal;
pub mod simulation;
pub mod state_space;
pub mod window;

pub use deployment::FirmwareModule;
pub use feature_set::FeatureSet;
pub use learning::{Assessment, Learned, assess, learn};
pub use linear_map::LinearMap;
pub use multisine::Multisine;
pub use network::{Network, NetworkModule};
pub use samples::Rows;
pub use scalar::Scalar;
pub use simulation::{Module, Moment, Plant, Run, Start, simulate};
pub use state_space::StateSpace;
pub use window::Window;
