//! What a record excites: how many tones, which band, how fast the loop answers.
//!
//! *in* a record; *out* orders and bands; *never* a band above half the record's rate; *source* Ljung, "System Identification",
//! 13.2 (persistence of excitation), 6.4 (Welch's spectra and the coherence).

use nalgebra::{Complex, DMatrix};
use serde::Serialize;

use crate::{
    columns::mean,
    record::{Record, Segment},
};

/// What of the loop's band the record shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Share of the lines up to the loop's bandwidth at which the coherence of reference and measured value is above one half.
    pub share: f64,
    /// Highest frequency with that coherence, Hz.
    pub highest_hz: f64,
    /// Frequency above which nothing is judged, Hz.
    pub trusted_hz: f64,
    /// Lowest frequency that the record shows, Hz: a twentieth of the reference's variance is at it and below. What happens at
    /// rest is extrapolated from here.
    pub lowest_hz: f64,
    /// Number of coefficients that the reference can tell apart, at most [`LAGS`]: two for each tone.
    pub order: usize,
}

/// Lags of the test of persistent excitation.
pub const LAGS: usize = 12;
/// Eigenvalues below this share of the largest are rounding.
const RANK: f64 = 1e-10;
/// Coherence above which a line is identified by the reference rather than by noise.
const COHERENT: f64 = 0.5;

/// Number of independent directions of the reference's increments: 2 for one sine, 0 for a constant.
pub fn order_of_excitation(record: &Record) -> usize {
    let mut gram = DMatrix::<f64>::zeros(LAGS, LAGS);
    for Segment { reference, .. } in &record.segments {
        for window in increments(reference).windows(LAGS) {
            for i in 0..LAGS {
                for j in 0..LAGS {
                    gram[(i, j)] += window[i] * window[j];
                }
            }
        }
    }
    let eigenvalues = gram.symmetric_eigenvalues();
    let largest = eigenvalues.max();
    let size: f64 = record.segments.iter().flat_map(|segment| &segment.reference).map(|value| value * value).sum();
    // Increments that are rounding of a constant excite nothing.
    if largest <= 1e-18 * size || largest == 0.0 {
        return 0;
    }
    eigenvalues.iter().filter(|value| **value > RANK * largest).count()
}

/// Most ticks by which two columns are aligned, and samples that are looked at for it.
const LATEST: usize = 1024;
const ALIGNED_BY: usize = 8_000;

/// Ticks by which the measured value is most like the reference before it, `most` at most, after `of` was done to each column.
/// Whether the loop's gain is positive does not matter.
fn lag(record: &Record, most: usize, of: impl Fn(&[f64]) -> Vec<f64>) -> usize {
    let record = record.clone().shorter(ALIGNED_BY);
    let most = most.min(record.longest() / 4);
    let columns: Vec<[Vec<f64>; 2]> =
        record.segments.iter().map(|Segment { reference, measured }| [of(reference), of(measured)]).collect();
    most_alike(most, |lag| {
        let count: usize = columns.iter().map(|[reference, _]| reference.len().saturating_sub(lag)).sum();
        alike(&columns, lag) / count.max(1) as f64
    })
}

/// The lag, `most` at most, at which so much is largest.
pub(crate) fn most_alike(most: usize, alike: impl Fn(usize) -> f64) -> usize {
    (0..=most).map(|lag| (lag, alike(lag))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(lag, _)| lag)
}

/// How much columns have in common at a lag of the second: magnitude of the sum of their products.
pub(crate) fn alike(columns: &[[Vec<f64>; 2]], lag: usize) -> f64 {
    let of = |[reference, measured]: &[Vec<f64>; 2]| -> f64 {
        reference.iter().zip(measured.iter().skip(lag)).map(|(reference, measured)| reference * measured).sum()
    };
    columns.iter().map(of).sum::<f64>().abs()
}

