//! Own trajectories as a table of points in time.
//!
//! - in: a header row `t,x,y,z` or `t,x,y,z,yaw` and at least four rows: s, m, rad; the times grow strictly, their spacing is
//!   free, and the first one is where the clock starts (it need not be 0);
//! - out: a motion along the smoothing spline of the points (see `smoothing_spline`): points closer together than about
//!   30 ms are smoothed (1 Hz passes with 99.9 %, 5 Hz with half the amplitude), points farther apart are met;
//! - never: a jump of velocity or acceleration inside the file;
//! - what is done at the ends: the file is flown as it is. A file that begins or ends moving asks the vehicle, at rest at
//!   the first point, for a step of velocity; after the last row the last point is held. The spline's acceleration is
//!   zero at both ends. Heading is unwrapped: between two rows it turns the shorter way.

use super::rows::{Row, Rows};
use super::segments::FARTHEST;
use super::smoothing_spline::{cubics, smoothed};
use super::{Motion, Piece, PiecewisePolynomial, TrajectoryError};
use std::f64::consts::{PI, TAU};
use std::io::Read;

/// Rows that a spline needs.
const FEWEST_ROWS: usize = 4;
/// Shortest time between rows, s.
const SHORTEST_GAP: f64 = 1e-4;
/// Time constant of the smoothing, s.
const TIME_CONSTANT: f64 = 0.03;

/// Reads a table of points; `file` is the name for messages and for the motion.
///
/// # Errors
/// Names the line and field: header, missing or surplus columns, not a finite number, times that do not grow, a position
/// farther than 10 km away, fewer than four rows.
pub fn read_table(source: impl Read, file: &str) -> Result<Motion, TrajectoryError> {
    from_rows(&Rows::read(source, file)?)
}

pub(super) fn from_rows(rows: &Rows) -> Result<Motion, TrajectoryError> {
    rows.expect_header(&["t", "x", "y", "z", "yaw"].map(String::from), 1)?;
    let table = rows.numbers()?;
    if table.len() < FEWEST_ROWS {
        return Err(TrajectoryError::TooFewRows { file: rows.file.clone(), found: table.len(), needed: FEWEST_ROWS });
    }
    for row in &table {
        check_range(rows, row)?;
    }
    for pair in table.windows(2) {
        let (before, now) = (pair[0].values[0], pair[1].values[0]);
        if now - before < SHORTEST_GAP {
            let problem = format!("{now} follows {before}; the times must grow by {SHORTEST_GAP} s at least");
            return Err(rows.field(pair[1].line, 0, problem));
        }
    }
    let times: Vec<f64> = table.iter().map(|row| row.values[0] - table[0].values[0]).collect();
    let mut pieces: Vec<Piece> =
        times.windows(2).map(|pair| Piece { duration: pair[1] - pair[0], coefficients: [[0.0; 8]; 4] }).collect();
    for axis in 0..rows.header.len() - 1 {
        let mut values: Vec<f64> = table.iter().map(|row| row.values[axis + 1]).collect();
        if axis == 3 {
            unwrap(&mut values);
        }
        let (fitted, curvature) = smoothed(&times, &values, TIME_CONSTANT);
        for (piece, cubic) in pieces.iter_mut().zip(cubics(&times, &fitted, &curvature)) {
            piece.coefficients[axis][..4].copy_from_slice(&cubic);
        }
    }
    let curve = PiecewisePolynomial::new(pieces).expect("four rows give three pieces");
    Ok(Motion::new(rows.file.clone(), curve))
}

fn check_range(rows: &Rows, row: &Row) -> Result<(), TrajectoryError> {
    let far = (1..row.values.len()).find(|&column| row.values[column].abs() > FARTHEST);
    far.map_or(Ok(()), |column| {
        let problem = format!("{} is beyond ±{FARTHEST}", row.values[column]);
        Err(rows.field(row.line, column, problem))
    })
}

/// Takes out the jumps of whole turns.
fn unwrap(angles: &mut [f64]) {
    for i in 1..angles.len() {
        let step = angles[i] - angles[i - 1];
        if step.abs() > PI {
            angles[i] -= TAU * (step / TAU).round();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        read_table(text.as_bytes(), "f.csv").expect_err("refused").to_string()
    }

    #[test]
    fn an_uneven_table_of_a_known_curve_gives_its_derivatives() {
        let mut text = String::from("t,x,y,z,yaw\n");
        let mut t: f64 = 0.0;
        for i in 0..200 {
            let yaw = (t + PI).rem_euclid(TAU) - PI;
            text += &format!("{},{},{},1.5,{yaw}\n", 1.7e9 + t, t.sin(), (2.0 * t).cos());
            t += if i % 3 == 0 { 0.02 } else { 0.07 };
        }
        let motion = read_table(text.as_bytes(), "f.csv").expect("good file");
        for i in 100..900 {
            let t = f64::from(i) * 0.01;
            let sample = motion.at(t);
            assert!((sample.position[0] - t.sin()).abs() < 1e-4);
            assert!((sample.velocity[1] + 2.0 * (2.0 * t).sin()).abs() < 5e-3);
            assert!((sample.acceleration[1] + 4.0 * (2.0 * t).cos()).abs() < 0.05);
            assert!((sample.yaw - t).abs() < 1e-3, "unwrapped: {} at {t}", sample.yaw);
        }
    }

    #[test]
    fn mistakes_are_named_by_line_and_field() {
        let rows = "0,0,0,1\n1,0,0,1\n2,0,0,1\n";
        let with = |last: &str| error(&format!("t,x,y,z\n{rows}{last}\n"));
        assert!(with("2,0,0,1").contains("line 5, field `t`: 2 follows 2"));
        assert!(with("3,NaN,0,1").contains("line 5, field `x`"));
        assert!(with("3,0,,1").contains("line 5, field `y`: is empty"));
        assert!(with("3,0,0").contains("line 5: 3 columns, the header has 4; `z` is missing"));
        assert!(with("3,0,0,1,9").contains("column 5 is surplus"));
        assert!(with("3,0,1e5,1").contains("field `y`: 100000 is beyond"));
        assert!(with("").contains("3 rows of data, at least 4"));
        assert!(error("t,x,z,y\n").contains("column 3 is `z` instead of `y`"));
        assert!(error("t,x,y\n").contains("column 4 (`z`) is missing"));
        assert!(error("").contains("the file is empty"));
    }
}
