//! The caller's memory for the library's objects.
//!
//! *in* nothing; *out* types whose size a C compiler knows; *never* a size that is too small: then this crate does not compile;
//! *source* the sizes of the Rust types, which depend on the width of a pointer and a little on the compiler, rounded up.

use impromptu_firmware::{model::Model, network::Scratch};

use crate::{adapter::Stage, flight::Stack, learner::Learning};

/// Words of 8 bytes of an impromptu_model.
#[cfg(target_pointer_width = "64")]
pub const MODEL_WORDS: usize = 704;
/// Words of 8 bytes of an impromptu_model.
#[cfg(target_pointer_width = "32")]
pub const MODEL_WORDS: usize = 512;
/// Words of 8 bytes of an impromptu_adapter.
#[cfg(target_pointer_width = "64")]
pub const ADAPTER_WORDS: usize = 2752;
/// Words of 8 bytes of an impromptu_adapter.
#[cfg(target_pointer_width = "32")]
pub const ADAPTER_WORDS: usize = 2736;
/// Words of 8 bytes of an impromptu_flight.
#[cfg(target_pointer_width = "64")]
pub const FLIGHT_WORDS: usize = 2096;
/// Words of 8 bytes of an impromptu_flight.
#[cfg(target_pointer_width = "32")]
pub const FLIGHT_WORDS: usize = 2096;
/// Words of 8 bytes of an impromptu_learner.
#[cfg(target_pointer_width = "64")]
pub const LEARNER_WORDS: usize = 480;
/// Words of 8 bytes of an impromptu_learner.
#[cfg(target_pointer_width = "32")]
pub const LEARNER_WORDS: usize = 448;
/// Words of 8 bytes of an impromptu_scratch.
pub const SCRATCH_WORDS: usize = 257;

/// Memory for a model, in place: the model file itself stays where it is.
#[repr(C)]
#[derive(Debug)]
pub struct ModelMemory {
    /// Not for the caller.
    pub words: [u64; MODEL_WORDS],
}

/// Memory for an adapter and the trajectory ahead of it.
#[repr(C)]
#[derive(Debug)]
pub struct AdapterMemory {
    /// Not for the caller.
    pub words: [u64; ADAPTER_WORDS],
}

/// Memory for a flight stack.
#[repr(C)]
#[derive(Debug)]
pub struct FlightMemory {
    /// Not for the caller.
    pub words: [u64; FLIGHT_WORDS],
}

/// Memory for what learns an axis, and the trajectory ahead of it.
#[repr(C)]
#[derive(Debug)]
pub struct LearnerMemory {
    /// Not for the caller.
    pub words: [u64; LEARNER_WORDS],
}

/// Working memory for one evaluation of a network at a time.
#[repr(C)]
#[derive(Debug)]
pub struct ScratchMemory {
    /// Not for the caller.
    pub words: [u64; SCRATCH_WORDS],
}

/// An object in the caller's memory. The mark tells it from memory that was zeroed, and from objects of another kind.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct Object<T> {
    pub(crate) mark: u32,
    pub(crate) value: T,
}

/// What has memory of its own.
pub(crate) trait Stored: Sized {
    /// Its memory.
    type Memory;
    /// What its memory is marked with.
    const MARK: u32;
    /// Fails to compile if the memory is too small.
    const FITS: () = assert!(
        size_of::<Object<Self>>() <= size_of::<Self::Memory>() && align_of::<Object<Self>>() <= align_of::<Self::Memory>(),
        "the sizes in memory.rs are too small for this compiler"
    );
}

impl Stored for Model<'static> {
    type Memory = ModelMemory;
    const MARK: u32 = 0x4c44_4f4d;
}

impl Stored for Stage {
    type Memory = AdapterMemory;
    const MARK: u32 = 0x5450_4441;
}

impl Stored for Stack {
    type Memory = FlightMemory;
    const MARK: u32 = 0x5947_4c46;
}

impl Stored for Learning {
    type Memory = LearnerMemory;
    const MARK: u32 = 0x4e52_454c;
}

impl Stored for Scratch {
    type Memory = ScratchMemory;
    const MARK: u32 = 0x5443_5253;
}
