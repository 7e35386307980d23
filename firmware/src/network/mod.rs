//! Fixed-size feed-forward network: normalise, dense layers plus a linear skip, denormalise.
//!
//! *in* features in physical units; *out* corrections in physical units; *never* allocates, panics or gives other bits on another
//! machine, or takes longer for other inputs; *source* Zhou 2017, section IV-A (dense layers); the linear skip from inputs to
//! outputs is ours.
//!
//! # The map
//! With n = (x − mean) · (1 / scale) in f32, and d(·) the dense layers,
//! output = (skip(n) + d(n)) · output scale + output mean. Float layers follow the order of operations in [`kernel`]. Integer
//! layers:
//! 1. the inputs' codes are n · `input_code`, rounded to the nearest integer (halves to even), within ± the first layer's
//!    [`input_limit`](crate::format::LayerLayout::input_limit);
//! 2. a hidden layer's accumulator a, exact in 32 bits, becomes c = ⌊a · multiplier / 2³² + ½⌋. ReLU: c within 0..=L, L being the
//!    next layer's limit. Linear: c within ±L. Tanh: c within 16 bits is a pre-activation in units of 1/[`TANH_INPUT_ONE`],
//!    [`tanh_code`] makes a code of it, of which L is 1;
//! 3. the last layer's accumulators, as f32, times the scales of their rows.

mod float;
mod integer;
pub mod kernel;
mod requantisation;
mod scratch;
mod shape;
mod tanh;

use crate::format::{Arithmetic, Blob, Floats, MAX_FEATURES, MAX_LAYERS, MAX_OUTPUTS, NetworkLayout, Refusal, ranges};

pub use crate::format::Activation;
pub use requantisation::requantise;
pub use scratch::{MAX_SCRATCH, Scratch};
pub use shape::{INPUT_PADDING, ROWS, padded};
pub use tanh::{TANH_CODE_ERROR, TANH_ERROR, TANH_INPUT_ONE, tanh, tanh_code};

// Only where floats have no assembly: there is no heap for the larger variant.
#[allow(clippy::large_enum_variant, reason = "without a heap")]
#[derive(Debug)]
enum Layers<'a> {
    Float(heapless::Vec<float::Layer<'a>, MAX_LAYERS>),
    Integer { code: f32, layers: heapless::Vec<integer::Layer<'a>, MAX_LAYERS> },
}

/// A network whose shapes and sections have been checked.
#[derive(Debug)]
pub struct Network<'a> {
    mean: Floats<'a>,
    reciprocal_scale: Floats<'a>,
    layers: Layers<'a>,
    skip: Option<float::Layer<'a>>,
    output_scale: Floats<'a>,
    output_mean: Floats<'a>,
    multiply_adds: u32,
    /// Words of the widest activations.
    half: usize,
}

impl<'a> Network<'a> {
    /// Checks shapes, sections and ranges of a layout against the blob, for `inputs` features and `outputs` corrections. Probes
    /// are [`Model::from_bytes`](crate::model::Model::from_bytes)' affair.
    ///
    /// # Errors
    /// With the section or value that is wrong.
    pub fn new(layout: &NetworkLayout, blob: &Blob<'a>, inputs: usize, outputs: usize) -> Result<Self, Refusal> {
        let mut place = None;
        Self::load(&mut place, layout, blob, inputs, outputs)?;
        place.ok_or(Refusal::Card)
    }

    /// Checks shapes and sections against `inputs` features and `outputs` corrections, and makes the network in `place`. After an
    /// error there may be a part of one.
    #[inline(never)]
    pub(crate) fn load(
        place: &mut Option<Self>,
        layout: &NetworkLayout,
        blob: &Blob<'a>,
        inputs: usize,
        outputs: usize,
    ) -> Result<(), Refusal> {
        let network = Self::ends(place, layout, blob, inputs, outputs)?;
        match &mut network.layers {
            Layers::Float(layers) => {
                for layer in &layout.layers {
                    let _ = layers.push(float::Layer::new(blob, layer)?);
                }
                Ok(())
            }
            Layers::Integer { layers, .. } => integer_layers(layers, layout, blob),
        }
    }

