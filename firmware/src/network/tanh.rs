//! Hyperbolic tangent: on 16-bit codes by a table of chords, in f32 by a table of cubics.
//!
//! Both use integer arithmetic, or + - and × of f32 alone: the same bits on every machine, the same instructions for every
//! argument.

/// Code of a pre-activation of 1: the input's range is ±5⅓.
pub const TANH_INPUT_ONE: i32 = 6144;

/// Largest difference of [`tanh_code`] from the exact function, apart from the rounding to the output code: 256 chords, each
/// moved to the middle between the curve's extremes, cost h²/16 · max|tanh''| = 8.4e-5 (h = 1/24), the table's own rounding and
/// the end of the range (1 - tanh 5⅓ = 4.7e-5) less.
pub const TANH_CODE_ERROR: f64 = 1.15e-4;

/// Chords over the range.
const CHORDS: usize = 256;
/// Input codes in a chord, as a shift.
const CHORD_SHIFT: u32 = 8;
/// Steps of 1 in the table.
const TABLE_ONE: f64 = 32_768.0;

/// One kibibyte, on a boundary of a flash line.
#[derive(Debug)]
#[repr(align(16))]
pub(super) struct Table([i32; CHORDS]);

/// For each chord in the upper half of a word its start (even chords) or its end (odd ones) in units of 1/32768, in the lower
/// half its rise in half units (at most 2731): as part of the other number that is less than 1/20 of a unit. An argument's lowest
/// nine bits, signed, are the way from that point, so that no bit has to be masked.
pub(super) static TABLE: Table = table();

const fn nearest(value: f64) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}

const fn table() -> Table {
    // exp(-1/24) by its series, then tanh(x) = (1 - exp(-2x)) / (1 + exp(-2x)) in steps of x = 1/48: ends and middles of chords.
    let (mut ratio, mut term, mut n) = (1.0f64, 1.0f64, 1);
    while n < 20 {
        term *= -1.0 / 24.0 / n as f64;
        ratio += term;
        n += 1;
    }
    let mut points = [0.0; CHORDS + 1];
    let (mut power, mut i) = (1.0f64, 0);
    while i <= CHORDS {
        points[i] = (1.0 - power) / (1.0 + power) * TABLE_ONE;
        power *= ratio;
        i += 1;
    }
    let (mut table, mut i) = ([0i32; CHORDS], 0);
    while i < CHORDS / 2 {
        let [start, middle, end] = [points[2 * i], points[2 * i + 1], points[2 * i + 2]];
        let shift = (middle - (start + end) / 2.0) / 2.0;
        let rise = nearest(2.0 * (end - start));
        let (above, below) = (CHORDS / 2 + i, CHORDS / 2 - 1 - i);
        table[above] = (nearest(if above % 2 == 0 { start } else { end } + shift) << 16) + rise;
        table[below] = (-nearest(if below % 2 == 0 { end } else { start } + shift) << 16) + rise;
        i += 1;
    }
    Table(table)
}

/// tanh of a pre-activation code (units of 1/[`TANH_INPUT_ONE`]) as a code of which `limit` (at most 32,767) is 1.
#[inline]
pub fn tanh_code(code: i16, limit: u16) -> i16 {
    let place = code as u16 ^ 0x8000;
    // The sixteen bits of a code never reach beyond the table.
    let Some(&chord) = TABLE.0.get(usize::from(place >> CHORD_SHIFT)) else { return 0 };
    let way = (place << (15 - CHORD_SHIFT)) as i16;
    let value = chord.wrapping_add(i32::from(chord as i16) * i32::from(way));
    // In units of 2⁻³¹.
    super::requantisation::requantise(value, 2 * i32::from(limit)) as i16
}

/// Largest difference of [`tanh`] from the exact function: 2e-8 of the cubics, the rest the rounding of f32 (an ulp below 1 is
/// 6e-8).
pub const TANH_ERROR: f64 = 1e-7;

/// Cubics in 1, spaced so that one of them is one line of an STM32F4's flash.
const CUBICS: usize = 16;
/// From here on tanh is 1 but for 3e-8.
const SATURATED: f32 = 9.0;

