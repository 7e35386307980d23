//! Row-major f32 matrices whose rows are padded to whole vectors.

use pulp::{Arch, Simd, WithSimd};

/// Rows are padded to a multiple of this many numbers: one AVX-512 register, one cache line.
pub const LANES: usize = 16;

/// A row-major matrix whose rows are followed by zeros, so that the kernels read and write whole vectors only.
///
/// The stride is an *odd* number of cache lines: with a power of two, the rows of a panel would all fall into the same
/// few sets of the first-level cache.
#[derive(Debug, Clone, PartialEq)]
pub struct PaddedMatrix {
    /// Rows.
    pub rows: usize,
    /// Columns, padding not counted.
    pub columns: usize,
    /// Numbers from one row's first to the next row's first.
    pub stride: usize,
    /// The rows one after the other, each with its padding.
    pub values: Vec<f32>,
}

impl PaddedMatrix {
    /// All zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        let stride = (columns.div_ceil(LANES) | 1) * LANES;
        Self { rows, columns, stride, values: vec![0.0; rows * stride] }
    }

    /// The element of each row and column is `value(row, column)`.
    pub fn from_fn(rows: usize, columns: usize, mut value: impl FnMut(usize, usize) -> f32) -> Self {
        let mut matrix = Self::zeros(rows, columns);
        for row in 0..rows {
            for (column, slot) in matrix.row_mut(row).iter_mut().enumerate() {
                *slot = value(row, column);
            }
        }
        matrix
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The number of columns, padding not counted.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row without its padding.
    pub fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.stride..][..self.columns]
    }

    /// One row without its padding.
    pub fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.stride..][..self.columns]
    }

    /// The columns rounded up to whole vectors.
    pub fn width(&self) -> usize {
        self.columns.next_multiple_of(LANES)
    }

    /// One row with its padding up to [`PaddedMatrix::width`].
    pub fn wide_row_mut(&mut self, row: usize) -> &mut [f32] {
        let width = self.width();
        &mut self.values[row * self.stride..][..width]
    }

    /// Copies one row of a matrix with as many columns.
    pub fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        self.row_mut(row).copy_from_slice(from.row(from_row));
    }

    /// Writes the transpose of `from`, in blocks of 16 × 16 that are transposed in registers.
    pub fn copy_transposed(&mut self, arch: Arch, from: &Self) {
        arch.dispatch(Transposition { from, to: self });
    }
}

struct Transposition<'a> {
    from: &'a PaddedMatrix,
    to: &'a mut PaddedMatrix,
}

impl WithSimd for Transposition<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { from, to } = self;
        for first_row in (0..from.rows).step_by(LANES) {
            for first_column in (0..from.columns).step_by(LANES) {
                let mut block = [[0.0; LANES]; LANES];
                let source = from.values[first_row * from.stride..].chunks_exact(from.stride);
                for (line, row) in block.iter_mut().zip(source) {
                    line.copy_from_slice(&row[first_column..][..LANES]);
                }
                transpose_block(&mut block);
                let target = to.values[first_column * to.stride..].chunks_exact_mut(to.stride);
                for (line, row) in block.iter().zip(target) {
                    row[first_row..][..LANES].copy_from_slice(line);
                }
            }
        }
    }
}

/// Exchanges the off-diagonal quarters of blocks of 2, 4, 8 and 16 rows: shuffles of whole registers.
#[inline(always)]
fn transpose_block(block: &mut [[f32; LANES]; LANES]) {
    exchange::<1>(block);
    exchange::<2>(block);
    exchange::<4>(block);
    exchange::<8>(block);
}

#[inline(always)]
fn exchange<const HALF: usize>(block: &mut [[f32; LANES]; LANES]) {
    for row in 0..LANES {
        if row & HALF == 0 {
            let (upper, lower) = (block[row], block[row + HALF]);
            for column in 0..LANES {
                if column & HALF == 0 {
                    block[row][column + HALF] = lower[column];
                    block[row + HALF][column] = upper[column + HALF];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stride_is_an_odd_number_of_cache_lines_and_padding_is_zero() {
        for columns in [1, 12, 16, 17, 128, 130, 150] {
            let matrix = PaddedMatrix::from_fn(3, columns, |_, _| 1.0);
            assert!(matrix.stride >= columns && (matrix.stride / LANES) % 2 == 1);
            assert_eq!(matrix.values.iter().sum::<f32>(), (3 * columns) as f32);
        }
    }

    #[test]
    fn transposes_any_shape() {
        for (rows, columns) in [(1, 1), (6, 128), (128, 6), (33, 17)] {
            let matrix = PaddedMatrix::from_fn(rows, columns, |row, column| (row * 1000 + column) as f32);
            let mut transposed = PaddedMatrix::zeros(columns, rows);
            transposed.copy_transposed(Arch::new(), &matrix);
            let expected = PaddedMatrix::from_fn(columns, rows, |row, column| (column * 1000 + row) as f32);
            assert_eq!(transposed, expected);
        }
    }
}
