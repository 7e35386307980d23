//! Dense layers with int8 or int16 weights, codes of at most 16 bits and 32-bit accumulators.
//!
//! A row's accumulator is Σ weight × code + bias, the weights in the units of [`super::kernel`]. A code never exceeds the limit
//! that the card gives for the layer's inputs, and validation proves for every row that then no accumulator leaves 32 bits. A
//! hidden layer turns it into a code with one rounded multiplication, (accumulator × multiplier + 2³¹) / 2³²; the last one into
//! f32 with a scale.

use super::{
    kernel::{self, Finish, Width, portable},
    shape::{INPUT_PADDING, ROWS, padded},
};
use crate::format::{Activation, Blob, LayerLayout, Refusal, ranges::ROW_SCALES};

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    kernel: kernel::Integer<'a>,
    width: Width,
    /// Words of a row's inputs.
    inputs: u16,
    /// Largest code of its inputs.
    limit: u16,
}

/// Biases, weights and requantisation of eight rows.
type Block<'a> = (&'a [[u8; 4]; ROWS], &'a [[u8; 4]], &'a [[u8; 4]; ROWS]);

impl<'a> Layer<'a> {
    /// Checks layer `index`; `before` is the activation that gives its inputs, `next_limit` the limit of the codes that it gives.
    pub(super) fn new(
        blob: &Blob<'a>,
        width: Width,
        layout: &LayerLayout,
        index: u8,
        before: Activation,
        next: Option<&LayerLayout>,
    ) -> Result<Self, Refusal> {
        let limit = layout.input_limit;
        if limit == 0 || limit > i16::MAX as u16 {
            return Err(Refusal::Value { what: "largest input code" });
        }
        let finish = match (next.map(|next| next.input_limit), layout.activation) {
            (None, _) => Finish::Sums,
            (Some(limit), Activation::Relu) => Finish::Codes { limit },
            (Some(limit), Activation::Tanh) => Finish::Tanh { limit },
            (Some(limit), Activation::Linear) => Finish::Linear { limit },
        };
        let inputs = usize::from(layout.inputs).next_multiple_of(INPUT_PADDING) / 2;
        let blocks = padded(layout.outputs.into()) / ROWS;
        let stream = blob.words(layout.rows, blocks * width.block(inputs), "layer rows")?.all();
        let kernel = kernel::Integer::new(width, stream, inputs, finish);
        let layer = Self { kernel, width, inputs: inputs as u16, limit };
        layer.refuse_overflow(index, before)?;
        if next.is_none() {
            for scale in layer.blocks().flat_map(|(_, _, scales)| scales.map(f32::from_le_bytes)) {
                if !scale.is_finite() {
                    return Err(Refusal::NotFinite { what: ROW_SCALES.what });
                }
                ROW_SCALES.check(scale)?;
            }
        }
        Ok(layer)
    }

    fn blocks(&self) -> impl Iterator<Item = Block<'a>> + use<'a> {
        self.kernel.stream().chunks_exact(self.width.block(self.inputs.into())).filter_map(|block| {
            let (bias, rest) = block.split_first_chunk()?;
            let (weights, requantisation) = rest.split_last_chunk()?;
            Some((bias, weights, requantisation))
        })
    }

    /// No accumulator may leave 32 bits for any codes.
    fn refuse_overflow(&self, index: u8, before: Activation) -> Result<(), Refusal> {
        let limit = i64::from(self.limit);
        for (bias, weights, _) in self.blocks() {
            let bias = bias.map(|bias| i64::from(i32::from_le_bytes(bias)));
            // Sums of the positive and of the negative weights.
            let (mut positive, mut negative) = ([0i64; ROWS], [0i64; ROWS]);
            for words in weights.chunks_exact(self.width.words()) {
                for (place, word) in words.iter().enumerate() {
                    let word = u32::from_le_bytes(*word);
                    let rows = match self.width {
                        Width::Int8 => portable::byte_rows(word),
                        Width::Int16 => [portable::halves(word), [0; 2]],
                    };
                    for (row, weight) in rows.iter().enumerate().flat_map(|(row, weights)| weights.map(|weight| (row, weight))) {
                        let row = place * ROWS / self.width.words() + row;
                        let (Some(positive), Some(negative)) = (positive.get_mut(row), negative.get_mut(row)) else { continue };
                        *positive += i64::from(weight.max(0));
                        *negative += i64::from(weight.min(0));
                    }
                }
            }
            for ((bias, positive), negative) in bias.into_iter().zip(positive).zip(negative) {
                let (high, low) = match before {
                    Activation::Relu => (bias + positive * limit, bias + negative * limit),
                    Activation::Tanh | Activation::Linear => {
                        (bias + (positive - negative) * limit, bias - (positive - negative) * limit)
                    }
                };
                if high > i64::from(i32::MAX) || low < i64::from(i32::MIN) {
                    return Err(Refusal::Overflow { layer: index });
                }
            }
        }
        Ok(())
    }
}

/// 1.5 × 2²³: in the f32 above it the last bit is worth 1.
const ROUNDING: f32 = 12_582_912.0;

/// The nearest integer, halves to the even one, within ±`limit`. NaN gives either limit.
#[inline(always)]
fn code(value: f32, limit: i32) -> i16 {
    let integer = ((value + ROUNDING).to_bits() as i32).saturating_sub(ROUNDING.to_bits() as i32);
    integer.clamp(-limit, limit) as i16
}

/// Makes codes of so many normalised inputs, which are padded with zeros, and likewise of those.
#[inline(always)]
pub(super) fn encode(factor: f32, inputs: usize, layers: &[Layer<'_>], normalised: &[u32], codes: &mut [u32]) {
    let limit = layers.first().map_or(0, |layer| i32::from(layer.limit));
    let padded = inputs.next_multiple_of(INPUT_PADDING);
    let pairs = normalised.as_chunks::<2>().0.iter().take(padded / 2);
    for (word, [low, high]) in codes.iter_mut().zip(pairs) {
        let [low, high] = [*low, *high].map(|value| code(f32::from_bits(value) * factor, limit));
        *word = portable::pair(low, high);
    }
}

/// Runs all layers on the codes in `current`; gives the last one's accumulators.
#[inline(always)]
pub(super) fn sums<'s>(layers: &[Layer<'_>], mut current: &'s mut [u32], mut other: &'s mut [u32]) -> &'s [u32] {
    for layer in layers {
        layer.kernel.run(current, other);
        core::mem::swap(&mut current, &mut other);
    }
    current
}

/// Scales of the last layer's rows, block by block.
pub(super) fn blocks_of_scales<'a>(layers: &[Layer<'a>]) -> impl Iterator<Item = &'a [[u8; 4]; ROWS]> + use<'a> {
    // Without layers there is nothing but the skip.
    let none = core::iter::repeat(&[[0; 4]; ROWS]);
    layers.last().map(Layer::blocks).into_iter().flatten().map(|(_, _, scales)| scales).chain(none)
}

/// Scales of the last layer's rows, if it has one block.
#[inline(always)]
pub(super) fn scales<'a>(layers: &[Layer<'a>]) -> &'a [[u8; 4]; ROWS] {
    layers.last().and_then(|layer| layer.kernel.stream().last_chunk()).unwrap_or(&[[0; 4]; ROWS])
}
