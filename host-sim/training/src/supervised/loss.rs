//! The loss of a batch and its gradient.

use super::settings::Loss;
use impromptu_model_export::batch::padded_matrix::PaddedMatrix;

impl Loss {
    /// The loss of one error and its derivative.
    #[inline]
    fn of(self, error: f32) -> (f32, f32) {
        match self {
            Self::Huber { delta } if error.abs() > delta => (delta * (2.0 * error.abs() - delta), (2.0 * delta).copysign(error)),
            Self::MeanSquare | Self::Huber { .. } => (error * error, 2.0 * error),
        }
    }

    /// The sum over the first rows of `row weight · output weight · loss(output - target)`; each output is replaced by the
    /// loss's gradient, times `factor`.
    pub(super) fn replace_by_gradient(
        self,
        outputs: &mut PaddedMatrix,
        targets: &PaddedMatrix,
        row_weights: &[f32],
        output_weights: &[f32],
        factor: f32,
    ) -> f64 {
        let mut total = 0.0;
        for (row, row_weight) in row_weights.iter().enumerate() {
            let values = outputs.row_mut(row).iter_mut().zip(targets.row(row)).zip(output_weights);
            for ((value, target), output_weight) in values {
                let weight = row_weight * output_weight;
                let (loss, slope) = self.of(*value - target);
                total += f64::from(weight * loss);
                *value = weight * slope * factor;
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn huber_joins_the_square_smoothly() {
        let huber = Loss::Huber { delta: 2.0 };
        assert_eq!(huber.of(-2.0), Loss::MeanSquare.of(-2.0));
        assert_eq!(huber.of(5.0), (16.0, 4.0));
        assert_eq!(huber.of(-5.0), (16.0, -4.0));
    }

    #[test]
    fn weights_rows_and_outputs_and_leaves_the_rest() {
        let mut outputs = PaddedMatrix::from_fn(3, 2, |row, column| (row + column) as f32);
        let targets = PaddedMatrix::zeros(3, 2);
        let total = Loss::MeanSquare.replace_by_gradient(&mut outputs, &targets, &[1.0, 2.0], &[1.0, 0.5], 0.5);
        assert_eq!(total, 0.5 + 2.0 * (1.0 + 0.5 * 4.0));
        assert_eq!([outputs.row(0), outputs.row(1), outputs.row(2)], [[0.0, 0.5], [2.0, 2.0], [2.0, 3.0]]);
    }
}
