//! The whole add-on of one loop: the adapter, and the desired trajectory ahead of it.
//!
//! *in* desired channels, pushed ahead of time, and what is measured at each reference tick; *out* the reference that the loop
//! shall track, and a [`Report`]; *never* a number in the trajectory that is not finite, an allocation, or a clock of its own;
//! without a model no other reference than the desired one, to the bit; *source* Zhou 2017, Fig. 1.
//!
//! On a microcontroller it lies in a static, where [`AddOn::load`] fills it in place:
//!
//! ```
//! use impromptu_firmware::{
//!     AddOn,
//!     model::{Channel, Channels},
//!     preview::EndRule,
//! };
//! use static_cell::ConstStaticCell;
//!
//! const ANGLE: Channel<'_> = Channel { name: "angle", unit: "rad", frame: "", end: EndRule::Hold };
//! const SIGNALS: Channels<'_> = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };
//! /// One desired, measured and reference channel each; 64 samples of the trajectory.
//! static ADD_ON: ConstStaticCell<AddOn<'static, 1, 1, 1, 64>> = ConstStaticCell::new(AddOn::empty());
//!
//! let add_on = ADD_ON.take();
//! // No model, or one that was refused: the loop gets what is desired.
//! add_on.bypass(SIGNALS).unwrap();
//! add_on.push([0.5]).unwrap();
//! assert!(add_on.push([f32::NAN]).is_err());
//! assert_eq!(add_on.finish(0, &[0.4]), [0.5]);
//! ```

use core::fmt;

use crate::{
    adapter::{Adapter, Inference, Job, Lanes},
    caps::Caps,
    guard::{Guard, GuardSettings, Trips},
    model::{Channels, DEFAULT_AXES, DEFAULT_CHANNELS, DEFAULT_OUTPUTS, Model, Refusal},
    network::Scratch,
    preview::{EndRule, Preview},
};

/// Why a sample of the trajectory was not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum PushError {
    /// A desired channel is NaN or infinite: push another sample for the same tick.
    NotFinite {
        /// Index of the desired channel.
        channel: usize,
    },
    /// One more sample would push out what is still to be flown, or what the model will still look back at: of `N` samples
    /// those of the past of [`Card::preview_span`](crate::model::Card::preview_span) stay behind, the others lie ahead.
    Full,
}

impl fmt::Display for PushError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { channel } => {
                write!(f, "desired channel {channel} is not a finite number: push another sample for the same tick")
            }
            Self::Full => f.write_str("the preview is full: push this sample after the next reference ticks"),
        }
    }
}

impl core::error::Error for PushError {}

/// What an add-on has done.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Report<const O: usize = DEFAULT_OUTPUTS> {
    /// Correction of each output of the model in the last tick, in the channel's unit; zeros behind the last.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub correction: [f32; O],
    /// How far the network lane is faded in, 0..=1.
    pub network_weight: f32,
    /// How far the feedback lane is faded in, 0..=1.
    pub feedback_weight: f32,
    /// Ticks in which a limit or the slew bounded the correction.
    pub saturations: u32,
    /// Inferences that did not come in time.
    pub late: u32,
    /// Ticks in which the trajectory did not reach as far ahead as the model looks while a lane was wanted.
    pub starved: u32,
    /// The guard's trips, by lane and reason.
    pub trips: Trips,
    /// Reference tick of the next sample that is pushed.
    pub next_tick: i32,
    /// Samples of the trajectory ahead of the last reference tick; negative if it has ended.
    pub reach: i32,
}

impl<const O: usize> Default for Report<O> {
    fn default() -> Self {
        Self {
            correction: [0.0; O],
            network_weight: 0.0,
            feedback_weight: 0.0,
            saturations: 0,
            late: 0,
            starved: 0,
            trips: Trips::default(),
            next_tick: 0,
            reach: 0,
        }
    }
}

impl<const O: usize> Report<O> {
    /// Of an adapter whose next sample is that of `next_tick`.
    pub fn of<const D: usize, const M: usize, const R: usize, const C: usize, const A: usize>(
        adapter: &Adapter<'_, D, M, R, C, O, A>,
        next_tick: i32,
    ) -> Self {
        let [network_weight, feedback_weight] = adapter.weights();
        Self {
            correction: adapter.correction(),
            starved: adapter.starved(),
            network_weight,
            feedback_weight,
            saturations: adapter.saturations(),
            late: adapter.late(),
            trips: adapter.trips(),
            next_tick,
            reach: adapter.last_tick().map_or(0, |tick| next_tick.wrapping_sub(tick).wrapping_sub(1)),
        }
    }
}

/// The add-on of a loop with `D` desired, `M` measured and `R` reference channels, which keeps `N` samples of the desired
/// trajectory, past ones included.
///
/// Ticks are those of the loop's references, in order and without gaps; after a gap the histories start anew. A reference tick is
/// one [`AddOn::step`], or, with the network in a task of lower priority, [`AddOn::begin`] and [`AddOn::finish`].
#[derive(Debug)]
pub struct AddOn<
    'm,
    const D: usize,
    const M: usize,
    const R: usize,
    const N: usize,
    const C: usize = DEFAULT_CHANNELS,
    const O: usize = DEFAULT_OUTPUTS,
    const A: usize = DEFAULT_AXES,
