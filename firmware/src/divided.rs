//! A loop that runs faster than the model: the add-on works in every k-th tick of it, and the correction is ramped between.
//!
//! *in* ticks of the loop, and the desired trajectory at every k-th of them; *out* the reference of every tick; *never* a change
//! of the correction beyond the slew of the model and the application's caps, shared among the ticks; without a correction any
//! other reference than what is desired, to the bit; *source* training, which takes every k-th sample of the log of a fast loop.
//!
//! Features, lags, guard and what is learned keep the rate of the model, up to 200 Hz, however fast the loop is. Every number
//! that is called a tick here is one of the loop. What is desired now goes into the reference at the loop's own rate; of what is
//! desired later every k-th sample is asked for, by [`Divided::next_tick`], which is k ticks further on after each: whoever fills
//! an [`AddOn`] by `while add_on.next_tick() <= tick + ahead` fills this one in the same words. A correction is ramped over the k
//! ticks from the one on in which it was found.
//!
//! ```
//! use impromptu_firmware::{Cap, Caps, Channel, Channels, Divided, EndRule, Lanes, Model, Scratch};
//!
//! const ANGLE: Channel = Channel { name: "angle", unit: "rad", frame: "output shaft", end: EndRule::Hold };
//! const SIGNALS: Channels = Channels { desired: &[ANGLE], measured: &[ANGLE], reference: &[ANGLE] };
//! const CAPS: Caps = Caps { channels: &[Cap { limit: 0.5, rate: 20.0 }], sums: &[] };
//!
//! let model = Model::from_bytes(include_bytes!("../examples/one_axis.impromptu"))?;
//! // The model's rate is 500 Hz, the loop's 2 kHz.
//! let mut add_on = Divided::<1, 1, 1, 128>::empty();
//! add_on.load(&model, SIGNALS, 2000.0, &CAPS)?;
//! assert_eq!(add_on.divisor(), 4);
//! add_on.add_on_mut().switch(Lanes::BOTH);
//! let mut scratch = Scratch::new();
//! # use impromptu_firmware::math::sin_cos;
//! # fn desired(tick: i32) -> f32 { 0.8 - 0.8 * sin_cos(0.0015 * tick as f32).1 }
//! # #[derive(Default)] struct Servo { angle: f32, speed: f32 }
//! # let (mut servo, mut largest) = (Servo::default(), 0.0f32);
//! for tick in 0..20_000 {
//!     while add_on.next_tick() <= tick + add_on.ahead() {
//!         add_on.push([desired(add_on.next_tick())])?;
//!     }
//! #   largest = largest.max((servo.angle - desired(tick)).abs());
//!     let [reference] = add_on.step(tick, &[desired(tick)], &[servo.angle], &mut scratch);
//! #   servo.speed += 0.0005 * (500.0 * (reference - servo.angle) - 35.0 * servo.speed);
//! #   servo.angle += 0.0005 * servo.speed;
//! }
//! # assert!(largest < 0.1, "{largest}");
//! assert_eq!(add_on.add_on().report().trips.by_lane(), [0, 0]);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

use crate::{
    adapter::{Inference, Job},
    add_on::{AddOn, PushError},
    caps::Caps,
    format::{Channels, DEFAULT_AXES, DEFAULT_CHANNELS, DEFAULT_OUTPUTS, Refusal},
    math::clamp,
    model::Model,
    network::Scratch,
};

/// Most ticks of a loop to a tick of the model.
pub const MOST_TICKS: u16 = 1000;

/// Ramps what is found in every k-th tick of a loop, channel by channel: corrections of a [`Divided`] add-on, or of a
/// [learner](crate::learning::LearningAddOn) that runs as rarely.
#[derive(Clone, Debug)]
pub struct Interpolator<const R: usize> {
    /// Ticks of the ramp, one less: all zeros is a ramp of one tick.
    more: u16,
    /// Ticks since the ramp began.
    done: u16,
    start: [f32; R],
    end: [f32; R],
    value: [f32; R],
    /// Largest change of a value in a tick.
    slews: [f32; R],
}

impl<const R: usize> Interpolator<R> {
    /// At zero, with ramps of so many ticks, 1 to [`MOST_TICKS`].
    pub const fn new(ticks: u16) -> Self {
        let zeros = [0.0; R];
        let more = if ticks == 0 { 0 } else { ticks - 1 };
        Self { more, done: 0, start: zeros, end: zeros, value: zeros, slews: zeros }
    }

    /// Ticks of a ramp.
    pub fn ticks(&self) -> u16 {
        self.more.saturating_add(1)
    }

