//! Model export.

pub mod float_network;
