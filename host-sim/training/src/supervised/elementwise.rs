//! The parts of a training step that work number by number. Plain loops: inside `pulp`'s dispatch the compiler turns them
//! into vector code. (Each closure moves what it writes to into itself: a closure that could be called twice is called through
//! a shim, which is not inlined and would lose the vector instructions.) None of them adds up in an order that depends on the
//! machine.

use impromptu_model_export::batch::padded_matrix::{LANES, PaddedMatrix};
use pulp::Arch;

/// tanh of each value, within 3 units in the last place; f32 and branch-free so that it runs on whole vectors.
///
/// Small arguments: Taylor series. Others: 1 - 2 / (exp(2x) + 1) with exp by range reduction to ±ln2/2 and Taylor series.
#[inline(always)]
pub(super) fn tanh(x: f32) -> f32 {
    const LOG2_E: f32 = std::f32::consts::LOG2_E;
    // ln 2 in two parts, the first with few bits, so that the reduction is exact.
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    // Adding 1.5 · 2^23 rounds to an integer and leaves it in the low bits.
    const ROUND: f32 = 12_582_912.0;
    // 1 - tanh(9.2) is less than half a unit in the last place of 1.
    let magnitude = x.abs().min(9.2);
    let twice = 2.0 * magnitude;
    let shifted = twice.mul_add(LOG2_E, ROUND);
    let power = shifted - ROUND;
    let r = power.mul_add(-LN2_LOW, power.mul_add(-LN2_HIGH, twice));
    let mut series = 1.0 / 5040.0;
    for coefficient in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        series = r.mul_add(series, coefficient);
    }
    let two_to_power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23));
    let large = 1.0 - 2.0 / series.mul_add(two_to_power, 1.0);
    let square = magnitude * magnitude;
    let mut small = -17.0 / 315.0;
    for coefficient in [2.0 / 15.0, -1.0 / 3.0] {
        small = square.mul_add(small, coefficient);
    }
    let small = (square * magnitude).mul_add(small, magnitude);
    (if magnitude < 0.2 { small } else { large }).copysign(x)
}

/// tanh in place over the first `rows` rows.
pub(super) fn apply_tanh(arch: Arch, matrix: &mut PaddedMatrix, rows: usize) {
    arch.dispatch(
        #[inline(always)]
        || {
            let matrix = matrix;
            for row in 0..rows {
                for value in matrix.wide_row_mut(row) {
                    *value = tanh(*value);
                }
            }
        },
    );
}

/// The sums of each column over the first `rows` rows.
pub(super) fn column_sums(arch: Arch, matrix: &PaddedMatrix, rows: usize, sums: &mut PaddedMatrix) {
    let (stride, width) = (matrix.stride, matrix.width());
    arch.dispatch(
        #[inline(always)]
        || {
            let sums = sums;
            for first in (0..width).step_by(LANES) {
                let mut totals = [0.0f32; LANES];
                for row in matrix.values.chunks_exact(stride).take(rows) {
                    let values: &[f32; LANES] = row[first..].first_chunk().expect("rows are padded");
                    for (total, value) in totals.iter_mut().zip(values) {
                        *total += value;
                    }
                }
                sums.values[first..][..LANES].copy_from_slice(&totals);
            }
        },
    );
}

/// The sum of squares, with a fixed number of partial sums.
pub(super) fn sum_of_squares(arch: Arch, values: &[f32]) -> f64 {
    let partial = arch.dispatch(
        #[inline(always)]
        || {
            let mut partial = [0.0f32; LANES];
            for chunk in values.as_chunks::<LANES>().0 {
                for (sum, value) in partial.iter_mut().zip(chunk) {
                    *sum += value * value;
                }
            }
            partial
        },
    );
    partial.iter().map(|value| f64::from(*value)).sum()
}

