//! Plain numbers of what learns an axis.
//!
//! *in/out* structures of f32, u32 and i32; *never* padding, or a value that Rust could not hold; *source*
//! [`impromptu_firmware::learning`].

/// Settings of what learns an axis. Values and their rates are in the unit of the axis, and a second.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LearnerSettings {
    /// Rate of the references, Hz.
    pub rate_hz: f32,
    /// Age of a measured value when it arrives, s.
    pub age_s: f32,
    /// Number of the axis, so that several can be commissioned at once.
    pub axis: u32,
    /// How the measured value answers a change of the reference, if it is known: gain at rest. 0: it is to be commissioned.
    pub gain: f32,
    /// Natural frequency of the response, rad/s.
    pub frequency: f32,
    /// Damping ratio of the response.
    pub damping: f32,
    /// Delay of the response, s, the age of a measured value included.
    pub delay_s: f32,
    /// About what a correction is at its largest in a calm motion: errors are judged by it.
    pub scale: f32,
    /// Largest correction.
    pub correction: f32,
    /// What of it may follow from the error.
    pub feedback: f32,
    /// Largest change of the correction in a second.
    pub rate: f32,
    /// By how much the reference steps to either side while the axis is commissioned; at most `correction`.
    pub probe_size: f32,
    /// For how long, s: about three times the time in which the loop settles; at least 400 ticks.
    pub probe_s: f32,
    /// What tells this loop from others, and the model before it, if there is one: what was kept of another is refused.
    pub identity: u32,
}

/// Why an axis was not commissioned.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LearnerProblem {
    /// Nothing went wrong.
    None = 0,
    /// The response is neither given nor measured.
    Unknown = 1,
    /// The loop did not move the machine.
    Grounded = 2,
    /// The trajectory did not rest.
    Moving = 3,
    /// Ticks were left out.
    Gap = 4,
    /// A fifth of the samples was missing.
    Missing = 5,
    /// There was other motion than that of the steps.
    Noisy = 6,
    /// The loop does not follow its reference.
    Gain = 7,
    /// The loop moves against its reference.
    Opposite = 8,
    /// The loop is too slow or too fast.
    Speed = 9,
    /// For a reason that this version cannot name.
    Other = 10,
}

/// How far what learns an axis is.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LearnerReport {
    /// 0 off, 1 commissioning, 2 learning, 3 holding.
    pub phase: u32,
    /// An impromptu_learner_problem: what went wrong last in commissioning.
    pub problem: u32,
    /// Share of commissioning that is done, 0..1.
    pub commissioned: f32,
    /// Seconds in motion that were learned from.
    pub learned_s: f32,
    /// Share of the correction that acts, 0..1.
    pub share: f32,
    /// How often what was learned was forgotten because it did harm.
    pub forgotten: u32,
    /// The correction of the last tick.
    pub correction: f32,
    /// The response that it goes by: gain at rest, 0 if none is known.
    pub gain: f32,
    /// Natural frequency, rad/s.
    pub frequency: f32,
    /// How late a slow correction is answered, s.
    pub lag_s: f32,
    /// Samples of the trajectory ahead of the last tick; negative if it has ended.
    pub reach: i32,
}
