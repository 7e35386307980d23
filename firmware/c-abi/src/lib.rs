//! The adapter and the flight stack for C: `include/impromptu.h` over the same code, with the same bits.
//!
//! *in* pointers, counts and plain numbers of a C program; *out* a [`Status`] and plain numbers; *never* a global, an allocation,
//! an unwound stack, or a reference to the caller's numbers that outlives the call; *source* [`impromptu_firmware`].
//!
//! Everything that touches a pointer is in [`edge`], which is also what the header is made of; the rest is safe.
#![cfg_attr(target_os = "none", no_std)]

pub mod adapter;
pub mod edge;
pub mod flight;
pub mod memory;
pub mod status;
pub mod values;

pub use status::Status;
