//! The adapter and the flight stack for C: `include/impromptu.h` over the same code, with the same bits.
//!
//! *in* pointers, counts and plain numbers of a C program; *out* a [`Status`] and plain numbers; *never* a global, an allocation,
//! an unwound stack, or a reference to the caller's numbers that outlives the call; *source* [`impromptu_firmware`].
//!
//! Everything that touches a pointer is in [`edge`], which is also what the header is made of; the rest is safe.
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `status` | what a call answers |
//! | 2 | `values` | plain numbers that cross the border |
//! | 3 | `adapter` | the add-on with as many channels as a table has at run time |
//! | 3 | `flight` | the flight stack |
//! | 3 | `learner` | what learns an axis |
//! | 4 | `memory` | memory that the caller owns, and whether it holds an object |
//! | 5 | `edge` | the functions that C calls |
#![cfg_attr(target_os = "none", no_std)]

pub mod adapter;
pub mod edge;
pub mod flight;
pub mod learner;
pub mod memory;
pub mod status;
pub mod values;

pub use status::Status;