    /// A network without its layers.
    #[inline(never)]
    fn ends<'p>(
        place: &'p mut Option<Self>,
        layout: &NetworkLayout,
        blob: &Blob<'a>,
        inputs: usize,
        outputs: usize,
    ) -> Result<&'p mut Self, Refusal> {
        if inputs > MAX_FEATURES || outputs == 0 || outputs > MAX_OUTPUTS {
            return Err(Refusal::Shape { what: "number of outputs", found: outputs as u32, limit: MAX_OUTPUTS as u32 });
        }
        let (mean, reciprocal_scale) =
            blob.floats(layout.input_normalisation, 2 * inputs, "input normalisation")?.split_at(inputs);
        let (output_scale, output_mean) =
            blob.floats(layout.output_normalisation, 2 * outputs, "output normalisation")?.split_at(outputs);
        ranges::INPUT_MEAN.all(mean)?;
        ranges::INPUT_SCALE.all(reciprocal_scale)?;
        ranges::OUTPUT_SCALE.all(output_scale)?;
        ranges::OUTPUT_MEAN.all(output_mean)?;
        let mut multiply_adds = chained(layout, inputs, outputs)?;
        let skip = if layout.skip.length > 0 {
            multiply_adds += (inputs * outputs) as u32;
            Some(float::Layer::skip(blob, layout.skip, inputs, outputs)?)
        } else if layout.layers.is_empty() {
            let what = "number of layers without a skip";
            return Err(Refusal::Shape { what, found: 0, limit: MAX_LAYERS as u32 });
        } else {
            None
        };
        let layers = match layout.arithmetic {
            Arithmetic::Float => Layers::Float(heapless::Vec::new()),
            Arithmetic::Int16 | Arithmetic::Int8 => {
                if !layout.input_code.is_finite() {
                    return Err(Refusal::NotFinite { what: "input code" });
                }
                ranges::INPUT_CODE.check(layout.input_code)?;
                Layers::Integer { code: layout.input_code, layers: heapless::Vec::new() }
            }
        };
        let half = scratch::half(layout, inputs, outputs);
        Ok(place.insert(Self { mean, reciprocal_scale, layers, skip, output_scale, output_mean, multiply_adds, half }))
    }

    /// Multiplications with a weight in one evaluation.
    pub fn multiply_adds(&self) -> u32 {
        self.multiply_adds
    }

    /// Words of [`Scratch`] that an evaluation needs.
    pub fn scratch_words(&self) -> usize {
        2 * self.half
    }

    /// Evaluates the network: `inputs` in physical units, one for each feature; `outputs` in the units of the corrected channels.
    /// Inputs that no training has can make an output that is no finite number; [`Job::run`](crate::adapter::Job::run) leaves it
    /// out.
    /// A scratch of fewer words than [`Network::scratch_words`], or fewer inputs than features, leave `outputs` as they are.
    #[inline]
    pub fn evaluate<const WORDS: usize>(&self, inputs: &[f32], outputs: &mut [f32], scratch: &mut Scratch<WORDS>) {
        self.run(Some(inputs), outputs, scratch.words());
    }

    /// [`Network::evaluate`] for as many inputs as there are features, which need not lie in an array.
    pub(crate) fn evaluate_each(&self, inputs: impl Iterator<Item = f32>, outputs: &mut [f32], scratch: &mut Scratch) {
        let Some((front, back)) = self.halves(scratch.words()) else { return };
        self.normalise(inputs, self.normalised(front, back));
        self.run(None, outputs, scratch.words());
        outputs.iter_mut().for_each(|output| *output = meant(*output));
    }

    /// The scratch's two parts; `None`: it has too few words.
    #[inline(always)]
    fn halves<'s>(&self, scratch: &'s mut [u32]) -> Option<(&'s mut [u32], &'s mut [u32])> {
        let (front, rest) = scratch.split_at_mut_checked(self.half)?;
        Some((front, rest.get_mut(..self.half)?))
    }

    /// The part of the scratch in which the normalised inputs are.
    #[inline(always)]
    fn normalised<'s>(&self, front: &'s mut [u32], back: &'s mut [u32]) -> &'s mut [u32] {
        match &self.layers {
            Layers::Float(_) => front,
            Layers::Integer { .. } => back,
        }
    }

    /// Evaluates the network; without inputs, those that are in the scratch already, normalised.
    #[inline(never)]
    fn run(&self, inputs: Option<&[f32]>, outputs: &mut [f32], scratch: &mut [u32]) {
        let Some((front, back)) = self.halves(scratch) else { return };
        if let Some(inputs) = inputs {
            let Some(inputs) = inputs.get(..self.mean.len()) else { return };
            self.normalise(inputs.iter().copied(), self.normalised(front, back));
        }
        match &self.layers {
            Layers::Float(layers) => {
                self.skip(front, outputs);
                let values = float::outputs(layers, front, back);
                self.denormalise(values.iter().map(|value| f32::from_bits(*value)), outputs);
            }
            Layers::Integer { code, layers } => {
                integer::encode(*code, self.mean.len(), layers, back, front);
                self.skip(back, outputs);
                let sums = integer::sums(layers, front, back);
                if self.output_scale.len() > ROWS {
                    self.denormalise_blocks(sums, layers, outputs);
                } else {
                    self.denormalise(scaled(sums, integer::scales(layers)), outputs);
                }
            }
        }
    }

    /// Normalises the inputs into `words`, padded with zeros.
    #[inline(always)]
    fn normalise(&self, inputs: impl Iterator<Item = f32>, words: &mut [u32]) {
        let normalisation = self.mean.iter().zip(self.reciprocal_scale.iter());
        for ((word, input), (mean, reciprocal)) in words.iter_mut().zip(inputs).zip(normalisation) {
            *word = ((input - mean) * reciprocal).to_bits();
        }
        let mut padded = self.mean.len();
        while !padded.is_multiple_of(INPUT_PADDING) {
            if let Some(word) = words.get_mut(padded) {
                *word = 0;
            }
            padded += 1;
        }
    }

    /// Writes the skip's outputs, if there is one.
    #[inline(always)]
    fn skip(&self, normalised: &[u32], outputs: &mut [f32]) {
        // The rows behind the last output are padding.
        let count = self.output_scale.len().min(outputs.len());
        if let (Some(skip), Some(outputs)) = (&self.skip, outputs.get_mut(..count)) {
            skip.outputs(normalised, outputs);
        }
    }

    /// [`Network::denormalise`] of integer layers with more outputs than a block has rows. Apart from what a small network needs
    /// of the stack.
    #[cold]
    #[inline(never)]
    fn denormalise_blocks(&self, sums: &[u32], layers: &[integer::Layer<'_>], outputs: &mut [f32]) {
        let values = sums.chunks(ROWS).zip(integer::blocks_of_scales(layers)).flat_map(|(sums, scales)| scaled(sums, scales));
        self.denormalise(values, outputs);
    }

    /// Adds the dense layers' outputs to the skip's, and makes physical units of them.
    #[inline(always)]
    fn denormalise(&self, values: impl Iterator<Item = f32>, outputs: &mut [f32]) {
        let denormalisation = self.output_scale.iter().zip(self.output_mean.iter());
        for ((output, value), (scale, mean)) in outputs.iter_mut().zip(values).zip(denormalisation) {
            let skip = if self.skip.is_some() { *output } else { 0.0 };
            *output = (skip + value) * scale + mean;
        }
    }
}

