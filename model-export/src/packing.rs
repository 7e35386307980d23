//! Layers in the order in which the kernels stream them ([`impromptu_firmware::network::kernel`]).

use std::ops::Range;

use impromptu_firmware::network::{
    ROWS,
    kernel::{Width, float_blocks, float_rows, portable::pair},
};

use crate::integer_network::IntegerLayer;

/// Inputs of a float layer are padded to a multiple of this.
const FLOAT_PADDING: usize = 2;

/// The rows of each block of a float layer, the last ones padding.
pub(crate) fn float_row_blocks(outputs: usize) -> impl Iterator<Item = Range<usize>> {
    let [twelves, eights, sixes] = float_blocks(float_rows(outputs)).unwrap_or_default();
    let blocks = [(12, twelves), (8, eights), (6, sixes)].into_iter();
    blocks.flat_map(|(height, count)| std::iter::repeat_n(height, count)).scan(0, |next, height| {
        *next += height;
        Some(*next - height..*next)
    })
}

/// The words of a float layer: row-major weights `[outputs][inputs]`, one bias for each output.
pub fn float(weights: &[f32], bias: &[f32], inputs: usize) -> Vec<u32> {
    let outputs = bias.len();
    let mut words = Vec::new();
    for rows in float_row_blocks(outputs) {
        words.extend(rows.clone().map(|row| bias.get(row).copied().unwrap_or(0.0).to_bits()));
        for input in 0..inputs.next_multiple_of(FLOAT_PADDING) {
            let weight = |row: usize| if row < outputs && input < inputs { weights[row * inputs + input] } else { 0.0 };
            words.extend(rows.clone().map(|row| weight(row).to_bits()));
        }
    }
    words
}

/// The words of an integer layer.
pub fn integer(layer: &IntegerLayer, width: Width) -> Vec<u32> {
    let stride = layer.stride();
    let mut words = Vec::new();
    for (block, rows) in layer.weights.chunks(ROWS * stride.max(1)).enumerate() {
        let places = ROWS * block..ROWS * (block + 1);
        words.extend(places.clone().map(|row| layer.bias.get(row).copied().unwrap_or(0) as u32));
        for input in (0..stride).step_by(2) {
            // Of two rows in bytes, the even one's halves are the word; the odd one's follow from it.
            let step = match width {
                Width::Int8 => 2,
                Width::Int16 => 1,
            };
            words.extend(rows.chunks(stride).step_by(step).map(|row| pair(row[input], row[input + 1])));
        }
        words.extend(places.map(|row| match layer.multipliers.get(row) {
            Some(multiplier) => *multiplier as u32,
            None => layer.row_scales.get(row).copied().unwrap_or(0.0).to_bits(),
        }));
    }
    words
}
