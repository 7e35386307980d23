//! What the numbers of a model may be: those that a loop can have, not those that an f32 can.
//!
//! *in* a number of a model file; *out* whether it may be; *never* a number that makes NaN or an infinity of finite inputs behind
//! the network's and the lane's own bounds; *source* the reasons in this table, which is the only place where the ranges stand:
//! the checks and the words of the refusals read it.
//!
//! All in SI units. A number of a channel is at most [`MAGNITUDE`]: the furthest that the counterfactual monitor believes,
//! further than any loop's channel is from its zero; its square times all taps and axes is still far from the end of f32.
//!
//! | what | range | reason |
//! |---|---|---|
//! | reference rate | 1e-3 to 1e6 Hz | from furnaces to current loops; its period is a useful f32 |
//! | divisors of sub-rate and monitor | 1 to 10,000 ticks | as far as a feature may look |
//! | measurement delay | 0 to 999 ticks | what is older says nothing of a loop |
//! | fade | 0 to 60 s, or up to 1,000 ticks | a lane that is switched off must go; 0: the slew alone |
//! | output limit | 0 (off), or 1e-9 to 1e7 | a part of a reference: 100 bar are 1e7 Pa |
//! | output slew | a 1e-7th of the limit to 1e9 | less is lost in an f32: the correction would never come back |
//! | envelope, means, output scale | ± 1e9 | numbers of channels |
//! | reciprocal input scale | 1e-9 to 1e12 | a scale is a number of a channel, down to a picometre; 0 would read nothing |
//! | input code | 1e-9 to 1e9 | 16 bits for what a normalised input spans |
//! | weights, biases, row scales | ± 1e9 | of normalised numbers; trained ones are below 1e3 |
//! | lane coefficients, lane integral | ± 1e9 | output for error |
//! | lane limits | 0 to 1e7 | as an output's |
//! | lane authority scales | from 1e-9 on | `f32::MAX` never lowers the authority |
//! | lane authority decay | 0 to 1 - 1/(60 s), or 0.99 a tick | a peak never forgotten would switch the lane off for good |
//! | monitor taps | ± 1e6 | what is measured follows the reference one to one, or nearly |
//! | validated RMS | 0 to 1e9 | a number of a channel |
//!
//! An application knows its loop better: its own bounds hold beside these.

/// Largest magnitude of a number of a channel, in its unit.
pub const MAGNITUDE: f32 = 1e9;
/// Longest time constant of what must come to an end by itself, s.
const PATIENCE_S: f32 = 60.0;
/// Largest number of ticks in which a correction comes back from its limit: more, and an f32 loses the change of a tick.
const SLEWED_TICKS: f32 = 1e7;

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The name that its refusal gives it.
    pub what: &'static str,
    /// Least and greatest.
    pub least: f32,
    /// Greatest.
    pub most: f32,
}

impl Range {
    const fn new(what: &'static str, least: f32, most: f32) -> Self {
        Self { what, least, most }
    }

    /// Of numbers of both signs.
    const fn either(what: &'static str, magnitude: f32) -> Self {
        Self::new(what, -magnitude, magnitude)
    }

    /// Whether a number is inside; NaN is not.
    pub fn holds(&self, value: f32) -> bool {
        self.least <= value && value <= self.most
    }
}

