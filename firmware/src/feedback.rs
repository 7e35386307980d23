//! Feedback lane: a stored linear map over lagged tracking errors and the lane's own past outputs, plus an integral.
//!
//! *in* tracking errors, each measured against what was desired at the time of the measurement, at the reference's own rate;
//! *out* a bounded correction for each axis; *never* more than the two clamps added, whatever comes in;
//! *source* linear-quadratic gain on an ARX model of the closed loop whose past inputs and outputs are its state. What differs:
//! the integral's share is split off in its steady state, so that fast and slow part can be clamped apart.

use heapless::Vec;

use crate::{
    format::{Blob, DEFAULT_AXES, FeedbackAxis, FeedbackLayout, Floats, MAX_ERRORS, MAX_LAGS, Refusal, ranges},
    math::{abs, clamp, finite_or_zero},
};

/// Length of the standard error sequence of the lane's probe, ticks.
pub const PROBE_TICKS: u32 = 64;

/// One checked axis.
#[derive(Debug)]
pub struct Axis<'a> {
    layout: FeedbackAxis,
    errors: Floats<'a>,
    outputs: Floats<'a>,
    /// Steady-state value of the output for an integral of 1.
    slow_gain: f32,
    /// Integral at which the slow part reaches its clamp.
    integral_bound: f32,
}

/// A feedback lane whose shapes and values have been checked.
#[derive(Debug)]
pub struct Lane<'a, const A: usize = DEFAULT_AXES> {
    lags: usize,
    axes: Vec<Axis<'a>, A>,
}

impl<'a, const A: usize> Lane<'a, A> {
    /// Checks shapes and values of a layout against the blob.
    ///
    /// # Errors
    /// With the section or value that is wrong.
    pub fn new(layout: &FeedbackLayout<A>, blob: &Blob<'a>) -> Result<Self, Refusal> {
        let mut lane = Self::empty(layout);
        lane.fill(layout, blob)?;
        Ok(lane)
    }

    /// [`Lane::new`] in `place`. After an error there may be a part of a lane.
    pub(crate) fn load(place: &mut Option<Self>, layout: &FeedbackLayout<A>, blob: &Blob<'a>) -> Result<(), Refusal> {
        Self::begin(place, layout).fill(layout, blob)
    }

    #[inline(never)]
    fn begin<'p>(place: &'p mut Option<Self>, layout: &FeedbackLayout<A>) -> &'p mut Self {
        place.insert(Self::empty(layout))
    }

    /// A lane whose axes are yet to come.
    fn empty(layout: &FeedbackLayout<A>) -> Self {
        Self { lags: layout.lags.into(), axes: Vec::new() }
    }

    #[inline(never)]
    fn fill(&mut self, layout: &FeedbackLayout<A>, blob: &Blob<'a>) -> Result<(), Refusal> {
        let lags = self.lags;
        for axis in &layout.axes {
            let count = axis.errors.len() * lags;
            let coefficients = blob.floats(axis.coefficients, count + lags, "lane coefficients")?;
            ranges::LANE_COEFFICIENTS.all(coefficients)?;
            let (errors, outputs) = coefficients.split_at(count);
            // With a constant output s and no error, s = sum(c) s + integral share: the share's steady state.
            let denominator = 1.0 - outputs.iter().sum::<f32>();
            let slow_gain = axis.integral / denominator;
            if !(denominator > 1e-3 && slow_gain.is_finite()) {
                return Err(Refusal::Value { what: "sum of the lane's past-output coefficients" });
            }
            // Without a slow part nothing is integrated.
            let integral_bound = if slow_gain == 0.0 { 0.0 } else { (axis.integral_limit / abs(slow_gain)).min(f32::MAX) };
            let _ = self.axes.push(Axis { layout: axis.clone(), errors, outputs, slow_gain, integral_bound });
        }
        Ok(())
    }

    /// The axes in the order of the model's layout.
    pub fn axes(&self) -> &[Axis<'a>] {
        &self.axes
    }

    /// Multiplications in one tick.
    pub fn multiply_adds(&self) -> u32 {
        self.axes.iter().map(|axis| (axis.errors.len() + axis.outputs.len() + 1) as u32).sum()
    }
}

impl Axis<'_> {
    /// Index of the corrected output, and the errors' (measured, desired) channels.
    pub fn layout(&self) -> &FeedbackAxis {
        &self.layout
    }
}

/// Memory of one axis: newest first.
#[derive(Clone, Copy, Debug)]
pub struct AxisState {
    errors: [[f32; MAX_LAGS]; MAX_ERRORS],
    outputs: [f32; MAX_LAGS],
    integral: f32,
    clamped: bool,
}

impl AxisState {
    /// Nothing seen yet: all zeros.
    pub const EMPTY: Self =
        Self { errors: [[0.0; MAX_LAGS]; MAX_ERRORS], outputs: [0.0; MAX_LAGS], integral: 0.0, clamped: false };

