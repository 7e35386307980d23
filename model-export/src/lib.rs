//! Float network in, checked and self-describing model file out.
//!
//! *in* a [`FloatNetwork`] (safetensors), its [`Description`] (JSON) and rows to calibrate on; *out* the bytes that
//! `impromptu_firmware::model::Model::from_bytes` accepts; *never* a file that the firmware would refuse: every file is loaded by
//! the firmware's own code before it is handed out; *source* the format in `impromptu_firmware::model::file`.
//!
//! ```text
//! float network ──┬─► quantise ─► integer network ─► packing ──┐
//!                 │      ▲                                     ├─► encode ─► model file ─► the firmware's own check
//! rows ───────────┼──────┘ ranges, moments                     │                │
//! description ────┼────────────────────────────────────────────┘                ├─► inspection: what the file says of itself
//!                 │                                                             ▼
//!                 └─► batch ─► verify ◄── batch ◄── stored network, unpacked ◄──┘
//!                                                           └─► bounds: what it can give, and how far it is off
//! ```
//!
//! Every row of numbers is evaluated in the order of the code that it stands for, so that a batch has the bits of one row at a
//! time: on the float side those of [`FloatNetwork::evaluate`], on the file's side those of the firmware.
//!
//! # Layers
//!
//! A module uses those of lower layers only; `tests/` holds the code to this table.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `float_network`, `rows`, `signing` | tensors, rows; keys, signed models |
//! | 2 | `description` | their meaning, and which network and rows belong to it |
//! | 2 | `export_error`, `integer_network` | failures; layers in integers |
//! | 3 | `inspection` | a file for people |
//! | 3 | `packing` | layers in the order in which the kernels stream them |
//! | 4 | `stored_network` | the network of a model file, unpacked |
//! | 5 | `batch`, `bounds` | many rows at once with the bits of one; proven ranges, differences, slopes |
//! | 6 | `quantise`, `verify` | float to integers on calibration rows; float against file over rows |
//! | 7 | `encode` | the bytes of a model file |
//! | 8 | `cli` | `export`, `inspect`, `verify`, `keygen`, `sign` |

pub mod batch;
pub mod bounds;
pub mod cli;
pub mod description;
pub mod encode;
pub mod export_error;
pub mod float_network;
pub mod inspection;
pub mod integer_network;
pub mod packing;
pub mod quantise;
pub mod rows;
pub mod signing;
pub mod stored_network;
pub mod verify;

pub use batch::Batch;
pub use description::Description;
pub use encode::{Precision, encode};
pub use export_error::ExportError;
pub use float_network::FloatNetwork;