pub(crate) const RATE: Range = Range::new("reference rate", 1e-3, 1e6);
pub(crate) const DIVISOR: Range = Range::new("sub-rate divisor", 1.0, 10_000.0);
pub(crate) const DELAY: Range = Range::new("measurement delay", 0.0, 999.0);
pub(crate) const FADE: Range = Range::new("fade time", 0.0, PATIENCE_S);
pub(crate) const LIMIT: Range = Range::new("output limit", 1e-9, 1e7);
pub(crate) const SLEW: Range = Range::new("output slew", 1e-9, MAGNITUDE);
pub(crate) const ENVELOPE: Range = Range::either("envelope", MAGNITUDE);
pub(crate) const INPUT_MEAN: Range = Range::either("input mean", MAGNITUDE);
pub(crate) const INPUT_SCALE: Range = Range::new("reciprocal input scale", 1e-9, 1e12);
pub(crate) const INPUT_CODE: Range = Range::new("input code", 1e-9, 1e9);
pub(crate) const OUTPUT_SCALE: Range = Range::either("output scale", MAGNITUDE);
pub(crate) const OUTPUT_MEAN: Range = Range::either("output mean", MAGNITUDE);
pub(crate) const LAYER_ROWS: Range = Range::either("layer rows", 1e9);
pub(crate) const SKIP_ROWS: Range = Range::either("skip rows", 1e9);
pub(crate) const ROW_SCALES: Range = Range::either("layer row scales", 1e9);
pub(crate) const LANE_COEFFICIENTS: Range = Range::either("lane coefficients", 1e9);
pub(crate) const LANE_INTEGRAL: Range = Range::either("lane integral", 1e9);
pub(crate) const LANE_LIMIT: Range = Range::new("lane limit", 0.0, LIMIT.most);
pub(crate) const AUTHORITY: Range = Range::new("lane authority scale", 1e-9, f32::MAX);
pub(crate) const MONITOR_DIVISOR: Range = Range::new("monitor divisor", 1.0, 10_000.0);
pub(crate) const TAPS: Range = Range::either("monitor taps", 1e6);
pub(crate) const VALIDATED_RMS: Range = Range::new("validated RMS of the monitor", 0.0, MAGNITUDE);

/// All of them.
pub const RANGES: [Range; 22] = [
    RATE,
    DIVISOR,
    DELAY,
    FADE,
    LIMIT,
    SLEW,
    ENVELOPE,
    INPUT_MEAN,
    INPUT_SCALE,
    INPUT_CODE,
    OUTPUT_SCALE,
    OUTPUT_MEAN,
    LAYER_ROWS,
    SKIP_ROWS,
    ROW_SCALES,
    LANE_COEFFICIENTS,
    LANE_INTEGRAL,
    LANE_LIMIT,
    AUTHORITY,
    MONITOR_DIVISOR,
    TAPS,
    VALIDATED_RMS,
];

/// The range that a refusal's words name.
pub(crate) fn named(what: &str) -> Option<&'static Range> {
    const ALL: &[Range] = &RANGES;
    ALL.iter().find(|range| range.what == what)
}

/// Whether a fade may last this many ticks at this rate.
pub(crate) fn fade(ticks: u16, rate_hz: f32) -> bool {
    ticks <= 1_000 || FADE.holds(f32::from(ticks) / rate_hz)
}

/// Whether limit and slew of an output fit each other. A limit of 0 switches it off.
pub(crate) fn output(limit: f32, slew: f32) -> bool {
    (limit == 0.0 || LIMIT.holds(limit)) && SLEW.holds(slew) && slew * SLEWED_TICKS >= limit
}

/// Whether the lane may forget a peak by this factor in a tick.
pub(crate) fn decay(decay: f32, rate_hz: f32) -> bool {
    let forgets = 1.0 - decay;
    (0.0..1.0).contains(&decay) && (forgets >= 0.009_999 || forgets * rate_hz * PATIENCE_S >= 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correction_at_its_limit_moves_by_its_slew() {
        for limit in [1e-9, 0.3, 1.0, 4.0, 1e7f32] {
            let slew = limit / SLEWED_TICKS;
            let slew = if slew < SLEW.least { SLEW.least } else { slew * 1.000_001 };
            assert!(output(limit, slew), "{limit} {slew}");
            assert!(limit - slew < limit, "{limit} {slew}");
        }
        assert!(!output(1.0, 1e-8) && !output(3.4e38, 1.0) && output(0.0, 1.0));
        assert!(!output(1.0, f32::NAN) && !output(f32::NAN, 1.0) && !output(1.0, f32::MAX));
    }

    #[test]
    fn a_peak_is_forgotten_within_a_minute_or_a_hundred_ticks() {
        assert!(decay(0.99, 1e-3) && decay(0.999, 100.0) && decay(0.0, 1.0));
        assert!(!decay(0.999_999, 100.0) && !decay(1.0, 1e6) && !decay(f32::NAN, 1.0) && !decay(-0.1, 1.0));
    }
}
