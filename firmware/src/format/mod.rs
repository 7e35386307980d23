//! What is stored of a model: the file's bytes, and the types that they become.
//!
//! *in* the bytes of a model file; *out* its [`Card`], and the numbers in bulk behind it, in place; *never* anything that is
//! evaluated: networks, lanes and models stand above this module; *source* [`mod@file`] for the layout, [`Card`] for the fields.

mod blob;
mod bounds;
mod card;
pub(crate) mod decode;
mod feature;
pub mod file;
mod file_buffer;
mod limits;
mod range_check;
pub mod ranges;
mod refusal;
pub mod trailer;

pub use blob::{Blob, Floats, Words};
pub use bounds::{Bounds, OutputBounds, Reach};
pub use card::*;
pub use feature::{Feature, Relative, Source};
pub use file_buffer::FileBuffer;
pub use limits::*;
pub use refusal::Refusal;
