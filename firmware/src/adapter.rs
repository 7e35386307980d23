//! The add-on: corrects the references of any stable loop.
//!
//! *in* desired channels (pushed ahead of time) and measured channels, at every reference tick; *out* the reference channels;
//! *never* a correction beyond the application's [caps](crate::caps) or the model's limits, never a change of it beyond their
//! slew, never any change of the desired reference when both lanes are off and faded out, be it by the user or by the
//! [guard](crate::guard); *source* Zhou 2017, Fig. 1. What differs: the correction is ramped between
//! sub-rate ticks, and a feedback lane adds to it.

mod clock;
mod correction;
mod fade;
mod feedback;
mod inference;
mod ramp;
mod readings;
mod signals;
mod tick;
mod window;

use crate::{
    caps::{Bounds, Caps},
    features,
    format::{Channels, DEFAULT_AXES, DEFAULT_CHANNELS, DEFAULT_OUTPUTS, EndRule, Refusal},
    guard::{Features, Guard, GuardSettings, Outcome, Trips},
    model::Model,
    network::Scratch,
    preview::Preview,
};
use clock::Clock;
use correction::{Correction, Wanted};
use fade::Fade;
use feedback::Feedback;
pub use inference::{Inference, Job};
use ramp::Ramp;
use signals::{History, View, base_channels, measured_channels, same_signals, whole_signals};
use window::Jumps;

pub use crate::{format::HISTORY, lanes::Lanes};

/// Adapter for a loop with `D` desired, `M` measured and `R` reference channels.
///
/// A reference tick is [`Adapter::begin`] and [`Adapter::finish`]. At a sub-rate tick the first gives the [`Job`] of evaluating
/// the network, whose [`Inference`] is [delivered](Adapter::deliver): between the two ([`Adapter::step`] does it all), or, by a
/// task that the control loop interrupts, until the next reference tick ([`Adapter::defer`]).
#[derive(Debug)]
pub struct Adapter<
    'm,
    const D: usize,
    const M: usize,
    const R: usize,
    const C: usize = DEFAULT_CHANNELS,
    const O: usize = DEFAULT_OUTPUTS,
    const A: usize = DEFAULT_AXES,
> {
    model: Option<&'m Model<'m, C, O, A>>,
    guard: Guard<A>,
    /// Desired channel from which each reference channel starts.
    base: [usize; R],
    measured: History<M>,
    references: History<R>,
    /// Sub-rate ticks.
    clock: Clock,
    ramp: Ramp<O>,
    /// Whether an inference may take up to the next reference tick.
    deferred: bool,
    feedback: Feedback<A>,
    /// Lanes that are wanted.
    lanes: Lanes,
    /// How far each lane is faded in, 0..=1.
    network_weight: f32,
    feedback_weight: f32,
    correction: Correction<R>,
    /// What the application lets the correction be.
    bounds: Bounds<R, A>,
    /// Of each desired channel the reciprocal of what a window of it may move by in a sub-rate tick.
    paces: [f32; D],
    /// The newest measurement that was one,
    good: Option<[f32; M]>,
    /// and how many reference ticks in a row brought none since.
    bad: u16,
    /// The desired reference of the last tick that had one, which stands in when there is no trajectory;
    held: Option<[f32; R]>,
    /// measured channel from which each reference channel starts when there never was one.
    origin: [Option<u8>; R],
    /// Where the desired trajectory jumps,
    jumps: Jumps,
    /// and the share of the network's correction that what is desired leaves it, 0..=1.
    share: f32,
    /// Reference ticks that the model looks behind and ahead,
    behind: i32,
    ahead: i32,
    /// and ticks in which the trajectory did not reach as far.
    starved: u32,
    /// What the guard is shown at the next tick: what the lanes did in this one,
    outcome: Outcome<O, A>,
    /// whether a lane was wanted or acted, so that it counts,
    acted: bool,
    /// the features since then,
    features: Features,
    /// how old the newest measurement is, and for how long it has stood still although it must have changed, reference ticks.
    age: u16,
    standing: u16,
    /// The loop does not move the machine yet.
    grounded: bool,
    /// Measured channels of which a new measurement is never as the last, by the application's word, a bit for each,
    noisy: u32,
    /// for how many reference ticks one may stand in, and for how many they have been the same.
    repeats: u16,
    same: u16,
    /// What stands for their values in the last tick.
    print: u32,
}

