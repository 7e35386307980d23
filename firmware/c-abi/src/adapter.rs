//! The add-on alone, with as many channels as its signal table has at run time.
//!
//! *in* desired and measured channels, counted; *out* reference channels; *never* other bits than those of an add-on whose arrays
//! have just these channels; *source* [`impromptu_firmware::add_on`].

use impromptu_firmware::{AddOn, add_on::PushError};

use crate::{
    status::Status,
    values::{MAX_CHANNELS, PREVIEW},
};

/// As many numbers as a signal can have; those behind its channels are zero.
pub type Channels = [f32; MAX_CHANNELS];

/// An add-on for signals of up to [`MAX_CHANNELS`] channels.
pub type Stage = AddOn<'static, MAX_CHANNELS, MAX_CHANNELS, MAX_CHANNELS, PREVIEW>;

/// All zeros, so that it is written in place.
pub(crate) const EMPTY: Stage = Stage::empty();

/// Whether these are the counts of an add-on's desired, measured and reference channels; `None` is not asked.
///
/// # Errors
/// If one differs.
pub fn counted(stage: &Stage, counts: [Option<usize>; 3]) -> Result<(), Status> {
    // The application's table is the model's.
    let signals = &stage.model().ok_or(Status::Nothing)?.card().signals;
    let own = [&signals.desired, &signals.measured, &signals.reference].map(|channels| channels.len());
    let same = own.iter().zip(counts).all(|(own, given)| given.is_none_or(|given| given == *own));
    same.then_some(()).ok_or(Status::Count)
}

impl From<PushError> for Status {
    fn from(error: PushError) -> Self {
        match error {
            PushError::Full => Self::Full,
            _ => Self::NotFinite,
        }
    }
}