pub(crate) fn increments(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn centred(values: &[f64]) -> Vec<f64> {
    let mean = mean(values);
    values.iter().map(|value| value - mean).collect()
}

/// Spectra of increments, line by line: the lines' spacing in Hz; reference, measured, cross.
struct Spectra {
    spacing_hz: f64,
    lines: Vec<(f64, f64, Complex<f64>)>,
}

impl Spectra {
    /// Welch's method on increments (which are whiter than positions): Hann windows that overlap by half. The measured value is
    /// taken as many ticks later as it comes: else a window shows less of it the later it is.
    fn new(record: &Record, length: usize) -> Self {
        let count = length / 2;
        let mut lines = vec![(0.0, 0.0, Complex::default()); count];
        let basis: Vec<Complex<f64>> =
            (0..length).map(|k| Complex::from_polar(1.0, -std::f64::consts::TAU * k as f64 / length as f64)).collect();
        let late = lag(record, LATEST, increments);
        let hann = |k: usize| (std::f64::consts::PI * k as f64 / length as f64).sin().powi(2);
        for Segment { reference, measured } in &record.segments {
            let measured = measured.get(late..).unwrap_or_default();
            for first in (0..measured.len().saturating_sub(length)).step_by(length / 2) {
                let part = |values: &[f64]| -> Vec<f64> {
                    (0..length).map(|k| hann(k) * (values[first + k + 1] - values[first + k])).collect()
                };
                let (u, y) = (part(reference), part(measured));
                for (line, sums) in lines.iter_mut().enumerate() {
                    let at = |values: &[f64]| -> Complex<f64> {
                        values.iter().enumerate().map(|(k, value)| basis[(k * (line + 1)) % length] * *value).sum()
                    };
                    let (u, y) = (at(&u), at(&y));
                    *sums = (sums.0 + u.norm_sqr(), sums.1 + y.norm_sqr(), sums.2 + y * u.conj());
                }
            }
        }
        Self { spacing_hz: 1.0 / (length as f64 * record.period_s), lines }
    }
}

/// Length of Welch's windows: eight of them, or more, overlapping.
fn window(record: &Record) -> usize {
    (record.longest() / 5).clamp(16, 512) & !1
}

/// Whether a line is the reference's work rather than the noise's.
fn coherent(line: &(f64, f64, Complex<f64>)) -> bool {
    line.2.norm_sqr() > COHERENT * line.0 * line.1 && line.0 > 0.0
}

/// Frequency, Hz, below which 95 % of what passes the loop lies: magnitude of the cross spectrum of increments, of coherent
/// lines. Half the record's rate if there are none.
pub fn band(record: &Record) -> f64 {
    let spectra = Spectra::new(record, window(record));
    let passing = |line: &(f64, f64, Complex<f64>)| if coherent(line) { line.2.norm() } else { 0.0 };
    let total: f64 = spectra.lines.iter().map(passing).sum();
    let mut sum = 0.0;
    for (index, line) in spectra.lines.iter().enumerate() {
        sum += passing(line);
        if total > 0.0 && sum >= 0.95 * total {
            return (index + 1) as f64 * spectra.spacing_hz;
        }
    }
    0.5 / record.period_s
}

/// Most samples at one rate from which a band is taken, and fewest.
const GLANCE: usize = 40_000;
const FEWEST: usize = 256;
/// A band is shown by the rate at which it is this many lines wide at least, and at most this share of the rate.
const LINES: f64 = 6.0;
const SHARE: f64 = 0.3;

/// [`band`] of a record of any rate, `None` if it is shown at none. What is logged much faster than the loop answers shows it in
/// its first line or not at all, below the noise of the increments: then the band is that of the record at a half of the rate, a
/// quarter, and so on.
fn band_at_any_rate(record: &Record) -> Option<f64> {
    let divisors = (0..).map(|power| 1 << power).take_while(|divisor| record.longest() / divisor >= FEWEST);
    divisors.map(|divisor| record.slower(divisor).shorter(GLANCE)).find_map(|slower| {
        let found = band(&slower);
        let spacing_hz = 1.0 / (window(&slower) as f64 * slower.period_s);
        (LINES * spacing_hz..=SHARE / slower.period_s).contains(&found).then_some(found)
    })
}

/// Where the log is too short to show a band, the loop lags by so many ticks.
const LAG: f64 = 16.0;
/// This part of the longest stretch is looked at then for the lag.
const SPAN: usize = 200;

/// How many rows of a record make a tick of the add-on: `samples_a_period` ticks in a period of the band.
pub fn divisor(record: &Record, samples_a_period: f64) -> usize {
    let rows = band_at_any_rate(record).map(|band| 1.0 / (samples_a_period * band * record.period_s));
    let of_lag = || {
        let fine = (record.longest() / SPAN / 8).max(1);
        (lag(&record.slower(fine), SPAN, centred) * fine) as f64 / LAG
    };
    rows.unwrap_or_else(of_lag).max(1.0) as usize
}

/// Share of the reference's variance that lies at the lowest frequency and below.
const SLOW_SHARE: f64 = 0.05;

/// Lowest frequency that the reference shows, Hz (see [`Coverage::lowest_hz`]); 0 if stretches at different heights show the rest
/// itself.
pub fn lowest(record: &Record) -> f64 {
    let all: Vec<f64> = record.segments.iter().flat_map(|segment| segment.reference.iter().copied()).collect();
    let middle = mean(&all);
    let wanted = SLOW_SHARE * all.iter().map(|value| (value - middle).powi(2)).sum::<f64>();
    let still = |segment: &Segment| segment.reference.len() as f64 * (mean(&segment.reference) - middle).powi(2);
    let mut seen: f64 = record.segments.iter().map(still).sum();
    // Line by line of the longest stretch, all stretches at the same frequencies: the low lines are few, so no fast transform.
    let longest = record.longest();
    let mut line = 0;
    while seen < wanted && 2 * line < longest {
        line += 1;
        seen += record.segments.iter().map(|segment| power(&segment.reference, line as f64 / longest as f64)).sum::<f64>();
    }
    line as f64 / (longest.max(1) as f64 * record.period_s)
}

/// Variance of a stretch that one line, in cycles a sample, holds, times the samples.
fn power(values: &[f64], line: f64) -> f64 {
    let middle = mean(values);
    let turn = Complex::from_polar(1.0, -std::f64::consts::TAU * line);
    let mut phase = Complex::new(1.0f64, 0.0);
    let mut sum = Complex::new(0.0, 0.0);
    for value in values {
        sum += phase * (value - middle);
        phase *= turn;
    }
    2.0 * sum.norm_sqr() / values.len().max(1) as f64
}

/// What the record shows of a loop with that bandwidth, Hz; nothing above `trusted_hz` counts, and `lowest_hz` is
/// that of [`lowest`].
pub fn coverage(record: &Record, bandwidth_hz: f64, lowest_hz: f64, trusted_hz: f64) -> Coverage {
    let spectra = Spectra::new(record, window(record));
    let inside = ((bandwidth_hz.min(trusted_hz) / spectra.spacing_hz) as usize).clamp(1, spectra.lines.len());
    let seen = spectra.lines[..inside].iter().filter(|line| coherent(line)).count();
    let highest = spectra.lines.iter().rposition(coherent).map_or(0, |index| index + 1);
    Coverage {
        share: seen as f64 / inside as f64,
        highest_hz: (highest as f64 * spectra.spacing_hz).min(trusted_hz),
        trusted_hz,
        lowest_hz,
        order: order_of_excitation(record),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(value: impl Fn(f64) -> f64) -> Record {
        let time: Vec<f64> = (0..800).map(|tick| f64::from(tick) * 0.05).collect();
        let values: Vec<f64> = time.iter().map(|time| value(*time)).collect();
        Record::new(&time, &values, &values).unwrap()
    }

    #[test]
    fn a_constant_excites_nothing_and_every_tone_two_coefficients() {
        assert_eq!(order_of_excitation(&record(|_| 0.7)), 0);
        assert_eq!(order_of_excitation(&record(|t| (2.0 * t).sin())), 2);
        assert_eq!(order_of_excitation(&record(|t| (2.0 * t).sin() + (5.0 * t).cos() + (9.0 * t).sin())), 6);
    }

    #[test]
    fn the_lowest_frequency_is_that_of_the_slowest_tone_and_zero_between_heights() {
        let tones = record(|t| (std::f64::consts::TAU * 0.2 * t).sin() + 3.0 * (std::f64::consts::TAU * t).sin());
        assert!((0.17..=0.2).contains(&lowest(&tones)), "{}", lowest(&tones));
        let steps = record(|t| (t / 8.0).floor() % 2.0);
        assert!(lowest(&steps) < 0.1);
        let heights = Record::joined([record(|t| t.sin()), record(|t| 2.0 + t.sin())]).unwrap();
        assert_eq!(lowest(&heights), 0.0);
    }

    #[test]
    fn the_band_holds_the_fastest_tone() {
        let found = band(&record(|t| (2.0 * t).sin() + (std::f64::consts::TAU * 3.0 * t).sin()));
        assert!((2.9..3.6).contains(&found), "{found}");
    }
}
