//! Dense layers with int8 or int16 weights, codes of at most 16 bits and 32-bit accumulators.
//!
//! A row's accumulator is Σ weight × code + bias, the weights in the units of [`super::kernel`]. A code never exceeds the limit that the
//! card gives for the layer's inputs, and validation proves for every row that then no accumulator leaves 32 bits. A hidden layer turns
//! it into a code with one rounded multiplication, (accumulator × multiplier + 2³¹) / 2³²; the last one into f32 with a scale.

use super::{
    Activation, INPUT_PADDING, ROWS,
    kernel::{self, Finish, Width, portable},
    padded,
    tanh::{code_factor, scaled_tanh},
};
use crate::model::{Blob, LayerLayout, MAX_OUTPUTS, Refusal, Words};

/// One checked layer.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    width: Width,
    stream: Words<'a>,
    /// Words of a row's inputs.
    inputs: u16,
    /// Words of its outputs, as codes, and how many of them the next layer reads.
    outputs: u16,
    read: u16,
    activation: Activation,
    /// Largest code of its inputs and of its outputs.
    limits: [u16; 2],
    /// For tanh.
    factor: i32,
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
        let next_limit = next.map_or(0, |next| next.input_limit);
        let inputs = usize::from(layout.inputs).next_multiple_of(INPUT_PADDING) / 2;
        let rows = padded(layout.outputs.into());
        let layer = Self {
            width,
            stream: blob.words(layout.rows, rows / ROWS * width.block(inputs), "layer rows")?,
            inputs: inputs as u16,
            outputs: (rows / 2) as u16,
            read: (usize::from(layout.outputs).next_multiple_of(INPUT_PADDING) / 2) as u16,
            activation: layout.activation,
            limits: [limit, next_limit],
            factor: code_factor(next_limit),
        };
        layer.refuse_overflow(index, before)?;
        if next.is_none()
            && !layer.blocks().all(|(_, _, scales)| scales.iter().all(|scale| f32::from_le_bytes(*scale).is_finite()))
        {
            return Err(Refusal::NotFinite { what: "layer row scales" });
        }
        Ok(layer)
    }

    fn blocks(&self) -> impl Iterator<Item = Block<'a>> + use<'a> {
        self.stream.chunks(self.width.block(self.inputs.into())).filter_map(|block| {
            let (bias, rest) = block.split_first_chunk()?;
            let (weights, requantisation) = rest.split_last_chunk()?;
            Some((bias, weights, requantisation))
        })
    }

    /// No accumulator may leave 32 bits for any codes.
    fn refuse_overflow(&self, index: u8, before: Activation) -> Result<(), Refusal> {
        let limit = i64::from(self.limits[0]);
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

    #[inline(always)]
    fn hidden(&self, codes: &[u32], outputs: &mut [u32]) {
        let limit = self.limits[1];
        let (Some(codes), Some(outputs)) = (codes.get(..self.inputs.into()), outputs.get_mut(..self.outputs.into())) else {
            return;
        };
        let finish = match self.activation {
            Activation::Relu => Finish::Codes { limit },
            Activation::Tanh | Activation::Linear => Finish::Preactivations,
        };
        kernel::integer(self.width, self.stream.all(), codes, finish, outputs);
        if finish == Finish::Preactivations {
            self.activate(outputs);
        }
    }

    /// Pre-activations to codes; a function of its own, to keep the way of ReLU short.
    #[inline(never)]
    fn activate(&self, words: &mut [u32]) {
        let words = words.get_mut(..self.read.into()).unwrap_or_default();
        if self.activation == Activation::Tanh {
            let factor = self.factor;
            each_code(words, |code| scaled_tanh(code as u16, factor));
        } else {
            let limit = self.limits[1] as i16;
            each_code(words, |code| {
                if code > limit {
                    limit
                } else if code < -limit {
                    -limit
                } else {
                    code
                }
            });
        }
    }

    /// Adds the last layer's outputs to `result`; the accumulators go through `sums`, which saves stack.
    #[inline(never)]
    pub(super) fn last(&self, codes: &[u32], sums: &mut [u32], result: &mut [f32; MAX_OUTPUTS]) {
        let (Some(codes), Some(sums)) = (codes.get(..self.inputs.into()), sums.first_chunk_mut::<ROWS>()) else { return };
        kernel::integer(self.width, self.stream.all(), codes, Finish::Sums, sums);
        let Some(scales) = self.stream.all().last_chunk::<ROWS>() else { return };
        for ((value, sum), scale) in result.iter_mut().zip(sums).zip(scales) {
            *value += *sum as i32 as f32 * f32::from_le_bytes(*scale);
        }
    }
}

#[inline(always)]
fn each_code(words: &mut [u32], map: impl Fn(i16) -> i16) {
    for word in words {
        let [low, high] = portable::halves(*word);
        *word = portable::pair(map(low), map(high));
    }
}

/// 1.5 × 2²³: in the f32 above it the last bit is worth 1.
const ROUNDING: f32 = 12_582_912.0;

/// The nearest integer, halves to the even one, within ±`limit`. Not a number gives either limit.
#[inline(always)]
fn code(value: f32, limit: i32) -> i16 {
    let integer = ((value + ROUNDING).to_bits() as i32).saturating_sub(ROUNDING.to_bits() as i32);
    integer.clamp(-limit, limit) as i16
}

/// Makes codes of `count` normalised inputs (f32, padded with zeros): `factor` is the code of 1.
#[inline(never)]
pub(super) fn encode(normalised: &[u32], count: usize, factor: f32, layers: &[Layer<'_>], codes: &mut [u32]) {
    let limit = layers.first().map_or(0, |layer| i32::from(layer.limits[0]));
    let pairs = normalised.get(..count.next_multiple_of(INPUT_PADDING)).unwrap_or_default().as_chunks::<2>().0;
    for (word, [low, high]) in codes.iter_mut().zip(pairs) {
        *word = portable::pair(code(f32::from_bits(*low) * factor, limit), code(f32::from_bits(*high) * factor, limit));
    }
}

/// Runs the hidden layers on the input codes in `current`; gives the last one's codes, and the other half of the memory.
#[inline(never)]
pub(super) fn hidden<'s>(layers: &[Layer<'_>], mut current: &'s mut [u32], mut other: &'s mut [u32]) -> [&'s mut [u32]; 2] {
    for layer in layers {
        layer.hidden(current, other);
        core::mem::swap(&mut current, &mut other);
    }
    [current, other]
}