    /// The tick of the slower rate that begins at this tick of the loop, if one does.
    pub fn due(&self, tick: i32) -> Option<i32> {
        let ticks = i32::from(self.ticks()).max(1);
        (tick.rem_euclid(ticks) == 0).then(|| tick.div_euclid(ticks))
    }

    /// From now on towards these values, which differ from the last ones by at most `slews`.
    pub fn towards(&mut self, values: [f32; R], slews: &[f32; R]) {
        let share = 1.0 / f32::from(self.ticks());
        (self.start, self.end, self.done) = (self.value, values, 0);
        self.slews = slews.map(|slew| slew * share);
    }

    /// The values of the tick that begins. In order they change evenly; where ticks were left out, by no more than their slews.
    pub fn advance(&mut self) -> [f32; R] {
        let ticks = self.ticks();
        self.done = self.done.saturating_add(1).min(ticks);
        if ticks == 1 {
            self.value = self.end;
            return self.value;
        }
        let share = f32::from(self.done) / f32::from(ticks);
        for (((value, start), end), slew) in self.value.iter_mut().zip(&self.start).zip(&self.end).zip(&self.slews) {
            let target = if self.done == ticks { *end } else { start + (end - start) * share };
            *value = clamp(target, *value - slew, *value + slew);
        }
        self.value
    }

    /// The values of the last tick.
    pub fn values(&self) -> &[f32; R] {
        &self.value
    }

    /// Zero at once: for a loop at rest.
    pub fn reset(&mut self) {
        *self = Self::new(self.ticks());
    }
}

/// [`AddOn`] of a loop that runs k times as fast as the model: see the [module](self).
#[derive(Debug)]
pub struct Divided<
    'm,
    const D: usize,
    const M: usize,
    const R: usize,
    const N: usize,
    const C: usize = DEFAULT_CHANNELS,
    const O: usize = DEFAULT_OUTPUTS,
    const A: usize = DEFAULT_AXES,
> {
    add_on: AddOn<'m, D, M, R, N, C, O, A>,
    correction: Interpolator<R>,
    /// The last reference without a correction.
    uncorrected: [f32; R],
    /// The job of this tick's beginning is under way, and its end is not there yet.
    begun: bool,
}