/// Accumulators of a block, each times the scale of its row.
#[inline(always)]
fn scaled(sums: &[u32], scales: &[[u8; 4]; ROWS]) -> impl Iterator<Item = f32> {
    sums.iter().zip(scales).map(|(sum, scale)| *sum as i32 as f32 * f32::from_le_bytes(*scale))
}

/// An output that is no number, or larger than any that is believed, was not meant: 0.
pub(crate) fn meant(output: f32) -> f32 {
    if crate::math::abs(output) <= ranges::MAGNITUDE { output } else { 0.0 }
}

/// Checks that the layers' shapes follow from each other; gives their number of multiplications.
fn chained(layout: &NetworkLayout, inputs: usize, outputs: usize) -> Result<u32, Refusal> {
    let (mut width, mut multiply_adds) = (inputs, 0);
    for (index, layer) in layout.layers.iter().enumerate() {
        if usize::from(layer.inputs) != width {
            return Err(Refusal::Shape { what: "layer inputs", found: layer.inputs.into(), limit: width as u32 });
        }
        multiply_adds += u32::from(layer.inputs) * u32::from(layer.outputs);
        width = usize::from(layer.outputs);
        let last = index + 1 == layout.layers.len();
        if last && (width != outputs || layer.activation != Activation::Linear) {
            let what = "outputs of the last (linear) layer";
            return Err(Refusal::Shape { what, found: width as u32, limit: outputs as u32 });
        }
    }
    Ok(multiply_adds)
}

#[inline(never)]
fn integer_layers<'a>(
    layers: &mut heapless::Vec<integer::Layer<'a>, MAX_LAYERS>,
    layout: &NetworkLayout,
    blob: &Blob<'a>,
) -> Result<(), Refusal> {
    let width = if layout.arithmetic == Arithmetic::Int16 { kernel::Width::Int16 } else { kernel::Width::Int8 };
    let mut before = Activation::Linear;
    for (index, layer) in layout.layers.iter().enumerate() {
        let next = layout.layers.get(index + 1);
        let _ = layers.push(integer::Layer::new(blob, width, layer, index as u8, before, next)?);
        before = layer.activation;
    }
    Ok(())
}
