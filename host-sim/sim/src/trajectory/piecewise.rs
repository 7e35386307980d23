//! Piecewise polynomials of degree 7 and uniform quintic B-splines.

use super::{Curve, Sample};

/// One polynomial piece: for each of x, y, z (m) and yaw (rad) the coefficients of 1, t, …, t⁷, with t in seconds from the
/// piece's beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Length in time, s.
    pub duration: f64,
    /// Coefficients, lowest power first: rows x, y, z, yaw.
    pub coefficients: [[f64; 8]; 4],
}

impl Piece {
    /// Value and derivatives at a time from the piece's beginning, s. No limit is imposed on the time.
    #[must_use]
    pub fn at(&self, t: f64) -> Sample {
        let [x, y, z, yaw] = self.coefficients.map(|c| horner(&c, t));
        Sample { position: [x[0], y[0], z[0]], velocity: [x[1], y[1], z[1]], acceleration: [x[2], y[2], z[2]], yaw: yaw[0] }
    }
}

/// A polynomial and its first two derivatives.
fn horner(coefficients: &[f64; 8], t: f64) -> [f64; 3] {
    let (mut value, mut first, mut half_second) = (0.0, 0.0, 0.0);
    for &c in coefficients.iter().rev() {
        half_second = half_second * t + first;
        first = first * t + value;
        value = value * t + c;
    }
    [value, first, 2.0 * half_second]
}

/// Polynomial pieces flown one after the other.
#[derive(Clone, Debug)]
pub struct PiecewisePolynomial {
    pieces: Vec<Piece>,
    /// Beginning of each piece, s, and at the end the whole duration.
    starts: Vec<f64>,
}

impl PiecewisePolynomial {
    /// Joins pieces; `None` when there is none. Continuity is the caller's business.
    #[must_use]
    pub fn new(pieces: Vec<Piece>) -> Option<Self> {
        if pieces.is_empty() {
            return None;
        }
        let mut starts = vec![0.0];
        let mut end = 0.0;
        for piece in &pieces {
            end += piece.duration;
            starts.push(end);
        }
        Some(Self { pieces, starts })
    }

    /// The uniform quintic B-spline (four continuous derivatives) of the control points, `interval` seconds apart, at
    /// least 6 of them. It begins and ends at rest when the first and last five are equal; heading 0.
    #[must_use]
    pub fn b_spline(controls: &[[f64; 3]], interval: f64) -> Option<Self> {
        let piece = |window: &[[f64; 3]]| {
            let mut coefficients = [[0.0; 8]; 4];
            for (axis, row) in coefficients.iter_mut().take(3).enumerate() {
                let mut scale = 120.0;
                for (power, weights) in QUINTIC_BASIS.iter().enumerate() {
                    let sum: f64 = weights.iter().zip(window).map(|(w, p)| w * p[axis]).sum();
                    row[power] = sum / scale;
                    scale *= interval;
                }
            }
            Piece { duration: interval, coefficients }
        };
        Self::new(controls.windows(6).map(piece).collect())
    }
}

/// Weights of six consecutive control points (columns) in the coefficient of each power of the local parameter (rows),
/// times 120.
const QUINTIC_BASIS: [[f64; 6]; 6] = [
    [1.0, 26.0, 66.0, 26.0, 1.0, 0.0],
    [-5.0, -50.0, 0.0, 50.0, 5.0, 0.0],
    [10.0, 20.0, -60.0, 20.0, 10.0, 0.0],
    [-10.0, 20.0, 0.0, -20.0, 10.0, 0.0],
    [5.0, -20.0, 30.0, -20.0, 5.0, 0.0],
    [-1.0, 5.0, -10.0, 10.0, -5.0, 1.0],
];

impl Curve for PiecewisePolynomial {
    fn duration(&self) -> f64 {
        self.starts[self.pieces.len()]
    }

    fn at(&self, seconds: f64) -> Sample {
        let later = self.starts.partition_point(|&start| start <= seconds);
        let index = later.saturating_sub(1).min(self.pieces.len() - 1);
        self.pieces[index].at(seconds - self.starts[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_a_monomial() {
        let mut coefficients = [[0.0; 8]; 4];
        coefficients[0][7] = 1.0;
        coefficients[3][1] = 2.0;
        let sample = Piece { duration: 3.0, coefficients }.at(2.0);
        assert_eq!(sample.position[0], 128.0);
        assert_eq!(sample.velocity[0], 7.0 * 64.0);
        assert_eq!(sample.acceleration[0], 42.0 * 32.0);
        assert_eq!(sample.yaw, 4.0);
    }

    #[test]
    fn b_spline_reproduces_a_straight_line_and_joins_smoothly() {
        let line: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i), 0.5, -f64::from(i)]).collect();
        let spline = PiecewisePolynomial::b_spline(&line, 0.25).expect("enough points");
        let middle = spline.at(1.0);
        assert!((middle.velocity[0] - 4.0).abs() < 1e-12 && middle.velocity[1].abs() < 1e-12);
        assert!(middle.acceleration.iter().all(|a| a.abs() < 1e-10));

        let bent: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i % 3), f64::from(i % 5), 1.0]).collect();
        let spline = PiecewisePolynomial::b_spline(&bent, 0.25).expect("enough points");
        for knot in 1..14 {
            let time = f64::from(knot) * 0.25;
            let (before, after) = (spline.at(time - 1e-9), spline.at(time + 1e-9));
            for axis in 0..3 {
                assert!((before.acceleration[axis] - after.acceleration[axis]).abs() < 1e-4);
            }
        }
    }
}