impl<'m, const D: usize, const M: usize, const R: usize, const N: usize, const C: usize, const O: usize, const A: usize>
    Divided<'m, D, M, R, N, C, O, A>
{
    /// As [`AddOn::empty`]: all zeros, for a static.
    pub const fn empty() -> Self {
        Self { add_on: AddOn::empty(), correction: Interpolator::new(1), uncorrected: [0.0; R], begun: false }
    }

    /// Loads a model, in place, before a loop that runs at `rate_hz`, Hz: a whole number of times the model's rate. All else as
    /// [`AddOn::load`]; the first sample of the trajectory will be that of tick 0.
    ///
    /// # Errors
    /// As [`AddOn::check`], and if the rate is no multiple of the model's, or more than [`MOST_TICKS`] times as high; then
    /// nothing changes.
    pub fn load<'t>(
        &mut self,
        model: &'m Model<'m, C, O, A>,
        signals: impl Into<Channels<'t>>,
        rate_hz: f32,
        caps: &Caps<'_>,
    ) -> Result<(), Refusal> {
        let slow = model.card().timing.reference_rate_hz;
        let refused = Refusal::Rate { model: slow, application: rate_hz };
        let times = rate_hz / slow + 0.5;
        // Written so that NaN is refused.
        if !(times >= 1.0 && times < f32::from(MOST_TICKS) + 1.0) {
            return Err(refused);
        }
        let ticks = times as u16;
        self.add_on.load(model, signals, rate_hz / f32::from(ticks), caps).map_err(|refusal| match refusal {
            Refusal::Rate { .. } => refused,
            other => other,
        })?;
        self.begin_anew(ticks);
        Ok(())
    }

    /// Without a model: the reference is what is desired ([`AddOn::bypass`]).
    ///
    /// # Errors
    /// As [`AddOn::bypass`].
    pub fn bypass<'t>(&mut self, signals: impl Into<Channels<'t>>) -> Result<(), Refusal> {
        self.add_on.bypass(signals)?;
        self.begin_anew(1);
        Ok(())
    }

    fn begin_anew(&mut self, ticks: u16) {
        // What is left of another model's correction goes by the ramp.
        self.correction.more = ticks.saturating_sub(1);
        self.correction.towards(*self.correction.values(), &[0.0; R]);
        self.begun = false;
    }

    /// Ticks of the loop to a tick of the model.
    pub fn divisor(&self) -> u16 {
        self.correction.ticks()
    }

    /// Ticks that the trajectory should reach ahead; 0 without a model.
    pub fn ahead(&self) -> i32 {
        let future = self.add_on.model().map_or(0, |model| model.card().preview_span().1 as i32);
        // One more sample, as the present lies between two.
        future.saturating_add(1).saturating_mul(self.divisor().into())
    }

    /// Tick of the next sample that is pushed: a multiple of the divisor.
    pub fn next_tick(&self) -> i32 {
        self.add_on.next_tick().wrapping_mul(self.divisor().into())
    }

    /// Appends the desired channels of tick [`Divided::next_tick`].
    ///
    /// # Errors
    /// As [`AddOn::push`].
    pub fn push(&mut self, desired: [f32; D]) -> Result<(), PushError> {
        self.add_on.push(desired)
    }

    /// Forgets the samples of tick `from` and later ([`AddOn::truncate`]).
    pub fn truncate(&mut self, from: i32) {
        self.add_on.truncate(self.sample_from(from));
    }

    /// Forgets the trajectory: the next sample will be that of the first tick from `from` on of which one is asked for
    /// ([`AddOn::clear`]).
    pub fn clear(&mut self, from: i32) {
        self.add_on.clear(self.sample_from(from));
    }

    /// Forgets trajectory, measurements and correction ([`AddOn::reset`]): for a loop that was at rest.
    pub fn reset(&mut self, from: i32) {
        self.add_on.reset(self.sample_from(from));
        self.correction.reset();
        self.begun = false;
    }

    /// The first sample at a tick or after it.
    fn sample_from(&self, tick: i32) -> i32 {
        let ticks = i32::from(self.divisor()).max(1);
        tick.div_euclid(ticks) + i32::from(tick.rem_euclid(ticks) != 0)
    }

    /// The add-on, whose ticks are those of the model.
    pub fn add_on(&self) -> &AddOn<'m, D, M, R, N, C, O, A> {
        &self.add_on
    }

    /// The add-on, to switch lanes, set its guard and so on; its ticks are those of the model, and are stepped here.
    pub fn add_on_mut(&mut self) -> &mut AddOn<'m, D, M, R, N, C, O, A> {
        &mut self.add_on
    }

    /// One tick of the loop, the network included where it is due: `desired` and `measured` are those of this tick, and what
    /// comes out is the reference that the loop shall track.
    pub fn step<const S: usize>(
        &mut self,
        tick: i32,
        desired: &[f32; D],
        measured: &[f32; M],
        scratch: &mut Scratch<S>,
    ) -> [f32; R] {
        if let Some(job) = self.begin(tick, measured)
            && let Some(network) = self.add_on.model().and_then(Model::network)
        {
            self.deliver(job.run_sized(network, scratch));
        }
        self.finish(tick, desired, measured)
    }

    /// First part of a tick: the job of evaluating the network, if one is due. With [`AddOn::defer`] it has the k ticks until the
    /// next one of the model.
    pub fn begin(&mut self, tick: i32, measured: &[f32; M]) -> Option<Job> {
        let due = self.correction.due(tick)?;
        self.add_on.begin(due, measured)
    }

    /// Takes the result of the last job ([`AddOn::deliver`]).
    pub fn deliver(&mut self, inference: Inference<O>) {
        self.add_on.deliver(inference);
    }

    /// Second part of a tick: the reference that the loop shall track. A desired channel that is no finite number leaves the
    /// reference without its correction where it was.
    pub fn finish(&mut self, tick: i32, desired: &[f32; D], measured: &[f32; M]) -> [f32; R] {
        if let Some(due) = self.correction.due(tick) {
            let reference = self.add_on.finish(due, measured);
            let (adapter, _) = self.add_on.parts();
            let (corrections, slews) = adapter.corrections();
            self.correction.towards(*corrections, slews);
            if !self.begun {
                // Where nothing is desired yet, it is where the machine is.
                self.uncorrected = reference;
            }
            self.begun = true;
        }
        let (adapter, _) = self.add_on.parts();
        for (last, now) in self.uncorrected.iter_mut().zip(adapter.uncorrected(desired)) {
            if now.is_finite() {
                *last = now;
            }
        }
        let mut reference = self.uncorrected;
        for (channel, correction) in reference.iter_mut().zip(self.correction.advance()) {
            // Not even an addition of zero: the baseline's bits.
            if correction != 0.0 {
                *channel += correction;
            }
        }
        reference
    }
}

impl<const D: usize, const M: usize, const R: usize, const N: usize, const C: usize, const O: usize, const A: usize> Default
    for Divided<'_, D, M, R, N, C, O, A>
{
    fn default() -> Self {
        Self::empty()
    }
}

#[cfg(test)]
mod tests;
