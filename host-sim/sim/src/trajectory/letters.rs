//! Words in one stroke: letters A to Z in a vertical plane.

use super::pen::{self, Pace};
use super::{Motion, TrajectoryError};

/// Height of the text's middle, m.
const CENTRE_HEIGHT: f64 = 1.5;
/// Longest word.
const MOST_LETTERS: usize = 16;
/// Units of the letters' grid from one letter to the next: 4 for the letter, 2 for the gap.
const ADVANCE: usize = 6;

/// Corners of each letter from A to Z on a grid of 4 x 6, in the order in which the pen passes them: pairs of column and
/// row, the row counted upwards.
const GLYPHS: [&str; 26] = [
    "00 26 40 33 13",
    "00 06 36 45 44 33 03 33 42 41 30 00",
    "45 36 16 05 01 10 30 41",
    "00 06 26 45 41 20 00",
    "46 06 03 33 03 00 40",
    "46 06 03 33 03 00",
    "45 36 16 05 01 10 30 41 43 23",
    "06 00 03 43 46 40",
    "16 36 26 20 10 30",
    "46 41 30 10 01",
    "06 00 03 46 03 40",
    "06 00 40",
    "00 06 23 46 40",
    "00 06 40 46",
    "26 16 05 01 10 30 41 45 36 26",
    "00 06 36 45 44 33 03",
    "22 40 30 10 01 05 16 36 45 41 30",
    "00 06 36 45 44 33 03 23 40",
    "01 10 30 41 42 33 13 04 05 16 36 45",
    "06 46 26 20",
    "06 01 10 30 41 46",
    "06 20 46",
    "06 10 23 30 46",
    "00 46 23 06 40",
    "06 23 46 23 20",
    "06 46 00 40",
];

/// A word of up to 16 letters A to Z (and spaces) in one stroke in the x-z plane, `height` m high, the letters joined by
/// straight lines; drawn with curvature-limited speed. "DSL" at 1.5 m is 4 m wide.
///
/// # Errors
/// No letter, too many, another character, or a height outside 0.1 to 10 m.
pub fn letters(text: &str, height: f64, pace: Pace) -> Result<Motion, TrajectoryError> {
    let name = format!("letters:{text}");
    let refused = |problem: String| TrajectoryError::Name { name: name.clone(), problem };
    let length = text.chars().count();
    if length > MOST_LETTERS || text.trim().is_empty() {
        return Err(refused(format!("expected 1 to {MOST_LETTERS} letters A to Z")));
    }
    if !(0.1..=10.0).contains(&height) {
        return Err(refused(format!("height {height} m, expected 0.1 to 10 m")));
    }
    let unit = height / 6.0;
    let middle = (length * ADVANCE - 2) as f64 / 2.0;
    let mut corners = Vec::new();
    for (place, letter) in text.chars().enumerate() {
        let glyph = match letter.to_ascii_uppercase() {
            ' ' => continue,
            upper @ 'A'..='Z' => GLYPHS[upper as usize - 'A' as usize],
            other => return Err(refused(format!("`{other}` is not a letter A to Z"))),
        };
        corners.extend(glyph.split(' ').map(|corner| {
            let digits = corner.as_bytes();
            let column = f64::from(digits[0] - b'0') + (place * ADVANCE) as f64 - middle;
            let row = f64::from(digits[1] - b'0') - 3.0;
            [column * unit, 0.0, CENTRE_HEIGHT.max(height / 2.0 + 0.5) + row * unit]
        }));
    }
    let path = pen::rounded(&corners, 0.3 * unit);
    Ok(Motion::new(name, pen::drawn(&path, pace)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_is_drawn_within_its_limits() {
        let pace = Pace::default();
        for letter in 'A'..='Z' {
            let motion = letters(&letter.to_string(), 1.5, pace).expect("letter");
            let (speed, acceleration) = motion.peaks(0.005);
            assert!(speed <= pace.max_speed && acceleration <= pace.max_acceleration, "{letter}");
            assert!((1.0..20.0).contains(&motion.duration()), "{letter}");
        }
    }

    #[test]
    fn a_word_has_its_size_and_stays_in_its_plane() {
        let word = letters("DSL", 1.5, Pace::default()).expect("letters");
        let trajectory = word.sampled(100.0).expect("rate");
        let range = |axis: usize| {
            let values = trajectory.samples.iter().map(|s| s.position[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        assert!((3.7..4.01).contains(&range(0)), "{}", range(0));
        assert_eq!(range(1), 0.0);
        assert!((1.3..1.51).contains(&range(2)), "{}", range(2));
    }

    #[test]
    fn other_characters_are_named() {
        for (text, part) in [("D5L", "`5`"), ("", "1 to 16"), ("ABCDEFGHIJKLMNOPQ", "1 to 16")] {
            let error = letters(text, 1.5, Pace::default()).expect_err("refused").to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