/// Coefficients of 1, d, d², d³ around i / 16, on a boundary of a flash line.
#[repr(align(16))]
pub(super) struct Cubic([f32; 4]);

/// The cubics, in the order of i.
pub(super) static CUBIC: [Cubic; SATURATED as usize * CUBICS + 1] = cubics();

const fn cubics() -> [Cubic; SATURATED as usize * CUBICS + 1] {
    let mut cubics = [const { Cubic([0.0; 4]) }; SATURATED as usize * CUBICS + 1];
    // exp(-1/8), so that its powers are exp(-2x) at x = i / 16.
    let (mut ratio, mut term, mut n) = (1.0f64, 1.0f64, 1);
    while n < 24 {
        term *= -0.125 / n as f64;
        ratio += term;
        n += 1;
    }
    let (mut power, mut i) = (1.0f64, 0);
    let half = 0.5 / CUBICS as f64;
    while i < cubics.len() {
        // Taylor's series round t = tanh x, with slope s = 1 - t²; its fourth term d⁴ is replaced by the parabola nearest to it
        // within ±half, half² d² - half⁴ / 8.
        let t = (1.0 - power) / (1.0 + power);
        let s = 1.0 - t * t;
        let fourth = s * t * (2.0 / 3.0 - t * t);
        let square = half * half;
        cubics[i] = Cubic([
            (t - fourth * square * square / 8.0) as f32,
            s as f32,
            (-s * t + fourth * square) as f32,
            (s * (t * t - 1.0 / 3.0)) as f32,
        ]);
        power *= ratio;
        i += 1;
    }
    cubics
}

/// 1.5 × 2²³: in the f32 above it the last bit is worth 1.
const ROUNDING: f32 = 12_582_912.0;

/// tanh of an f32 to [`TANH_ERROR`]. NaN gives ±1.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let bits = x.to_bits();
    let magnitude = (bits & 0x7fff_ffff).min(SATURATED.to_bits());
    let y = f32::from_bits(magnitude);
    let rounded = y * CUBICS as f32 + ROUNDING;
    let index = rounded.to_bits() - ROUNDING.to_bits();
    let d = y - (rounded - ROUNDING) * (1.0 / CUBICS as f32);
    let Some(Cubic([c0, c1, c2, c3])) = CUBIC.get(index as usize) else { return 0.0 };
    let value = c0 + d * (c1 + d * (c2 + d * c3));
    f32::from_bits(value.to_bits() | bits & 0x8000_0000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_within_the_stated_error() {
        for limit in [1, 127, 2_047, 11_184, 32_767] {
            let mut worst = 0.0f64;
            for code in -32_767..=32_767i16 {
                let exact = (f64::from(code) / f64::from(TANH_INPUT_ONE)).tanh();
                let found = tanh_code(code, limit);
                worst = worst.max((f64::from(found) / f64::from(limit) - exact).abs());
                assert!((found + tanh_code(-code, limit)).abs() <= 1, "odd but for the rounding of halves");
                assert!(found.unsigned_abs() <= limit);
            }
            assert!(worst < TANH_CODE_ERROR + 0.5 / f64::from(limit), "{limit}: {worst}");
            assert!(tanh_code(i16::MIN, limit) >= -(limit as i16));
        }
    }

    #[test]
    fn floats_are_within_the_stated_error_and_odd() {
        let mut worst = 0.0f64;
        // Every 97th f32 up to 16, from the smallest on.
        for bits in (0..16.0f32.to_bits()).step_by(97) {
            let x = f32::from_bits(bits);
            let found = tanh(x);
            worst = worst.max((f64::from(found) - f64::from(x).tanh()).abs());
            assert!(found <= 1.0 && tanh(-x).to_bits() == (-found).to_bits());
        }
        assert!(worst < TANH_ERROR, "{worst}");
        assert_eq!([tanh(f32::INFINITY), tanh(f32::MIN), tanh(0.0)], [tanh(9.0), -tanh(9.0), 0.0]);
    }
}
