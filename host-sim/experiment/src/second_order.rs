//! A second-order guess of what a loop makes of its reference, taken from its logs.
//!
//! *in* logs of reference and measured value; *out* natural frequency, rad/s, damping ratio and delay, s, at a stated gain;
//! *never* a parameter that was given, changed; *source* output-error identification (Ljung 1999): the response runs freely
//! beside the log. A grid is enough: the learner needs no more than a rough response.

use impromptu_firmware::learning::{Filter, Response};
use impromptu_training::track::Track;
use serde::Serialize;

/// Learner's ticks that a response should have settled in.
const TICKS: f64 = 80.0;
/// It takes so many lags, or, if it swings, so many of the time constants in which the swing decays.
const LAGS: f64 = 3.0;
const DECAYS: f64 = 2.0;
/// The learner runs at most so many times as fast as the log.
const FASTEST: f64 = 4.0;

/// Frequencies, rad/s, each by this factor above the one before.
const LOWEST: f64 = 0.3;
const FACTOR: f64 = 1.25;
const FREQUENCIES: i32 = 25;
const DAMPINGS: [f64; 5] = [0.3, 0.5, 0.7, 1.0, 1.4];
/// Delays, in the inverse of the frequency.
const DELAYS: [f64; 6] = [0.0, 0.1, 0.2, 0.4, 0.7, 1.0];
/// Steps round the best of the grid, as shares of a step.
const FINER: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];

/// Gain at rest, natural frequency, rad/s, damping ratio, and delay, s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SecondOrder {
    /// Change of the measured value at rest after a change of the reference by 1.
    pub gain: f64,
    /// rad/s.
    pub frequency: f64,
    /// Damping ratio.
    pub damping: f64,
    /// s.
    pub delay_s: f64,
}

/// What of a response is known; the rest is identified, but for the gain, which is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// Gain at rest.
    pub gain: Option<f64>,
    /// rad/s.
    pub frequency: Option<f64>,
    /// Damping ratio.
    pub damping: Option<f64>,
    /// s.
    pub delay_s: Option<f64>,
}

impl Known {
    /// The response, if all of it but the gain is known.
    pub fn whole(&self) -> Option<SecondOrder> {
        let gain = self.gain.unwrap_or(1.0);
        Some(SecondOrder { gain, frequency: self.frequency?, damping: self.damping?, delay_s: self.delay_s? })
    }

    /// The grid, and then finer steps round its best.
    fn candidates(&self, round: Option<SecondOrder>) -> Vec<SecondOrder> {
        let (frequencies, dampings, delays): (Vec<f64>, Vec<f64>, Vec<f64>) = match round {
            None => ((0..FREQUENCIES).map(|step| LOWEST * FACTOR.powi(step)).collect(), DAMPINGS.into(), DELAYS.into()),
            Some(best) => (
                FINER.iter().map(|step| best.frequency * FACTOR.powf(*step)).collect(),
                FINER.iter().map(|step| best.damping * 1.4f64.powf(*step)).collect(),
                FINER.iter().map(|step| (best.delay_s * best.frequency + 0.2 * step).max(0.0)).collect(),
            ),
        };
        let or = |known: Option<f64>, values: Vec<f64>| known.map_or(values, |value| vec![value]);
        let mut candidates = Vec::new();
        for frequency in or(self.frequency, frequencies) {
            for damping in or(self.damping, dampings.clone()) {
                for delay_s in or(self.delay_s, delays.iter().map(|delay| delay / frequency).collect()) {
                    candidates.push(SecondOrder { gain: self.gain.unwrap_or(1.0), frequency, damping, delay_s });
                }
            }
        }
        candidates
    }

    /// The response that lies closest to these tracks, and by how much it misses them, RMS in their unit. `None` if none is
    /// slow enough for their rate.
    pub fn identify(&self, tracks: &[&Track]) -> Option<(SecondOrder, f64)> {
        let best = |candidates: Vec<SecondOrder>| {
            let fits = candidates.into_iter().filter_map(|candidate| Some((candidate, candidate.misfit(tracks)?)));
            fits.min_by(|(_, a), (_, b)| a.total_cmp(b))
        };
        let (coarse, _) = best(self.candidates(None))?;
        best(self.candidates(Some(coarse)))
    }
}

impl SecondOrder {
    /// How far it follows a steady motion behind, s.
    pub fn lag_s(&self) -> f64 {
        2.0 * self.damping / self.frequency + self.delay_s
    }

    /// Until it has settled, nearly, s.
    pub fn settling_s(&self) -> f64 {
        (LAGS * self.lag_s()).max(DECAYS / (self.damping * self.frequency) + self.delay_s)
    }

    /// The learner's rate for a log of this one, Hz: the log's own, or a multiple or a whole part of it, so that the response has
    /// settled in about 80 ticks. `None` if that is more than four times the log's.
    pub fn rate_hz(&self, log_hz: f64) -> Option<f64> {
        let wanted = TICKS / self.settling_s();
        let ratio = wanted / log_hz;
        if !(ratio <= FASTEST && ratio > 0.0) {
            return None;
        }
        Some(if ratio > 1.0 { log_hz * ratio.round() } else { log_hz / (1.0 / ratio).round() })
    }

    /// As the learner's filter at this rate.
    pub fn response(&self, rate_hz: f64) -> Option<Response> {
        let [gain, frequency, damping, delay_s] =
            [self.gain, self.frequency, self.damping, self.delay_s].map(|value| value as f32);
        Response::second_order(gain, frequency, damping, delay_s, rate_hz as f32)
    }

    /// RMS distance between what it makes of the references and what was measured, after the first 80 ticks or the first third;
    /// the loop rested where it was measured first.
    pub fn misfit(&self, tracks: &[&Track]) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0usize);
        for track in tracks {
            let rate_hz = self.rate_hz(1.0 / track.period_s)?;
            let response = self.response(rate_hz)?;
            let reference = resampled(&track.reference, track.period_s, rate_hz);
            let measured = resampled(&track.measured, track.period_s, rate_hz);
            // A log that is too short for a replay says so, once the response is known; it must not decide which one is.
            let skipped = (TICKS as usize).min(measured.len() / 3);
            let rest = measured.first().copied().unwrap_or(0.0) / self.gain;
            let mut filter = Filter::at_rest(&response, rest as f32);
            let delayed = std::iter::repeat_n(rest, 1 + response.delay()).chain(reference);
            for (tick, (input, measured)) in delayed.zip(&measured).enumerate() {
                let output = f64::from(filter.step(&response, input as f32));
                if tick >= skipped {
                    sum += (output - measured).powi(2);
                    count += 1;
                }
            }
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    }
}

/// Values at another rate, by lines between them: a tick between two rows knows a share of the row to come.
pub(crate) fn resampled(values: &[f64], period_s: f64, rate_hz: f64) -> Vec<f64> {
    let step = 1.0 / (period_s * rate_hz);
    let last = values.len().saturating_sub(1);
    let count = (last as f64 / step + 1e-6) as usize + 1;
    let at = |index: usize| values.get(index.min(last)).copied().unwrap_or(0.0);
    (0..count)
        .map(|tick| {
            let place = tick as f64 * step;
            // A whole place but for rounding keeps its value.
            let place = if (place - place.round()).abs() < 1e-6 { place.round() } else { place };
            let index = place as usize;
            at(index) + (place - index as f64) * (at(index + 1) - at(index))
        })
        .collect()
}
