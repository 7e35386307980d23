//! Polynomial segments in the CSV format of Crazyswarm.
//!
//! - in: a header row `duration,x^0,…,x^7,y^0,…,y^7,z^0,…,z^7,yaw^0,…,yaw^7` and one row for each segment: its duration in s
//!   and the coefficients of the powers of the time since the segment's beginning (m, rad);
//! - out: a motion, flown as it is written: no ramp is added, and the positions (altitude too) are not shifted;
//! - never: a segment that begins more than 1 cm, 0.05 m/s or 0.05 rad away from the end of the one before;
//! - source: Crazyswarm (Preiss, Hönig, Sukhatme, Ayanian, ICRA 2017), its trajectory files.

use super::rows::Rows;
use super::{Motion, Piece, PiecewisePolynomial, Sample, TrajectoryError};
use std::io::Read;

/// Farthest that a position may be from the origin, m: beyond is a wrong unit or a wrong coefficient.
pub(super) const FARTHEST: f64 = 1e4;
/// Allowed jump of position between segments, m: Crazyswarm's files have six digits.
const POSITION_TOLERANCE: f64 = 0.01;
/// Allowed jump of velocity, m/s.
const VELOCITY_TOLERANCE: f64 = 0.05;
/// Allowed jump of heading, rad.
const YAW_TOLERANCE: f64 = 0.05;
/// Points of each segment at which it is checked.
const CHECKS: u32 = 32;

/// Reads polynomial segments; `file` is the name for messages and for the motion.
///
/// # Errors
/// Names the line and field: header, missing or surplus columns, not a finite number, a duration that is not positive, a
/// jump between segments, no segment at all.
pub fn read_segments(source: impl Read, file: &str) -> Result<Motion, TrajectoryError> {
    from_rows(&Rows::read(source, file)?)
}

pub(super) fn from_rows(rows: &Rows) -> Result<Motion, TrajectoryError> {
    let powers = |axis| (0..8).map(move |power| format!("{axis}^{power}"));
    let expected: Vec<String> =
        std::iter::once("duration".into()).chain(["x", "y", "z", "yaw"].into_iter().flat_map(powers)).collect();
    rows.expect_header(&expected, 0)?;
    let mut pieces: Vec<Piece> = Vec::new();
    for row in rows.numbers()? {
        let duration = row.values[0];
        if duration < 1e-3 {
            let problem = format!("{duration} s; a segment lasts 0.001 s at least");
            return Err(rows.field(row.line, 0, problem));
        }
        let mut coefficients = [[0.0; 8]; 4];
        for (target, values) in coefficients.iter_mut().zip(row.values[1..].chunks_exact(8)) {
            target.copy_from_slice(values);
        }
        let piece = Piece { duration, coefficients };
        check_range(rows, row.line, &piece)?;
        if let Some(before) = pieces.last() {
            check_join(rows, row.line, before.at(before.duration), piece.at(0.0))?;
        }
        pieces.push(piece);
    }
    let curve =
        PiecewisePolynomial::new(pieces).ok_or(TrajectoryError::TooFewRows { file: rows.file.clone(), found: 0, needed: 1 })?;
    Ok(Motion::new(rows.file.clone(), curve))
}

fn check_range(rows: &Rows, line: u64, piece: &Piece) -> Result<(), TrajectoryError> {
    for step in 0..=CHECKS {
        let time = piece.duration * f64::from(step) / f64::from(CHECKS);
        let sample = piece.at(time);
        let axis = (0..3).find(|&k| sample.position[k].is_nan() || sample.position[k].abs() > FARTHEST);
        if let Some(axis) = axis {
            let problem = format!("the segment leaves ±{FARTHEST} m {time:.3} s after its beginning");
            return Err(rows.field(line, 1 + 8 * axis, problem));
        }
        if !sample.is_finite() {
            let problem = format!("the segment is not finite {time:.3} s after its beginning");
            return Err(rows.field(line, 0, problem));
        }
    }
    Ok(())
}

fn check_join(rows: &Rows, line: u64, end: Sample, start: Sample) -> Result<(), TrajectoryError> {
    let mut jumps = Vec::new();
    for axis in 0..3 {
        let column = 1 + 8 * axis;
        let position = start.position[axis] - end.position[axis];
        let velocity = start.velocity[axis] - end.velocity[axis];
        jumps.push((column, position, POSITION_TOLERANCE, "m"));
        jumps.push((column + 1, velocity, VELOCITY_TOLERANCE, "m/s"));
    }
    jumps.push((25, start.yaw - end.yaw, YAW_TOLERANCE, "rad"));
    match jumps.into_iter().find(|(_, jump, tolerance, _)| jump.abs() > *tolerance) {
        Some((column, jump, tolerance, unit)) => Err(TrajectoryError::Join {
            file: rows.file.clone(),
            line,
            field: rows.header[column].clone(),
            jump,
            tolerance,
            unit,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(rows: &[&str]) -> String {
        let powers = |axis: &str| (0..8).map(|p| format!(",{axis}^{p}")).collect::<String>();
        let header = ["x", "y", "z", "yaw"].map(powers).concat();
        // Crazyswarm's own files: capital letter, comma at the end of some lines.
        format!("Duration{header},\n{}\n", rows.join("\n"))
    }

    fn row(duration: &str, x: &str, z: &str) -> String {
        format!("{duration},{x}{},{z}{}", ", 0".repeat(14), ",0".repeat(15))
    }

    fn error(rows: &[&str]) -> String {
        read_segments(text(rows).as_bytes(), "f.csv").expect_err("refused").to_string()
    }

    #[test]
    fn two_segments_are_flown_one_after_the_other() {
        let (first, second) = (row("2", "0,0.5", "1"), row("1.5", "1,0.5", "1"));
        let motion = read_segments(text(&[&first, &second]).as_bytes(), "f.csv").expect("good file");
        assert_eq!(motion.duration(), 3.5);
        let sample = motion.at(3.0);
        assert!((sample.position[0] - 1.5).abs() < 1e-12 && sample.position[2] == 1.0);
        assert_eq!(sample.velocity, [0.5, 0.0, 0.0]);
    }

    #[test]
    fn mistakes_are_named_by_line_and_field() {
        let good = row("2", "0,0.5", "1");
        assert!(error(&[]).contains("0 rows"));
        assert!(error(&[&row("0", "0,0", "1")]).contains("line 2, field `duration`"));
        assert!(error(&[&row("-1", "0,0", "1")]).contains("0.001 s at least"));
        assert!(error(&[&good, &row("1", "NaN,0", "1")]).contains("line 3, field `x^0`: `NaN` is not a finite"));
        assert!(error(&[&good, &row("1", "1,0.5", "inf")]).contains("line 3, field `z^0`"));
        assert!(error(&[&good, &row("1", "1,abc", "1")]).contains("field `x^1`: `abc` is not a number"));
        assert!(error(&[&good, &row("1", "1.02,0.5", "1")]).contains("line 3, field `x^0`: the segment begins 0.02"));
        assert!(error(&[&good, &row("1", "1,0.6", "1")]).contains("field `x^1`"));
        assert!(error(&["1,2,3"]).contains("line 2: 3 columns, the header has 33; `x^2` is missing"));
        assert!(error(&[&format!("{good},7")]).contains("column 34 is surplus"));
        assert!(error(&[&row("1e9", "0,1", "1")]).contains("field `x^0`: the segment leaves"));
        assert!(error(&[&row("1", "0,1e308", "1")]).contains("line 2"));
    }
}
