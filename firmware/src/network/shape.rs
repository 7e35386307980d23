//! How the kernels' rows and inputs are grouped.
//!
//! *in* numbers of outputs and inputs; *out* the same rounded up to whole blocks; *never* a block that is partly filled; *source*
//! the streams of [`super::kernel`].

/// Outputs that are computed side by side.
pub const ROWS: usize = 8;
/// Inputs of an integer layer are padded to a multiple of this; of a float layer to a multiple of 2.
pub const INPUT_PADDING: usize = 4;

/// Rows of a packed layer: outputs rounded up to whole blocks.
pub const fn padded(outputs: usize) -> usize {
    outputs.next_multiple_of(ROWS)
}