/// The factors of one Adam update (Kingma and Ba, "Adam", 2015, with the decoupled weight decay of Loshchilov and Hutter,
/// 2019).
#[derive(Debug, Clone, Copy)]
pub(super) struct AdamFactors {
    /// Decay of the gradient's mean.
    pub(super) beta1: f32,
    /// Decay of the squared gradient's mean.
    pub(super) beta2: f32,
    /// Learning rate divided by the first mean's bias correction.
    pub(super) rate: f32,
    /// One over the square root of the second mean's bias correction.
    pub(super) root_correction: f32,
    /// Added to the root.
    pub(super) epsilon: f32,
    /// The weights are multiplied by this: one minus learning rate times weight decay.
    pub(super) shrink: f32,
    /// The gradient is multiplied by this (clipping).
    pub(super) gradient_factor: f32,
}

/// One Adam update in place; padding, whose gradient is zero, stays zero.
pub(super) fn adam(
    arch: Arch,
    factors: AdamFactors,
    values: &mut [f32],
    gradient: &[f32],
    first: &mut [f32],
    second: &mut [f32],
) {
    let AdamFactors { beta1, beta2, rate, root_correction, epsilon, shrink, gradient_factor } = factors;
    arch.dispatch(
        #[inline(always)]
        || {
            let (values, first, second) = (values, first, second);
            let moments = first.iter_mut().zip(second.iter_mut());
            for ((value, gradient), (first, second)) in values.iter_mut().zip(gradient).zip(moments) {
                let gradient = gradient * gradient_factor;
                *first = beta1 * *first + (1.0 - beta1) * gradient;
                *second = beta2 * *second + (1.0 - beta2) * (gradient * gradient);
                *value = shrink * *value - rate * *first / (second.sqrt() * root_correction + epsilon);
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_is_accurate_over_its_whole_range() {
        let mut worst = 0.0f64;
        for step in -120_000..=120_000 {
            let x = step as f32 * 1e-4;
            let exact = f64::from(x).tanh();
            worst = worst.max((f64::from(tanh(x)) - exact).abs() / exact.abs().max(1e-30));
        }
        assert!(worst < 4e-7, "relative error {worst}");
        assert_eq!((tanh(50.0), tanh(-50.0), tanh(0.0)), (1.0, -1.0, 0.0));
    }

    #[test]
    fn vector_code_has_the_bits_of_scalar_code() {
        let source = PaddedMatrix::from_fn(4, 37, |row, column| (row as f32 - 1.5) * column as f32 * 0.13);
        let (mut vector, mut scalar) = (source.clone(), source.clone());
        apply_tanh(Arch::new(), &mut vector, 3);
        apply_tanh(Arch::Scalar, &mut scalar, 3);
        assert_eq!(vector, scalar);
        assert_eq!(vector.row(3), source.row(3), "rows behind the batch are left alone");
        assert_eq!(sum_of_squares(Arch::new(), &source.values), sum_of_squares(Arch::Scalar, &source.values));
    }

    #[test]
    fn first_adam_step_moves_by_the_learning_rate() {
        // Bias-corrected, the first step is rate · sign(gradient) whatever the gradient's size.
        let (beta1, beta2, rate) = (0.9f32, 0.999f32, 0.01);
        let factors = AdamFactors {
            beta1,
            beta2,
            rate: rate / (1.0 - beta1),
            root_correction: (1.0 / (1.0 - beta2)).sqrt(),
            epsilon: 1e-8,
            shrink: 0.5,
            gradient_factor: 1.0,
        };
        let (mut values, mut first, mut second) = ([1.0f32, 2.0, 0.0], [0.0; 3], [0.0; 3]);
        adam(Arch::new(), factors, &mut values, &[3.0, -1e-3, 0.0], &mut first, &mut second);
        for (value, expected) in values.iter().zip([0.5 - rate, 1.0 + rate, 0.0]) {
            assert!((value - expected).abs() < 1e-5, "{value} {expected}");
        }
    }
}
