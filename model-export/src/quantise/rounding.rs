//! Rounds a layer's weights so that its outputs change least.
//!
//! *in* the wanted weights in effective units and the second moments of the inputs; *out* weights that the kernel's packing can
//! hold; *never* a weight that is further from what is wanted of it than half a step, but at the ends of the range; *source*
//! Frantar et al. 2023 (GPTQ): column after column is rounded, and the columns to come take over what the rounding did to the
//! outputs, by the inverse of the inputs' moments. The packing in [`impromptu_firmware::network::kernel`] fixes the order within
//! a pair of columns and rows.

use impromptu_firmware::network::{INPUT_PADDING, ROWS, kernel::Width};
use nalgebra::{Cholesky, DMatrix, Dyn};

/// Added to the diagonal of the moments, over its mean; without it the few directions that the rows leave out would take all the
/// error.
const DAMPING: f64 = 0.01;

/// Effective weights, row-major `[rows padded to whole blocks][inputs padded]`, for `wanted[row][input]` with `count` inputs.
pub fn round(wanted: &[Vec<f64>], count: usize, width: Width, moments: &DMatrix<f64>) -> Vec<i16> {
    let stride = count.next_multiple_of(INPUT_PADDING);
    let mut rows: Vec<Vec<f64>> = wanted.to_vec();
    rows.resize(wanted.len().next_multiple_of(ROWS), Vec::new());
    rows.iter_mut().for_each(|row| row.resize(stride, 0.0));
    let factor = inverse_factor(moments);
    let mut weights = vec![0i16; rows.len() * stride];
    for (pair, rows) in rows.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        // Of a pair of columns: the packed bytes, in the order in which they are chosen.
        let mut bytes = [0i32; 4];
        for column in 0..stride {
            let chosen = match width {
                Width::Int16 => rows.each_ref().map(|row| row[column].round().clamp(-32_767.0, 32_767.0) as i32),
                Width::Int8 => two_bytes(rows.each_ref().map(|row| row[column]), column % 2 == 1, &mut bytes),
            };
            for (index, (row, chosen)) in rows.iter_mut().zip(chosen).enumerate() {
                weights[(2 * pair + index) * stride + column] = chosen as i16;
                if column < count {
                    let error = (row[column] - f64::from(chosen)) / factor[(column, column)];
                    // The factor is lower triangular: its column holds what the later inputs take over.
                    for (later, share) in row[column + 1..count].iter_mut().zip(factor.column(column).iter().skip(column + 1)) {
                        *later -= error * share;
                    }
                }
            }
        }
    }
    weights
}

/// The weights of an even and an odd row in one column, nearest to `wanted`; `bytes` are those of the pair of columns so far.
fn two_bytes(wanted: [f64; 2], second: bool, bytes: &mut [i32; 4]) -> [i32; 2] {
    let nearest = |wanted: f64, fraction: i32| ((wanted - f64::from(fraction)) / 256.0).round().clamp(-128.0, 127.0) as i32;
    let unsigned = |byte: i32| byte & 0xff;
    let [even, odd] = wanted;
    if second {
        let fraction = unsigned(bytes[1]);
        bytes[2] = nearest(odd, fraction);
        let odd = 256 * bytes[2] + fraction;
        let fraction = unsigned(bytes[2]);
        bytes[3] = nearest(even, fraction);
        [256 * bytes[3] + fraction, odd]
    } else {
        bytes[0] = nearest(odd, 0);
        let fraction = unsigned(bytes[0]);
        bytes[1] = nearest(even, fraction);
        [256 * bytes[1] + fraction, 256 * bytes[0]]
    }
}

/// Lower Cholesky factor of the inverse of the damped moments; the identity if they are all zero.
fn inverse_factor(moments: &DMatrix<f64>) -> DMatrix<f64> {
    let count = moments.nrows();
    let mean = moments.diagonal().sum() / count.max(1) as f64;
    let damped = moments + DMatrix::identity(count, count) * (DAMPING * mean);
    let factor = |matrix: DMatrix<f64>| Cholesky::<f64, Dyn>::new(matrix);
    let inverse = factor(damped).map(|cholesky| cholesky.inverse());
    inverse.and_then(factor).map_or_else(|| DMatrix::identity(count, count), |cholesky| cholesky.l())
}
