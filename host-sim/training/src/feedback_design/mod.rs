//! Design of the feedback lane from flight logs: identify, weigh, solve, judge.
//!
//! in: logs of the baseline loop with a dither on the position reference; out: coefficients for the firmware and what is
//! known about their robustness; never: a design from logs which cannot tell cause from effect; source: least-squares ARX
//! model and linear-quadratic gain on its lags (the noise-free past of a measured loop is a state).
//!
//! The lane corrects the *reference* of a stable loop, at the reference's own rate. Its error is delay-matched (measured
//! against what was desired at the time of the measurement), so the desired trajectory cancels from the error's dynamics
//! and what the network lane leaves over is one more disturbance.
//!
//! [`IdentificationData::collect`] is run once for each axis group, [`design`] once for each candidate. Which candidate
//! flies is decided by closed-loop flights: margins at the reference alone do not predict how a candidate bears a delay in the
//! whole loop, and a model from the same logs shares their chance errors (from three minutes of noisy flight it has
//! been seen to promise a gain margin of 1.5 where the true one was 1.1; from quieter sensors 1.4 for 1.2).

pub mod axis_log;
pub mod error_model;
pub mod excitation;
pub mod identification;
pub mod lane;
pub mod margins;
mod refusal;
pub mod response;
pub mod riccati;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;

use impromptu_firmware::model::{MAX_LAGS, Margins};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

pub use axis_log::AxisLog;
use error_model::ErrorModel;
use excitation::Excitation;
pub use identification::{ArxModel, IdentificationData};
pub use lane::LaneGain;
pub use margins::{LoopAssessment, LoopMargins};
pub use refusal::DesignRefusal;

/// Settings of one design. The defaults are those which bore 20 ms of additional delay in the whole loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {
    /// Time between two references, s.
    pub tick: f64,
    /// Memory of model and lane, ticks. Below 15 the model cannot hold the attitude loop and the delay.
    pub lags: usize,
    /// Memory of the model on which the lane is judged, ticks; longer than `lags`.
    pub margin_lags: usize,
    /// Weight on the square of the lane's output, per m²; the square of the position error (m²) weighs 1.
    #[serde(alias = "effort")]
    pub control_weight: f64,
    /// Weight on the square of the velocity error, s². Buys robustness against delay.
    pub velocity_weight: f64,
    /// Weight on the square of the integral of the position error, 1/s².
    pub integral_weight: f64,
    /// Noise added to the measurements in the fit, in units of the sensors' own: a slower and more robust observer.
    pub noise_factor: f64,
    /// Standard deviations of the sensors' own noise (m, m/s); taken from the residual of a fit without noise if absent.
    pub sensor_noise: Option<[f64; 2]>,
    /// Least sensor noise that is believed (m, m/s): a model from noise-free logs trusts every digit of its lags, and the lane
    /// with it.
    pub least_noise: [f64; 2],
    /// Ridge of the fit, relative to each regressor's own power: conditioning only.
    pub regularisation: f64,
    /// Least RMS innovation of the position reference, m (see [`excitation`]).
    pub least_excitation: f64,
    /// Least innovation of the position reference, times the square root of the rows, over the velocity residual, s. Its
    /// inverse is the standard error (m/s per m) of the response to one tick of reference, which is about 0.065 for a
    /// loop with kp 6.5 /s² at 100 Hz: below 15 the fit does not know the loop's gain.
    pub least_precision: f64,
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            tick: 0.01,
            lags: 25,
            margin_lags: 45,
            control_weight: 3e-3,
            velocity_weight: 0.05,
            integral_weight: 1.0,
            noise_factor: 1.0,
            sensor_noise: None,
            least_noise: [1e-4, 3e-3],
            regularisation: 1e-10,
            least_excitation: 1e-3,
            least_precision: 15.0,
        }
    }
}