> {
    adapter: Adapter<'m, D, M, R, C, O, A>,
    preview: Preview<D, N>,
}

impl<'m, const D: usize, const M: usize, const R: usize, const N: usize, const C: usize, const O: usize, const A: usize>
    AddOn<'m, D, M, R, N, C, O, A>
{
    /// An add-on that knows neither a model nor the loop's signals: all zeros, for a static. It is to be [loaded](AddOn::load) or
    /// [bypassed](AddOn::bypass) before it is used.
    pub const fn empty() -> Self {
        Self { adapter: Adapter::empty(), preview: Preview::new([EndRule::Hold; D], 0) }
    }

    /// An add-on with a model for a loop with these signals, whose references run at `rate_hz`, Hz, and which
    /// lets corrections be within `caps`. Both lanes are off; the first sample of the trajectory will be that of tick 0.
    ///
    /// # Errors
    /// As [`AddOn::check`].
    pub fn new<'t>(
        model: &'m Model<'m, C, O, A>,
        signals: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
    ) -> Result<Self, Refusal> {
        let mut add_on = Self::empty();
        add_on.load(model, signals, rate_hz, caps)?;
        Ok(add_on)
    }

    /// Whether a model is for a loop with these signals, reference rate (Hz) and bounds.
    ///
    /// # Errors
    /// If the signals differ, the rate does, the bounds say too little, or the model looks at more than `N` samples of the
    /// trajectory.
    pub fn check<'t>(
        model: &Model<'_, C, O, A>,
        signals: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
    ) -> Result<(), Refusal> {
        Adapter::<D, M, R, C, O, A>::check(model, &signals.into(), rate_hz, caps, N)
    }

    /// [`AddOn::new`] in place; nothing of what was here is left but a correction, which goes by its slew.
    ///
    /// # Errors
    /// As [`AddOn::check`]; then nothing changes.
    pub fn load<'t>(
        &mut self,
        model: &'m Model<'m, C, O, A>,
        signals: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
    ) -> Result<(), Refusal> {
        let signals = signals.into();
        Self::check(model, signals, rate_hz, caps)?;
        self.adapter.load(model, &signals, caps);
        self.preview.restart(end_rules(&signals), 0);
        Ok(())
    }

    /// An add-on without a model, in place: from now on the reference is the desired one. The trajectory is forgotten, its next
    /// sample will be that of tick 0.
    ///
    /// # Errors
    /// If there are more channels than `D`, `M` or `R`, or a reference channel has the name of no desired one; then nothing
    /// changes.
    pub fn bypass<'t>(&mut self, signals: impl Into<Channels<'t>>) -> Result<(), Refusal> {
        let signals = signals.into();
        self.adapter.bypass(&signals)?;
        self.preview.restart(end_rules(&signals), 0);
        Ok(())
    }

    /// The model that is flown.
    pub fn model(&self) -> Option<&'m Model<'m, C, O, A>> {
        self.adapter.model()
    }

    /// Appends the desired channels of tick [`AddOn::next_tick`]. Push as far ahead as the future of
    /// [`Card::preview_span`](crate::model::Card::preview_span); what is missing is taken as the trajectory's end.
    ///
    /// # Errors
    /// If a number is not finite, or the preview is full; then nothing is stored.
    pub fn push(&mut self, desired: [f32; D]) -> Result<(), PushError> {
        if let Some(channel) = desired.iter().position(|value| !value.is_finite()) {
            return Err(PushError::NotFinite { channel });
        }
        // The oldest sample goes: it must have been flown, and the model must have done with it.
        if self.preview.is_ahead_full(self.adapter.last_tick(), self.adapter.behind()) {
            return Err(PushError::Full);
        }
        self.preview.push(desired);
        Ok(())
    }

    /// Whether there is a sample of the trajectory.
    pub fn has_trajectory(&self) -> bool {
        !self.preview.is_empty()
    }

    /// Forgets the samples of tick `from` and later, in whose place others will be pushed: the next one is that of `from`, unless
    /// fewer had been pushed. What lies before stays: for another trajectory from there on.
    pub fn truncate(&mut self, from: i32) {
        self.preview.truncate(from);
        self.adapter.replanned(from);
    }

    /// Tick of the next sample that is pushed.
    pub fn next_tick(&self) -> i32 {
        self.preview.next_tick()
    }

    /// The desired channels at a tick; beyond the samples that are kept as the channels' end rules say.
    pub fn desired(&self, tick: i32) -> [f32; D] {
        self.preview.sample(tick)
    }

    /// Forgets the trajectory, for another one: the next sample will be that of `first_tick`. All else stays, also what was
    /// measured: for a jump of the trajectory on the way.
    pub fn clear(&mut self, first_tick: i32) {
        self.preview.clear(first_tick);
        self.adapter.replanned(first_tick);
    }

    /// Forgets the trajectory and everything that was measured and corrected, but for the counts and the lanes that are wanted,
    /// which fade in again: for a loop that was at rest. The next sample will be that of `first_tick`.
    pub fn reset(&mut self, first_tick: i32) {
        self.preview.clear(first_tick);
        self.adapter.reset();
    }

    /// Forgets everything but the model, the signals and the guard's settings: as when the model came, with both lanes off. The
    /// next sample will be that of `first_tick`.
    pub fn restart(&mut self, first_tick: i32) {
        self.preview.clear(first_tick);
        self.adapter.restart();
    }

    /// Switches lanes; they fade in and out over the model's fade time. Both off and faded out: the reference is the desired one,
    /// to the bit.
    pub fn switch(&mut self, lanes: Lanes) {
        self.adapter.switch(lanes);
    }

    /// Gives inferences time until the next reference tick, for a network in a task of lower priority; once, after the model
    /// came.
    pub fn defer(&mut self) {
        self.adapter.defer();
    }

    /// One reference tick, the network included: takes what is measured and gives the reference that the loop shall track. The
    /// scratch needs [`Network::scratch_words`](crate::network::Network::scratch_words).
    pub fn step<const S: usize>(&mut self, tick: i32, measured: &[f32; M], scratch: &mut Scratch<S>) -> [f32; R] {
        self.adapter.step(tick, &self.preview, measured, scratch)
    }

    /// First part of a reference tick; at a sub-rate tick it gives the job of evaluating the network.
    pub fn begin(&mut self, tick: i32, measured: &[f32; M]) -> Option<Job> {
        self.adapter.begin(tick, &self.preview, measured)
    }

    /// [`AddOn::begin`] that puts the job, if there is one, where the caller has room for it: `true`.
    pub fn begin_into(&mut self, tick: i32, measured: &[f32; M], job: &mut Job) -> bool {
        self.adapter.begin_into(tick, &self.preview, measured, job)
    }

    /// Takes the result of the last job; one that is not awaited any more is dropped.
    pub fn deliver(&mut self, inference: Inference<O>) {
        self.adapter.deliver(inference);
    }

    /// Second part of a reference tick: the reference that the loop shall track.
    pub fn finish(&mut self, tick: i32, measured: &[f32; M]) -> [f32; R] {
        self.adapter.finish(tick, &self.preview, measured)
    }

    /// What was done since the model came.
    pub fn report(&self) -> Report<O> {
        Report::of(&self.adapter, self.next_tick())
    }

    /// Which lanes the guard lets act, and its evidence; none without a model.
    pub fn guard(&self) -> Option<&Guard<A>> {
        self.adapter.guard()
    }

    /// Sets the guard, which is on with [`GuardSettings::default`] from the start.
    pub fn set_guard(&mut self, settings: GuardSettings) {
        self.adapter.set_guard(settings);
    }

    /// Lets lanes act again that the guard has locked out.
    pub fn rearm(&mut self) {
        self.adapter.rearm();
    }

    /// Tells how many reference ticks ago the newest measurement arrived; 0 from the start.
    pub fn set_age(&mut self, ticks: u16) {
        self.adapter.set_age(ticks);
    }

    /// Tells for how many reference ticks what is measured has stood still although it must have changed, as the application
    /// knows; 0 from the start. It counts as an age.
    pub fn set_standing(&mut self, ticks: u16) {
        self.adapter.set_standing(ticks);
    }

    /// States that these measured channels have noise in them ([`Adapter::expect_noise`]).
    pub fn expect_noise(&mut self, channels: impl IntoIterator<Item = usize>, ticks: u16) {
        self.adapter.expect_noise(channels, ticks);
    }

    /// What the feedback lane corrected of each reference channel in the last tick ([`Adapter::fed_back`]).
    pub fn fed_back(&self) -> [f32; R] {
        self.adapter.fed_back()
    }

    /// States whether the loop moves the machine ([`Adapter::set_airborne`]).
    pub fn set_airborne(&mut self, airborne: bool) {
        self.adapter.set_airborne(airborne);
    }

    /// Reference ticks of the trajectory that the model looks back at from the one that is flown; 0 without a model.
    pub fn behind(&self) -> i32 {
        self.adapter.behind()
    }

    /// Adapter and trajectory, for whoever does more with them than a whole add-on does.
    pub fn parts(&mut self) -> (&mut Adapter<'m, D, M, R, C, O, A>, &mut Preview<D, N>) {
        (&mut self.adapter, &mut self.preview)
    }
}

impl<const D: usize, const M: usize, const R: usize, const N: usize, const C: usize, const O: usize, const A: usize> Default
    for AddOn<'_, D, M, R, N, C, O, A>
{
    fn default() -> Self {
        Self::empty()
    }
}

/// What each desired channel is beyond the trajectory's ends; array elements behind the table's channels are held.
fn end_rules<const D: usize>(signals: &Channels<'_>) -> [EndRule; D] {
    core::array::from_fn(|channel| signals.desired.get(channel).map_or(EndRule::Hold, |desired| desired.end))
}
