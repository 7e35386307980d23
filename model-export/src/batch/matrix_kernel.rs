//! Matrix products for training and batch evaluation, in safe Rust on vector registers (the `pulp` crate picks AVX-512, AVX2 or
//! scalar code at run time).
//!
//! A tile of 8 rows and 2 vectors of the result stays in registers while the products are summed up; operands are read in
//! place (see [`PaddedMatrix`] for the stride that makes this fast), nothing is packed or transposed, and what comes before
//! and after the sum (bias, activation, derivative) happens while the tile is in registers.
//!
//! Each element is one chain of multiply-adds in the order of the depth, fused unless the edge says otherwise ([`Unfused`]), so
//! the result has the same bits whatever the width of the machine's registers.

use super::padded_matrix::PaddedMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Rows of a tile: with 2 vectors 16 sums, enough to hide the latency of the multiply-adds.
const TILE_ROWS: usize = 8;
/// Vectors of a tile: a panel of 32 columns and 128 rows is 16 KB, half of the first-level cache.
const TILE_VECTORS: usize = 2;

/// What happens to an element before and after its sum of products.
pub trait Edge: Copy {
    /// Whether each multiplication and addition are rounded once, together.
    const FUSED: bool = true;
    /// What the sum starts from, given the element's present value and its column.
    fn start<S: Simd>(self, simd: S, present: S::f32s, column: usize) -> S::f32s;
    /// What is stored, given the sum and the element's present value.
    fn finish<S: Simd>(self, simd: S, sum: S::f32s, present: S::f32s) -> S::f32s;
}

/// The plain product.
#[derive(Clone, Copy)]
pub struct Store;

impl Edge for Store {
    #[inline(always)]
    fn start<S: Simd>(self, simd: S, _: S::f32s, _: usize) -> S::f32s {
        simd.splat_f32s(0.0)
    }
    #[inline(always)]
    fn finish<S: Simd>(self, _: S, sum: S::f32s, _: S::f32s) -> S::f32s {
        sum
    }
}

/// The product added to what is there.
#[derive(Clone, Copy)]
pub struct Accumulate;

impl Edge for Accumulate {
    #[inline(always)]
    fn start<S: Simd>(self, _: S, present: S::f32s, _: usize) -> S::f32s {
        present
    }
    #[inline(always)]
    fn finish<S: Simd>(self, _: S, sum: S::f32s, _: S::f32s) -> S::f32s {
        sum
    }
}

/// The product plus a bias for each column, rectified if asked for.
#[derive(Clone, Copy)]
pub struct Bias<'a, const RECTIFY: bool>(pub &'a [f32]);

impl<const RECTIFY: bool> Edge for Bias<'_, RECTIFY> {
    #[inline(always)]
    fn start<S: Simd>(self, _: S, _: S::f32s, column: usize) -> S::f32s {
        S::as_simd_f32s(&self.0[column..][..S::F32_LANES]).0[0]
    }
    #[inline(always)]
    fn finish<S: Simd>(self, simd: S, sum: S::f32s, _: S::f32s) -> S::f32s {
        if RECTIFY { simd.max_f32s(sum, simd.splat_f32s(0.0)) } else { sum }
    }
}

/// The same with each product rounded before it is added: the bits of a plain loop in f32.
#[derive(Clone, Copy)]
pub struct Unfused<E>(pub E);

impl<E: Edge> Edge for Unfused<E> {
    const FUSED: bool = false;
    #[inline(always)]
    fn start<S: Simd>(self, simd: S, present: S::f32s, column: usize) -> S::f32s {
        self.0.start(simd, present, column)
    }
    #[inline(always)]
    fn finish<S: Simd>(self, simd: S, sum: S::f32s, present: S::f32s) -> S::f32s {
        self.0.finish(simd, sum, present)
    }
}

/// The product times the derivative of ReLU; the result replaces the layer's output, from which the derivative is taken.
#[derive(Clone, Copy)]
pub struct TimesReluDerivative;

impl Edge for TimesReluDerivative {
    #[inline(always)]
    fn start<S: Simd>(self, simd: S, _: S::f32s, _: usize) -> S::f32s {
        simd.splat_f32s(0.0)
    }
    #[inline(always)]
    fn finish<S: Simd>(self, simd: S, sum: S::f32s, present: S::f32s) -> S::f32s {
        let zero = simd.splat_f32s(0.0);
        simd.select_f32s(simd.less_than_f32s(zero, present), sum, zero)
    }
}

/// The product times the derivative of tanh, 1 - h²; the result replaces the layer's output h.
#[derive(Clone, Copy)]
pub struct TimesTanhDerivative;

