//! Does anything in the logs move the position reference which is not already a function of everything else?
//!
//! in: logs and their sums of products; out: the innovation of the position reference; never: a number that sensor noise
//! or a lively trajectory makes larger; source: identifiability in closed loop (Ljung, System Identification, section 13.4).
//!
//! Without such a component a least-squares fit cannot tell what the reference does to the vehicle from what the
//! trajectory, or a feedback on noise, makes both do. The statistic is the part of the reference at tick k that the best
//! linear prediction from all other regressors at that tick leaves over (measured positions and velocities up to now,
//! velocity references up to now, older position references). Trajectories are smooth, and feedback is a function of
//! the measurements: both leave next to nothing, however noisy the sensors are. A random sign of 1 cm that is drawn anew
//! every five ticks leaves 1 cm / sqrt(5) = 4.5 mm. The median over short stretches measures excitation that lasts rather
//! than the few largest jumps. Whether what is new in the reference is the dither, and not a glitch of the log, can only be
//! told when the dither was logged as well.

use impromptu_diagnosis::{cholesky::Factor, least_squares::Regression};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::DesignRefusal;
use super::axis_log::{AxisLog, Columns};

/// What moved the position reference independently of all else in the logs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Excitation {
    /// Median over stretches of 2 s (at 100 Hz) of the RMS of the position reference's innovation, m.
    pub innovation: f64,
    /// Share of the innovation which the logged dither is, when every log has one: 1 when the reference is dither plus
    /// linear functions of the other signals (0.7 to 0.95 in practice: a lane that was flying and the trajectory each leave a
    /// little); 0 when the dither never reached the reference.
    pub dither_share: Option<f64>,
}

/// Ticks in one stretch of the median: 2 s at 100 Hz, 40 signs of the usual dither.
const STRETCH: usize = 200;

/// Relative ridge of the prediction: far below any excitation (1e-6 of the reference's own size), far above rounding.
const RIDGE: f64 = 1e-12;

pub(super) fn measure(logs: &[AxisLog], columns: Columns, products: &Regression) -> Result<Excitation, DesignRefusal> {
    let newest = columns.reference_position(0);
    let others: Vec<usize> = (0..columns.regressors()).filter(|&index| index != newest).collect();
    let sums = products.select(&others, &[newest]);
    let factor = Factor::of_unit_power(&sums.gram, RIDGE).ok_or(DesignRefusal::SingularRegression { lags: columns.lags })?;
    let coefficients = factor.solve(&sums.cross.column(0));
    let mut predictor = DVector::zeros(columns.regressors() + 2);
    predictor[newest] = 1.0;
    for (&index, coefficient) in others.iter().zip(&coefficients) {
        predictor[index] = -coefficient;
    }

    let mut row = DVector::zeros(columns.regressors() + 2);
    let mut stretches = Vec::new();
    let mut power = 0.0;
    let mut with_dither = 0.0;
    for log in logs {
        let ticks: Vec<usize> = columns.ticks(log.measured_position.len()).collect();
        for stretch in ticks.chunks(STRETCH) {
            let mut sum = 0.0;
            for &k in stretch {
                columns.fill(log, k, row.as_mut_slice());
                let innovation = predictor.dot(&row);
                sum += innovation * innovation;
                // The innovation is orthogonal to all other regressors, so this is its product with the dither's own
                // innovation: equal to its power when the dither is all that is new in the reference.
                with_dither += innovation * log.dither.map_or(0.0, |dither| dither[k]);
            }
            power += sum;
            stretches.push((sum / stretch.len() as f64).sqrt());
        }
    }
    stretches.sort_by(f64::total_cmp);
    let dithered = !logs.is_empty() && logs.iter().all(|log| log.dither.is_some());
    Ok(Excitation {
        innovation: stretches.get(stretches.len() / 2).copied().unwrap_or(0.0),
        dither_share: (dithered && power > 0.0).then(|| with_dither / power),
    })
}

impl Excitation {
    /// Refuses logs from which the effect of the position reference cannot be told: innovation below `minimum` (m), or a
    /// logged dither that is not what moved the reference.
    pub fn require(&self, minimum: f64) -> Result<(), DesignRefusal> {
        // Written so that a value that is not a number is refused as well.
        if !matches!(self.innovation.partial_cmp(&minimum), Some(order) if order.is_ge()) {
            return Err(DesignRefusal::NoExcitation { innovation: self.innovation, minimum });
        }
        match self.dither_share {
            Some(share) if !(0.3..=3.0).contains(&share) => Err(DesignRefusal::DitherNotInReference { share }),
            _ => Ok(()),
        }
    }
}