impl<'m, const D: usize, const M: usize, const R: usize, const C: usize, const O: usize, const A: usize>
    Adapter<'m, D, M, R, C, O, A>
{
    /// An adapter without a model, which corrects nothing: all zeros. It is 6 KB large, so a microcontroller has it in a static,
    /// or in something that is one, and [loads](Adapter::load) it there.
    pub const fn empty() -> Self {
        Self {
            model: None,
            guard: Guard::EMPTY,
            base: [0; R],
            measured: History::new([EndRule::Hold; M], 0),
            references: History::new([EndRule::Hold; R], 0),
            clock: Clock::EMPTY,
            ramp: Ramp::EMPTY,
            deferred: false,
            feedback: Feedback::EMPTY,
            lanes: Lanes::NONE,
            network_weight: 0.0,
            feedback_weight: 0.0,
            correction: Correction::NONE,
            bounds: Bounds::EMPTY,
            paces: [0.0; D],
            good: None,
            bad: 0,
            held: None,
            origin: [None; R],
            jumps: Jumps::NONE,
            share: 0.0,
            behind: 0,
            ahead: 0,
            starved: 0,
            outcome: Outcome::NONE,
            acted: false,
            features: Features::Unchanged,
            age: 0,
            standing: 0,
            grounded: false,
            noisy: 0,
            repeats: 0,
            same: 0,
            print: 0,
        }
    }

    /// Loads a model into an application whose signals are `table`, whose references run at `rate_hz`, which lets corrections be
    /// within `caps`, and whose preview keeps `capacity` samples. Both lanes are off.
    ///
    /// # Errors
    /// If signals, rate, bounds or preview length do not fit.
    pub fn new<'t>(
        model: &'m Model<'m, C, O, A>,
        table: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
        capacity: usize,
    ) -> Result<Self, Refusal> {
        let table = table.into();
        Self::check(model, &table, rate_hz, caps, capacity)?;
        let mut adapter = Self::empty();
        adapter.load(model, &table, caps);
        Ok(adapter)
    }

    /// Whether [`Adapter::new`] takes a model.
    ///
    /// # Errors
    /// As [`Adapter::new`].
    pub fn check(
        model: &Model<'_, C, O, A>,
        table: &Channels<'_>,
        rate_hz: f32,
        caps: &Caps<'_>,
        capacity: usize,
    ) -> Result<(), Refusal> {
        let card = model.card();
        same_signals(card, table, [D, M, R])?;
        Bounds::<R, A>::check(caps, table.reference.len())?;
        let rate = card.timing.reference_rate_hz;
        // Written so that NaN and infinity are refused.
        let near = rate_hz < f32::MAX && (rate - rate_hz).abs() <= 1e-3 * rate_hz;
        if !near {
            return Err(Refusal::Rate { model: rate, application: rate_hz });
        }
        let (past, future) = card.preview_span();
        if past + future + 1 > capacity as u32 {
            return Err(Refusal::Preview { needed: past + future + 1, available: capacity as u32 });
        }
        Ok(())
    }

    /// Makes this, in its place, what [`Adapter::new`] makes of a model that passes [`Adapter::check`]. With another one it is as
    /// safe, and of no use.
    pub fn load(&mut self, model: &'m Model<'m, C, O, A>, table: &Channels<'_>, caps: &Caps<'_>) {
        let rate_hz = model.card().timing.reference_rate_hz;
        self.model = Some(model);
        self.guard.load(GuardSettings::default(), rate_hz);
        self.bounds.load(caps, rate_hz);
        let (behind, ahead) = model.card().preview_span();
        (self.behind, self.ahead) = (behind as i32, ahead as i32);
        self.jumps = Jumps::of(&model.card().features);
        self.paces = window::paces(model.card(), &model.envelope(), self.guard.settings());
        self.know(table);
        self.deferred = false;
        self.restart();
    }

    /// Learns where references come from.
    fn know(&mut self, table: &Channels<'_>) {
        self.base = base_channels(table);
        self.origin = measured_channels(table);
    }

    /// Takes the model away, in place: from now on the reference is the desired one of an application whose signals are `table`.
    ///
    /// # Errors
    /// If a signal has too many channels, or a reference channel the name of no desired one; then nothing changes.
    pub fn bypass(&mut self, table: &Channels<'_>) -> Result<(), Refusal> {
        whole_signals(table, [D, M, R])?;
        self.model = None;
        self.know(table);
        self.restart();
        Ok(())
    }

    /// Forgets everything but the model and its guard's settings, also the counts: as it was when the model came. Both lanes are
    /// off. A correction that was left goes by its slew.
    pub fn restart(&mut self) {
        self.forget();
        self.ramp = Ramp::EMPTY;
        (self.correction.saturations, self.starved) = (0, 0);
        self.guard.restart();
        self.switch(Lanes::NONE);
    }

    /// Forgets everything but the lanes that are wanted and the counts: the next tick is the first one, of a loop at rest. The
    /// correction is gone at once.
    pub fn reset(&mut self) {
        self.forget();
        self.correction.reset();
    }

    /// Forgets what was seen.
    fn forget(&mut self) {
        (self.clock, self.good, self.bad, self.held) = (Clock::EMPTY, None, 0, None);
        self.measured.clear(0);
        self.references.clear(0);
        self.forget_lanes();
        self.features = Features::Unchanged;
        self.jumps.clear();
        (self.age, self.standing, self.same) = (0, 0, 0);
        self.guard.reset();
    }

    /// The lanes begin anew, and fade in again.
    fn forget_lanes(&mut self) {
        self.ramp.clear();
        self.feedback.reset();
        (self.network_weight, self.feedback_weight, self.acted) = (0.0, 0.0, false);
    }

    /// The model that is flown.
    pub fn model(&self) -> Option<&'m Model<'m, C, O, A>> {
        self.model
    }

    /// Switches lanes; they are faded in and out over the model's fade time.
    pub fn switch(&mut self, lanes: Lanes) {
        self.lanes = lanes;
        self.guard.switched(lanes);
    }

    /// Which lanes the guard lets act, and its counterfactual monitor.
    pub fn guard(&self) -> Option<&Guard<A>> {
        self.model.map(|_| &self.guard)
    }

    /// The guard's trips since the model came, or [`Adapter::restart`].
    pub fn trips(&self) -> Trips {
        self.guard.trips()
    }

    /// Sets the guard, which is on with [`GuardSettings::default`] from the start.
    pub fn set_guard(&mut self, settings: GuardSettings) {
        self.guard.set(settings);
        if let Some(model) = self.model {
            self.paces = window::paces(model.card(), &model.envelope(), self.guard.settings());
        }
    }

    /// Lets lanes act again that the guard has locked out.
    pub fn rearm(&mut self) {
        self.guard.rearm();
    }

    /// Tells how many reference ticks ago the newest measurement arrived; 0 from the start.
    pub fn set_age(&mut self, ticks: u16) {
        self.age = ticks;
    }

    /// Tells for how many reference ticks what is measured has stood still although it must have changed, as the application
    /// knows; 0 from the start. It counts as an age.
    pub fn set_standing(&mut self, ticks: u16) {
        self.standing = ticks;
    }

    /// States that these measured channels have noise in them, so that all of them together are never twice the same but where no
    /// new measurement came, for at most `ticks` reference ticks in a row. Once they have been the same for longer, they have
    /// stood still for as long: that counts as an age. Channels behind the last are none; without channels, as from the start,
    /// nothing is stated.
    pub fn expect_noise(&mut self, channels: impl IntoIterator<Item = usize>, ticks: u16) {
        self.noisy = channels.into_iter().fold(0, |all, channel| all | u32::from(channel < M.min(32)) << (channel & 31));
        (self.repeats, self.same) = (ticks, 0);
    }

    /// States whether the loop moves the machine: a vehicle on the ground, or a machine that is held, does not follow. Until it
    /// does, no lane acts, nothing is integrated, learned or judged; then the lanes fade in. It does from the start on.
    pub fn set_airborne(&mut self, airborne: bool) {
        self.grounded = !airborne;
    }

    /// Lanes that are wanted of a loop that moves its machine.
    fn wanted(&self) -> Lanes {
        if self.grounded { Lanes::NONE } else { self.lanes }
    }

    /// For how many reference ticks the channels with noise have been the same, if for longer than they may be; else 0.
    fn repeated(&mut self, measured: &[f32; M]) -> u16 {
        if self.noisy == 0 {
            return 0;
        }
        let stated = measured.iter().enumerate().filter(|(channel, _)| self.noisy >> (channel & 31) & 1 == 1);
        // A number that stands for all of them: two in a row are the same by chance once in four billion ticks.
        let print =
            stated.fold(0u32, |sum, (_, value)| sum.wrapping_add(value.to_bits()).wrapping_mul(0x9e37_79b1).rotate_left(13));
        self.same = if print == self.print { self.same.saturating_add(1) } else { 0 };
        self.print = print;
        if self.same > self.repeats { self.same } else { 0 }
    }

    /// Reference ticks in a second of the model that is flown; 0 without one.
    pub fn rate_hz(&self) -> f32 {
        self.model.map_or(0.0, |model| model.card().timing.reference_rate_hz)
    }

    /// Tells that what is desired at this tick and later has been replaced ([`Preview::truncate`], [`Preview::clear`]).
    pub fn replanned(&mut self, from: i32) {
        self.jumps.forget(from);
    }

    /// Gives inferences time until the next reference tick. A ramped correction is the same as before: it starts from what was
    /// evaluated a sub-rate tick ago. A held one comes a reference tick later.
    pub fn defer(&mut self) {
        self.deferred = true;
    }
}