    /// Whether the fast part was at its clamp in the last tick.
    pub fn clamped(&self) -> bool {
        self.clamped
    }

    /// Takes this tick's errors (in the order of the layout) and returns the lane's output on this axis: finite and within both
    /// clamps, whatever comes in.
    /// `authority` (0..=1) scales the fast clamp and what is integrated; `dt` is the reference's period, s. While not `active`
    /// the lags are filled and the integral stands still: a lane that is faded out must not lose its slow part at once;
    /// [`AxisState::clear_integral`] empties it afterwards.
    #[inline]
    pub fn step<const A: usize>(
        &mut self,
        lane: &Lane<'_, A>,
        axis: &Axis<'_>,
        errors: [f32; MAX_ERRORS],
        authority: f32,
        dt: f32,
        active: bool,
    ) -> f32 {
        self.step_lagged(lane.lags, axis, errors, authority, dt, active)
    }

    /// The same code for lanes of any number of axes.
    fn step_lagged(
        &mut self,
        lags: usize,
        axis: &Axis<'_>,
        errors: [f32; MAX_ERRORS],
        authority: f32,
        dt: f32,
        active: bool,
    ) -> f32 {
        for (lagged, error) in self.errors.iter_mut().zip(errors) {
            push(lagged, lags, finite_or_zero(error));
        }
        let layout = &axis.layout;
        let slow = clamp(axis.slow_gain * self.integral, -layout.integral_limit, layout.integral_limit);
        let mut fast = 0.0;
        let mut coefficients = axis.errors;
        for lagged in self.errors.iter().take(layout.errors.len()) {
            let (these, rest) = coefficients.split_at(lags);
            coefficients = rest;
            fast += dot(these, lagged, 0.0);
        }
        fast += dot(axis.outputs, &self.outputs, slow);
        let authority = clamp(authority, 0.0, 1.0);
        let fast_limit = layout.fast_limit * authority;
        let bounded = clamp(fast, -fast_limit, fast_limit);
        self.clamped = bounded != fast;
        let increment = self.errors[0][0] * dt * authority;
        // Only its own clamp stops the integral: a constant disturbance larger than the fast clamp must still be absorbed. The
        // integral itself is bounded, so that neither a long nor a single huge error can wind it up.
        if active {
            let bound = axis.integral_bound;
            self.integral = clamp(self.integral + finite_or_zero(increment), -bound, bound);
        }
        bounded + slow
    }

    /// Tells the axis what was really applied of its output.
    pub fn applied<const A: usize>(&mut self, lane: &Lane<'_, A>, value: f32) {
        push(&mut self.outputs, lane.lags, finite_or_zero(value));
    }

    /// What was really applied of its output last.
    pub fn last(&self) -> f32 {
        let [last, ..] = self.outputs;
        last
    }

    /// Empties the integral: the lane is faded out.
    pub fn clear_integral(&mut self) {
        self.integral = 0.0;
    }
}

/// Shifts by one and stores the newest value in front.
#[inline]
fn push(lagged: &mut [f32; MAX_LAGS], lags: usize, newest: f32) {
    let mut carried = newest;
    for place in lagged.iter_mut().take(lags) {
        core::mem::swap(place, &mut carried);
    }
}

/// Σ c·(x - offset) in four interleaved sums: the same order on every machine, and not one long chain of additions.
#[inline]
fn dot(coefficients: Floats<'_>, values: &[f32; MAX_LAGS], offset: f32) -> f32 {
    let mut sums = [0.0f32; 4];
    let blocks = coefficients.blocks::<4>();
    let whole = blocks.len() * 4;
    for (block, values) in blocks.zip(values.as_chunks::<4>().0) {
        for ((sum, coefficient), value) in sums.iter_mut().zip(block).zip(values) {
            *sum += coefficient * (value - offset);
        }
    }
    // Split off: to skip the blocks would be to go through them again.
    let (_, tail) = coefficients.split_at(whole);
    let tail = tail.iter().zip(values.get(whole..).unwrap_or_default());
    let rest = tail.fold(0.0, |sum, (coefficient, value)| sum + coefficient * (value - offset));
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// The lane's output on each axis after [`PROBE_TICKS`] ticks of a fixed pseudo-random error sequence of ±1 cm.
pub fn probe<const A: usize>(lane: &Lane<'_, A>, dt: f32) -> [f32; A] {
    let mut noise = 1u32;
    let mut draw = || {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((noise >> 16) as f32 - 32_768.0) * (0.01 / 32_768.0)
    };
    let mut results = [0.0; A];
    for (axis, result) in lane.axes.iter().zip(&mut results) {
        let mut state = AxisState::EMPTY;
        for _ in 0..PROBE_TICKS {
            *result = state.step(lane, axis, core::array::from_fn(|_| draw()), 1.0, dt, true);
            state.applied(lane, *result);
        }
    }
    results
}
