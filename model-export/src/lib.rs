//! Float network in, checked and self-describing model file out.
//!
//! *in* a [`FloatNetwork`] (safetensors), its [`Description`] (JSON) and rows to calibrate on; *out* the bytes that
//! `impromptu_firmware::model::Model::from_bytes` accepts; *never* a file that the firmware would refuse: every file is loaded by the
//! firmware's own code before it is handed out; *source* the format in `impromptu_firmware::model::file`.

pub mod batch;
pub mod bounds;
pub mod cli;
pub mod description;
pub mod encode;
pub mod export_error;
pub mod float_network;
pub mod inspection;
pub mod packing;
pub mod quantise;
pub mod replacement;
pub mod rows;
pub mod stored_network;
pub mod verify;

pub use batch::Batch;
pub use description::Description;
pub use encode::{Precision, encode};
pub use export_error::ExportError;
pub use float_network::FloatNetwork;
