//! How much a model can have.
//!
//! *in* nothing; *out* the largest counts of any model, and those of a type that says none; *never* one that is passed in
//! silence; *source* a Cortex-M4F's memory, and eight axes of a machine.

/// Oldest version of the format that this build reads.
pub(super) const OLDEST: u16 = 2;
/// Most channels in one signal: for eight axes, each with position, velocity and acceleration, and what else is told.
pub const MAX_CHANNELS: usize = 32;
/// Most channels in one signal where a type does not say another number.
pub const DEFAULT_CHANNELS: usize = 16;
/// Most network inputs.
pub const MAX_FEATURES: usize = 128;
/// Most corrected channels: position and velocity of eight axes.
pub const MAX_OUTPUTS: usize = 16;
/// Most corrected channels where a type does not say another number.
pub const DEFAULT_OUTPUTS: usize = 8;
/// Most dense layers.
pub const MAX_LAYERS: usize = 6;
/// Most units in a layer.
pub const MAX_WIDTH: usize = 256;
/// Most axes of a feedback lane, and of the monitor.
pub const MAX_AXES: usize = 8;
/// Most axes of a feedback lane where a type does not say another number.
pub const DEFAULT_AXES: usize = 4;
/// Most lags of a feedback lane.
pub const MAX_LAGS: usize = 32;
/// Most errors that one axis of a feedback lane reads.
pub const MAX_ERRORS: usize = 2;
/// Sub-rate ticks of measured and past reference channels that features can read.
pub const HISTORY: usize = 16;
/// Most monitor ticks that a response of the monitor lasts.
pub const MAX_TAPS: usize = 32;
/// Most corrections whose response one axis of the monitor adds up.
pub const MAX_INPUTS: usize = 2;
