//! Any loop, from its description and its own logs to a model.
//!
//! ```text
//! loop.toml ─► description ─► layout ────────────────────────────┐
//! logs ─► reading ─► models ─┬─► window ─► network lane ─────────┼─► training ─► model file
//!                            ├─► design ─► feedback lane ────────┤
//!                            └─► replay: what both would have left of the logs kept apart
//! ```
//!
//! *in* a description and logs of any loop with 1 to 8 axes; *out* a model with both lanes, limits and monitor; *never* a
//! simulated vehicle; *source* Zhou 2017, sections III and V.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 0 | `description` | a loop in words |
//! | 1 | `draft`, `layout`, `reading` | a description from a header; channels of its model; its logs |
//! | 2 | `age`, `built_in`, `response` | how old what is measured is; loops that need no file; answers |
//! | 3 | `models`, `replay` | what the logs leave possible; flights on it |
//! | 4 | `machines` | loops to try it on |
//! | 4 | `window`, `candidates` | the network lane; designs of the feedback lane |
//! | 5 | `design`, `prepared` | the choice of a feedback lane; logs made ready |
//! | 6 | `next` | what the logs lack |
//! | 7 | `next_flight` | the trajectory that tells most of it |
//! | 6 | `complete`, `model` | lane and monitor beside a network lane; what a model says of itself |
//! | 7 | `training` | from logs to a model file |

pub mod age;
pub mod built_in;
pub mod candidates;
pub mod complete;
pub mod description;
pub mod design;
pub mod draft;
pub mod layout;
pub mod machines;
pub mod model;
pub mod models;
pub mod next;
pub mod next_flight;
pub mod prepared;
pub mod reading;
pub mod replay;
pub mod response;
pub mod training;
pub mod window;

pub use description::LoopDescription;
pub use training::{Settings, TrainError, Trained, train};
