//! High-order ARX: what whitens the noise, whatever colour it has.
//!
//! *in* a record; *out* A and the variance of the white innovations; *never* an order that the record cannot carry; *source* Ljung,
//! "System Identification", 2nd ed., 10.1: A y = B u + e by least squares, order by Akaike's criterion. With growing order 1/A
//! approaches the noise's shaping filter for any stationary noise.

use crate::{
    least_squares::Regression,
    record::{Record, Segment},
};

/// What is kept of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Arx {
    /// A, in rising powers of q⁻¹, first 1.
    pub whitening: Vec<f64>,
    /// Variance of the innovations, in squared units of the output.
    pub variance: f64,
    /// Order.
    pub order: usize,
}

/// Orders that are tried.
const ORDERS: [usize; 6] = [3, 6, 9, 12, 16, 20];
/// Keeps dependent columns of smooth signals solvable, relative to a column's mean square.
const PENALTY: f64 = 1e-11;

impl Arx {
    /// The fit of the best order; `None` if nothing can be fitted.
    pub fn fit(record: &Record) -> Option<Self> {
        let longest = ORDERS[ORDERS.len() - 1];
        let fits = ORDERS.iter().filter(|order| record.len() > 8 * *order + 40).filter_map(|&order| {
            // The same rows for every order: their criteria are compared.
            let mut regression = Regression::new(2 * order + 2, 1);
            let mut row = vec![0.0; 2 * order + 2];
            for Segment { reference, measured } in &record.segments {
                for tick in longest..measured.len() {
                    for lag in 0..order {
                        row[lag] = -measured[tick - 1 - lag];
                        row[order + lag] = reference[tick - lag];
                    }
                    row[2 * order] = reference[tick - order];
                    row[2 * order + 1] = 1.0;
                    regression.push(&row, &[measured[tick]]);
                }
            }
            let solution = regression.solve(PENALTY)?;
            let rows = solution.rows as f64;
            let freedom = rows - row.len() as f64;
            if freedom < 10.0 {
                return None;
            }
            let variance = (solution.residual / freedom).max(f64::MIN_POSITIVE);
            let criterion = rows * variance.ln() + 2.0 * row.len() as f64;
            let whitening = std::iter::once(1.0).chain(solution.coefficients.iter().take(order).copied()).collect();
            Some((criterion, Self { whitening, variance, order }))
        });
        fits.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, arx)| arx)
    }
}
