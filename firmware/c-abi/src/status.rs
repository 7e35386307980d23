//! What came of a call.
//!
//! *in* refusals of a model and faults of the caller; *out* a number and what to do about it; *never* another number for the same
//! thing in a later version: new ones are added behind the last; *source* [`Refusal`].

use core::ffi::CStr;

use impromptu_firmware::model::Refusal;

/// What came of a call; impromptu_status_text says it in words. After anything but IMPROMPTU_STATUS_OK nothing was changed and
/// no output was written, unless the function says otherwise.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is NULL.
    Null = 1,
    /// A pointer is not aligned for its type.
    Misaligned = 2,
    /// The memory for an object is too small: header and library are of different versions.
    Memory = 3,
    /// The object was not created, or is of another kind.
    NotCreated = 4,
    /// A count of channels differs from the signal table's, or exceeds IMPROMPTU_MAX_CHANNELS.
    Count = 5,
    /// A number is NaN, infinite, or beyond what any vehicle has or does: 10 km, 400 m/s, 1000 m/s^2, 175 rad/s.
    NotFinite = 6,
    /// A name, unit or frame is not UTF-8.
    Text = 7,
    /// The settings are impossible: a number that no vehicle has, or an airframe whose rotors cannot produce every moment.
    Settings = 8,
    /// The model has no network, or the flight stack no model.
    Nothing = 9,
    /// The model file is damaged or incomplete: copy it again.
    Damaged = 16,
    /// Not a model file: give the file that model-export wrote.
    NotAModel = 17,
    /// Another format version: export the model with the matching model-export.
    Version = 18,
    /// The model's card cannot be decoded: export it again.
    Card = 19,
    /// A count, shape or section is impossible or larger than this build allows: train a model that fits.
    Shape = 20,
    /// A number in the model is not finite, out of range, or names what the model does not have: correct it and export again.
    Value = 21,
    /// An integer layer could overflow: calibrate and export again.
    Overflow = 22,
    /// A probe gives other bits on this machine: do not fly, report it.
    Probe = 23,
    /// The stated bounds or limits exclude what the network gives: export the model again.
    Bounds = 24,
    /// The signals of model and application differ in number, name, unit, frame or end rule.
    Signals = 25,
    /// The model looks further than IMPROMPTU_PREVIEW samples.
    Preview = 26,
    /// The model was trained for another rate of the references.
    Rate = 27,
    /// The model is refused for a reason that this version of the library cannot name.
    Refused = 28,
    /// The bounds of the correction say too little: a limit and a rate for each reference channel are needed.
    Caps = 29,
    /// A measured number is NaN or infinite: the tick was done with the last good sample.
    BadSample = 30,
    /// There is no desired trajectory: the tick was done, the loop holds what was desired last or where it is.
    NoTrajectory = 31,
    /// The preview is full: one more sample would push out what is still to be flown or looked back at. Push it after the next
    /// reference ticks.
    Full = 32,
    /// The vehicle brakes, or rests where it has braked: only impromptu_flight_replan goes on.
    Braking = 33,
    /// The reference tick has been flown, or lies further ahead than the preview keeps.
    Tick = 34,
    /// The response of the axis is neither given nor measured: commission first, or give one.
    Unknown = 35,
    /// Nothing was kept there, or it is damaged, or the memory is too small to keep it: learn, then keep.
    NotKept = 36,
    /// What was kept is of another loop, rate or identity: learn anew, then keep.
    Other = 37,
    /// The axis is being commissioned: wait until it has ended, or stop it.
    Busy = 38,
}

impl Status {
    /// Every status.
    pub(crate) const ALL: [Self; 33] = [
        Self::Ok,
        Self::Null,
        Self::Misaligned,
        Self::Memory,
        Self::NotCreated,
        Self::Count,
        Self::NotFinite,
        Self::Text,
        Self::Settings,
        Self::Nothing,
        Self::Damaged,
        Self::NotAModel,
        Self::Version,
        Self::Card,
        Self::Shape,
        Self::Value,
        Self::Overflow,
        Self::Probe,
        Self::Bounds,
        Self::Signals,
        Self::Preview,
        Self::Rate,
        Self::Refused,
        Self::Caps,
        Self::BadSample,
        Self::NoTrajectory,
        Self::Full,
        Self::Braking,
        Self::Tick,
        Self::Unknown,
        Self::NotKept,
        Self::Other,
        Self::Busy,
    ];

