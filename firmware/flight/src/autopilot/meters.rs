//! What a board measures of itself.
//!
//! *in* the board's counters; *out* numbers for the telemetry; *never* a unit: it is the board's (instructions or cycles).

/// What a board measures of itself; the unit of costs is the board's (instructions or cycles).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Meters {
    /// Largest cost of a control tick.
    pub control_max: u32,
    /// Largest cost of an inference.
    pub inference_max: u32,
    /// High-water mark of the stack, bytes.
    pub stack_bytes: u32,
    /// Largest delay from the tick's interrupt to the control task.
    pub entry_latency_max: u32,
    /// Control ticks that were not done when the next one was due.
    pub deadline_misses: u32,
}