impl Edge for TimesTanhDerivative {
    #[inline(always)]
    fn start<S: Simd>(self, simd: S, _: S::f32s, _: usize) -> S::f32s {
        simd.splat_f32s(0.0)
    }
    #[inline(always)]
    fn finish<S: Simd>(self, simd: S, sum: S::f32s, present: S::f32s) -> S::f32s {
        simd.mul_f32s(sum, simd.mul_add_f32s(simd.neg_f32s(present), present, simd.splat_f32s(1.0)))
    }
}

/// `c[..rows] = edge(a · b)` over the first `depth` columns of `a` and rows of `b`; with `LEFT_TRANSPOSED`, `a` is read as
/// its transpose and `depth` counts its rows. `c` has the columns of `b`.
pub fn product<const LEFT_TRANSPOSED: bool>(
    arch: Arch,
    (rows, depth): (usize, usize),
    a: &PaddedMatrix,
    b: &PaddedMatrix,
    c: &mut PaddedMatrix,
    edge: impl Edge,
) {
    debug_assert_eq!(b.columns, c.columns);
    arch.dispatch(Product::<_, LEFT_TRANSPOSED> { rows, depth, a, b, c, edge });
}

/// The plain product of two matrices: `c = a · b`.
///
/// # Panics
/// If the shapes do not fit.
pub fn multiply(arch: Arch, a: &PaddedMatrix, b: &PaddedMatrix, c: &mut PaddedMatrix) {
    assert_eq!((a.rows, b.columns, a.columns), (c.rows, c.columns, b.rows), "rows, columns and depth must fit");
    product::<false>(arch, (a.rows, a.columns), a, b, c, Store);
}

struct Product<'a, E, const LEFT_TRANSPOSED: bool> {
    rows: usize,
    depth: usize,
    a: &'a PaddedMatrix,
    b: &'a PaddedMatrix,
    c: &'a mut PaddedMatrix,
    edge: E,
}

impl<E: Edge, const LEFT_TRANSPOSED: bool> WithSimd for Product<'_, E, LEFT_TRANSPOSED> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = self.b.width();
        let mut column = 0;
        while column + TILE_VECTORS * S::F32_LANES <= width {
            self.panel::<S, TILE_VECTORS>(simd, column);
            column += TILE_VECTORS * S::F32_LANES;
        }
        while column < width {
            self.panel::<S, 1>(simd, column);
            column += S::F32_LANES;
        }
    }
}

impl<E: Edge, const LEFT_TRANSPOSED: bool> Product<'_, E, LEFT_TRANSPOSED> {
    /// All rows of `VECTORS` vectors of columns.
    #[inline(always)]
    fn panel<S: Simd, const VECTORS: usize>(&mut self, simd: S, column: usize) {
        let mut row = 0;
        while row + TILE_ROWS <= self.rows {
            self.tile::<S, TILE_ROWS, VECTORS>(simd, row, column);
            row += TILE_ROWS;
        }
        while row + 4 <= self.rows {
            self.tile::<S, 4, VECTORS>(simd, row, column);
            row += 4;
        }
        while row < self.rows {
            self.tile::<S, 1, VECTORS>(simd, row, column);
            row += 1;
        }
    }

    #[inline(always)]
    fn tile<S: Simd, const ROWS: usize, const VECTORS: usize>(&mut self, simd: S, row: usize, column: usize) {
        let span = VECTORS * S::F32_LANES;
        let (a, stride) = (&self.a.values[..], self.c.stride);
        let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
        for (r, sums) in sums.iter_mut().enumerate() {
            let present = S::as_simd_f32s(&self.c.values[(row + r) * stride + column..][..span]).0;
            for (v, (sum, present)) in sums.iter_mut().zip(present).enumerate() {
                *sum = self.edge.start(simd, *present, column + v * S::F32_LANES);
            }
        }
        let rows_of_b = self.b.values.chunks_exact(self.b.stride).take(self.depth);
        if LEFT_TRANSPOSED {
            for (row_of_a, row_of_b) in a.chunks_exact(self.a.stride).zip(rows_of_b) {
                let left: &[f32; ROWS] = row_of_a[row..].first_chunk().expect("rows of the result lie within a");
                multiply_add::<S, E, ROWS, VECTORS>(simd, &mut sums, *left, vectors_of::<S, VECTORS>(&row_of_b[column..]));
            }
        } else {
            // Slices of one known length: the compiler then drops the bounds checks on `step`.
            let lefts: [&[f32]; ROWS] = core::array::from_fn(|r| &a[(row + r) * self.a.stride..][..self.depth]);
            for (step, row_of_b) in rows_of_b.enumerate() {
                let left = core::array::from_fn(|r| lefts[r][step]);
                multiply_add::<S, E, ROWS, VECTORS>(simd, &mut sums, left, vectors_of::<S, VECTORS>(&row_of_b[column..]));
            }
        }
        for (r, sums) in sums.iter().enumerate() {
            let out = S::as_mut_simd_f32s(&mut self.c.values[(row + r) * stride + column..][..span]).0;
            for (slot, sum) in out.iter_mut().zip(sums) {
                *slot = self.edge.finish(simd, *sum, *slot);
            }
        }
    }
}