    /// The status in words, with what to do.
    pub fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"done",
            Self::Null => c"a pointer is NULL",
            Self::Misaligned => c"a pointer is not aligned for its type",
            Self::Memory => c"the memory is too small: header and library are of different versions",
            Self::NotCreated => c"the object was not created, or is of another kind",
            Self::Count => c"a count of channels differs from the signal table's, or is too large",
            Self::NotFinite => c"a number is NaN, infinite, or beyond what any vehicle has or does",
            Self::Text => c"a name, unit or frame is not UTF-8",
            Self::Settings => c"the settings are impossible: a number that no vehicle has, or an airframe that cannot be mixed",
            Self::Nothing => c"the model has no network, or the flight stack no model",
            Self::Damaged => c"the model file is damaged or incomplete: copy it again",
            Self::NotAModel => c"not a model file: give the file that model-export wrote",
            Self::Version => c"another format version: export the model with the matching model-export",
            Self::Card => c"the model's card cannot be decoded: export it again",
            Self::Shape => c"a count, shape or section of the model is impossible: train a model that fits",
            Self::Value => c"a number in the model is out of range: correct it and export again",
            Self::Overflow => c"an integer layer could overflow: calibrate and export again",
            Self::Probe => c"a probe gives other bits on this machine: do not fly, report it",
            Self::Bounds => c"the model's bounds or limits exclude what its network gives: export it again",
            Self::Signals => c"the signals of model and application differ",
            Self::Preview => c"the model looks further than the preview keeps",
            Self::Rate => c"the model was trained for another rate of the references",
            Self::Refused => c"the model is refused",
            Self::Caps => c"bounds of the correction are missing: give each reference channel a limit and a rate",
            Self::BadSample => c"a measured number is NaN or infinite: the last good sample stood in",
            Self::NoTrajectory => c"there is no desired trajectory: push one; until then the loop holds",
            Self::Full => c"the preview is full: push no further ahead",
            Self::Braking => c"the vehicle brakes: only a re-plan goes on",
            Self::Tick => c"the reference tick has been flown, or lies too far ahead",
            Self::Unknown => c"the response of the axis is not known: commission first, or give one",
            Self::NotKept => c"nothing was kept there, it is damaged, or the memory is too small: learn, then keep",
            Self::Other => c"what was kept is of another loop, rate or identity: learn anew, then keep",
            Self::Busy => c"the axis is being commissioned: wait until it has ended, or stop it",
        }
    }
}

impl From<Refusal> for Status {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::TooShort { .. } | Refusal::Length { .. } | Refusal::Checksum { .. } => Self::Damaged,
            Refusal::NotAModel => Self::NotAModel,
            Refusal::Version { .. } => Self::Version,
            Refusal::Card => Self::Card,
            Refusal::Shape { .. }
            | Refusal::SectionLength { .. }
            | Refusal::SectionAlignment { .. }
            | Refusal::SectionRange { .. } => Self::Shape,
            Refusal::NotFinite { .. } | Refusal::Value { .. } | Refusal::Index { .. } | Refusal::Duplicate { .. } => Self::Value,
            Refusal::Overflow { .. } => Self::Overflow,
            Refusal::Probe { .. } => Self::Probe,
            Refusal::Bounds { .. } | Refusal::Limit { .. } => Self::Bounds,
            Refusal::Signal { .. } => Self::Signals,
            Refusal::Preview { .. } => Self::Preview,
            Refusal::Rate { .. } => Self::Rate,
            Refusal::Cap { .. } => Self::Caps,
            _ => Self::Refused,
        }
    }
}
