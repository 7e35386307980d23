//! A loop with a module in front of it, sample by sample.
//!
//! *in* a plant, a module, the desired output; *out* a [`Run`]; *never* more than the module asks for: what it sees is a
//! [`Moment`], the same in training and in flight; *source* Zhou 2017, figure 1.

use crate::siso::Scalar;

/// A loop of one reference and one output, linear or not.
pub trait Plant<T: Scalar>: Sync {
    /// Number of states.
    fn order(&self) -> usize;
    /// y of a state.
    fn output(&self, state: &[T]) -> T;
    /// The state one sample later.
    fn advance(&self, state: &mut [T], reference: T);
}

/// All that a module may read at a sample.
#[derive(Clone, Copy)]
pub struct Moment<'a, T: Scalar> {
    /// The sample, 0 at the start.
    pub sample: i64,
    /// Measured state.
    pub state: &'a [T],
    /// Past references, oldest first; before the start they were zero.
    pub references: &'a [T],
    /// The desired output at any sample.
    pub desired: &'a dyn Fn(i64) -> T,
}

impl<T: Scalar> Moment<'_, T> {
    /// The desired output in `offset` samples.
    pub fn desired(&self, offset: i64) -> T {
        (self.desired)(self.sample + offset)
    }

    /// The reference of `offset` samples ago (negative; -1 is the newest).
    pub fn reference(&self, offset: i64) -> T {
        let index = self.sample + offset;
        usize::try_from(index).ok().and_then(|index| self.references.get(index)).copied().unwrap_or(T::of(0.0))
    }

    /// A measured state; zero for one that the plant does not have.
    pub fn state(&self, index: usize) -> T {
        self.state.get(index).copied().unwrap_or(T::of(0.0))
    }
}

/// What chooses the reference.
pub trait Module<T: Scalar> {
    /// The reference of this sample.
    fn reference(&self, moment: &Moment<'_, T>) -> T;
}

impl<T: Scalar, F: Fn(&Moment<'_, T>) -> T> Module<T> for F {
    fn reference(&self, moment: &Moment<'_, T>) -> T {
        self(moment)
    }
}

/// How a run starts and what disturbs it.
pub struct Start<'a, T: Scalar> {
    /// State at sample 0; what is missing is zero.
    pub state: Vec<T>,
    /// Added to the reference on its way into the plant; the module does not see it.
    pub disturbance: &'a dyn Fn(i64) -> T,
}

impl<T: Scalar> Start<'_, T> {
    /// From rest, undisturbed.
    pub fn rest() -> Self {
        Self { state: Vec::new(), disturbance: &|_| T::of(0.0) }
    }
}

/// What happened, one number (one state) a sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Run<T: Scalar> {
    /// y_d.
    pub desired: Vec<T>,
    /// u, as the module gave it.
    pub reference: Vec<T>,
    /// y.
    pub output: Vec<T>,
    /// x, before the reference of that sample acted.
    pub states: Vec<Vec<T>>,
}

impl<T: Scalar> Run<T> {
    /// y - y_d, in f64.
    pub fn errors(&self) -> Vec<f64> {
        self.output.iter().zip(&self.desired).map(|(output, desired)| output.wide() - desired.wide()).collect()
    }

    /// RMS of y - y_d from sample `from` on.
    pub fn tracking_rms(&self, from: usize) -> f64 {
        rms(self.errors().into_iter().skip(from))
    }

    /// First sample at which |y - y_d| is above `limit`, or not a number.
    pub fn first_error_above(&self, limit: f64) -> Option<usize> {
        self.errors().iter().position(|error| error.is_nan() || error.abs() > limit)
    }

    /// The moment of a sample, as the module saw it.
    pub fn moment<'a>(&'a self, sample: usize, desired: &'a dyn Fn(i64) -> T) -> Moment<'a, T> {
        Moment { sample: sample as i64, state: &self.states[sample], references: &self.reference[..sample], desired }
    }
}

/// Root of the mean square; zero of nothing.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value * value;
        count += 1;
    }
    libm::sqrt(sum / count.max(1) as f64)
}

/// Runs `samples` samples.
pub fn simulate<T: Scalar>(
    plant: &impl Plant<T>,
    module: &(impl Module<T> + ?Sized),
    desired: &dyn Fn(i64) -> T,
    start: &Start<'_, T>,
    samples: usize,
) -> Run<T> {
    let mut state = vec![T::of(0.0); plant.order()];
    state.iter_mut().zip(&start.state).for_each(|(state, value)| *state = *value);
    let mut run = Run {
        desired: Vec::with_capacity(samples),
        reference: Vec::with_capacity(samples),
        output: Vec::with_capacity(samples),
        states: Vec::with_capacity(samples),
    };
    for sample in 0..samples as i64 {
        let reference = module.reference(&Moment { sample, state: &state, references: &run.reference, desired });
        run.desired.push(desired(sample));
        run.output.push(plant.output(&state));
        run.states.push(state.clone());
        run.reference.push(reference);
        plant.advance(&mut state, reference + (start.disturbance)(sample));
    }
    run
}