#[inline(always)]
fn vectors_of<S: Simd, const VECTORS: usize>(row: &[f32]) -> [S::f32s; VECTORS] {
    *S::as_simd_f32s(&row[..VECTORS * S::F32_LANES]).0.first_chunk().expect("rows are padded to whole vectors")
}

#[inline(always)]
fn multiply_add<S: Simd, E: Edge, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    sums: &mut [[S::f32s; VECTORS]; ROWS],
    left: [f32; ROWS],
    right: [S::f32s; VECTORS],
) {
    for (sums, left) in sums.iter_mut().zip(left) {
        let left = simd.splat_f32s(left);
        for (sum, right) in sums.iter_mut().zip(right) {
            *sum = if E::FUSED { simd.mul_add_f32s(left, right, *sum) } else { simd.add_f32s(*sum, simd.mul_f32s(left, right)) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(rows: usize, columns: usize) -> PaddedMatrix {
        PaddedMatrix::from_fn(rows, columns, |row, column| ((row * 31 + column * 17) % 23) as f32 / 7.0 - 1.5)
    }

    /// One chain of fused multiply-adds for each element, as the module promises.
    fn expected(a: impl Fn(usize, usize) -> f32, b: &PaddedMatrix, row: usize, column: usize, start: f32) -> f32 {
        (0..b.rows).fold(start, |sum, step| a(row, step).mul_add(b.row(step)[column], sum))
    }

    #[test]
    fn products_have_the_bits_of_the_plain_loop_for_any_shape() {
        for (rows, depth, columns) in [(1, 1, 1), (13, 12, 40), (16, 6, 128), (5, 33, 6), (24, 128, 48)] {
            let (a, b) = (filled(rows, depth), filled(depth, columns));
            let mut c = PaddedMatrix::zeros(rows, columns);
            multiply(Arch::new(), &a, &b, &mut c);
            let plain =
                PaddedMatrix::from_fn(rows, columns, |row, column| expected(|row, step| a.row(row)[step], &b, row, column, 0.0));
            assert_eq!(c, plain);
            assert_eq!(
                {
                    multiply(Arch::Scalar, &a, &b, &mut c);
                    &c
                },
                &plain,
                "the same without vector registers"
            );

            let left = filled(depth, rows);
            product::<true>(Arch::new(), (rows, depth), &left, &b, &mut c, Accumulate);
            let sum = PaddedMatrix::from_fn(rows, columns, |row, column| {
                expected(|row, step| left.row(step)[row], &b, row, column, plain.row(row)[column])
            });
            assert_eq!(c, sum);
        }
    }

    #[test]
    fn edges_apply_bias_rectifier_and_derivatives() {
        let (a, b, bias) = (filled(9, 5), filled(5, 20), filled(1, 20));
        let sum = |row: usize, column: usize, start: f32| expected(|row, step| a.row(row)[step], &b, row, column, start);
        let mut output = PaddedMatrix::zeros(9, 20);
        product::<false>(Arch::new(), (9, 5), &a, &b, &mut output, Bias::<true>(&bias.values));
        let rectified = PaddedMatrix::from_fn(9, 20, |row, column| sum(row, column, bias.row(0)[column]).max(0.0));
        assert_eq!(output, rectified);
        product::<false>(Arch::new(), (9, 5), &a, &b, &mut output, TimesReluDerivative);
        let derivative = PaddedMatrix::from_fn(
            9,
            20,
            |row, column| {
                if rectified.row(row)[column] > 0.0 { sum(row, column, 0.0) } else { 0.0 }
            },
        );
        assert_eq!(output, derivative);
        product::<false>(Arch::new(), (9, 5), &a, &b, &mut output, TimesTanhDerivative);
        let derivative = PaddedMatrix::from_fn(9, 20, |row, column| {
            let h = derivative.row(row)[column];
            sum(row, column, 0.0) * (-h).mul_add(h, 1.0)
        });
        assert_eq!(output, derivative);
    }
}