impl DesignSettings {
    /// Whether each setting is in its range.
    ///
    /// # Errors
    /// Names the field, its value and the range.
    pub fn check(&self) -> Result<(), DesignRefusal> {
        let sensor_noise = self.sensor_noise.unwrap_or_default();
        let ranges: [(&'static str, &[f64], f64, f64); 12] = [
            ("tick", &[self.tick], 1e-5, 10.0),
            ("lags", &[self.lags as f64], 2.0, MAX_LAGS as f64),
            ("margin_lags", &[self.margin_lags as f64], self.lags as f64, LONGEST_MEMORY),
            ("control_weight", &[self.control_weight], 1e-12, 1e12),
            ("velocity_weight", &[self.velocity_weight], 0.0, 1e12),
            ("integral_weight", &[self.integral_weight], 0.0, 1e12),
            ("noise_factor", &[self.noise_factor], 0.0, 1e6),
            ("regularisation", &[self.regularisation], 1e-18, 1.0),
            ("least_excitation", &[self.least_excitation], 1e-12, 1e6),
            ("least_precision", &[self.least_precision], 0.0, 1e12),
            ("least_noise", &self.least_noise, 0.0, 1e6),
            ("sensor_noise", &sensor_noise, 0.0, 1e6),
        ];
        for (field, values, low, high) in ranges {
            if let Some(value) = values.iter().find(|value| !(low..=high).contains(*value)) {
                return Err(DesignRefusal::out_of_range(field, *value, low, high));
            }
        }
        Ok(())
    }
}

/// Longest memory of the model on which a lane is judged, ticks: its matrices have three times as many rows.
const LONGEST_MEMORY: f64 = 200.0;

/// A feedback lane for one axis and what is known about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaneDesign {
    /// What the firmware stores.
    pub gain: LaneGain,
    /// RMS one-tick prediction error of the model designed on: position (m), velocity (m/s).
    pub residual: [f64; 2],
    /// Noise added to the measurements in the fit (m, m/s).
    pub added_noise: [f64; 2],
    /// Relative residual of the Riccati equation.
    pub riccati_residual: f64,
    /// Largest absolute eigenvalue of the lane on the model it was designed on.
    pub spectral_radius: f64,
    /// Stability and margins on the model of longer memory.
    pub assessment: LoopAssessment,
    /// Excitation of the logs.
    pub excitation: Excitation,
}

impl LaneDesign {
    /// The margins as a model states them; zero where the longer model is unstable.
    pub fn margins(&self) -> Margins {
        self.assessment.margins.as_ref().map_or(Margins::default(), |margins| Margins {
            delay_ms: margins.delay_milliseconds.map_or(f32::MAX, |value| value as f32),
            gain: margins.gain_up.map_or(f32::MAX, |value| value as f32),
            modulus: margins.modulus as f32,
        })
    }
}

/// The smallest of margins over axes.
pub fn smallest(margins: impl IntoIterator<Item = Margins>) -> Margins {
    let unlimited = Margins { delay_ms: f32::MAX, gain: f32::MAX, modulus: f32::MAX };
    margins.into_iter().fold(unlimited, |least, found| Margins {
        delay_ms: least.delay_ms.min(found.delay_ms),
        gain: least.gain.min(found.gain),
        modulus: least.modulus.min(found.modulus),
    })
}

/// The firmware divides the integral's coefficient by 1 minus the sum of the past-output coefficients and refuses less.
const LEAST_STEADY_SHARE: f64 = 1e-3;

/// Designs a lane for the axis group whose logs are in `data`.
pub fn design(data: &IdentificationData, settings: &DesignSettings) -> Result<LaneDesign, DesignRefusal> {
    settings.check()?;
    data.excitation().require(settings.least_excitation)?;
    let fit = |lags, noise| data.fit(lags, noise, settings.regularisation);
    let judge = fit(settings.margin_lags, [0.0; 2])?;
    let precision = data.excitation().innovation * (data.rows() as f64).sqrt() / judge.residual[1];
    if precision < settings.least_precision {
        return Err(DesignRefusal::WeakExcitation { precision, minimum: settings.least_precision });
    }
    let noise = settings.sensor_noise.unwrap_or(judge.residual);
    let added_noise = [0, 1].map(|index| settings.noise_factor * noise[index].max(settings.least_noise[index]));
    let model = fit(settings.lags, added_noise)?;

    let lags = settings.lags;
    let errors = ErrorModel::new(&model, lags, settings.tick);
    let mut weights = DVector::zeros(3 * lags);
    weights[0] = 1.0;
    weights[lags] = settings.velocity_weight;
    weights[3 * lags - 1] = settings.integral_weight;
    let weights = DMatrix::from_diagonal(&weights);
    let solution =
        riccati::solve(&errors.dynamics, &errors.input, &weights, settings.control_weight).ok_or(DesignRefusal::NoGain)?;
    let spectral_radius = riccati::spectral_radius(&(&errors.dynamics - &errors.input * &solution.gain));
    // Without a weight the integral has no gain either, and its eigenvalue of 1 is nobody's.
    if spectral_radius >= 1.0 && settings.integral_weight > 0.0 {
        return Err(DesignRefusal::Unstable { spectral_radius });
    }
    let mut gain = LaneGain::from_state_feedback(&solution.gain, lags);
    if settings.integral_weight == 0.0 {
        gain.integral_coefficient = 0.0;
    }
    let sum = gain.past_output_coefficients.iter().sum::<f64>();
    if sum > 1.0 - LEAST_STEADY_SHARE {
        return Err(DesignRefusal::NoSteadyState { sum });
    }
    Ok(LaneDesign {
        assessment: margins::assess(&judge, &gain, settings.tick),
        gain,
        residual: model.residual,
        added_noise,
        riccati_residual: solution.residual,
        spectral_radius,
        excitation: *data.excitation(),
    })
}
