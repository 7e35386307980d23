//! Real flights: what a learned window would gain, as a model of the loop predicts it.
//!
//! *in* logs of horizontal position and set-point; *out* for each flight the error as measured, as the model repeats it, and as
//! the model predicts it with a learned window and with a pure time shift; *never* a flight of the family that is predicted, nor
//! a copy of one under another name, in what is learned: model, window, shift and penalty come from the other families.
//!
//! What it is worth: the error with an add-on is a model's, nothing was flown. The model misses the measured flight by
//! [`Prediction::misfit`]; an improvement that leaves less error than that is not shown. [`Prediction::cautious`] adds the misfit
//! to the predicted error.

use impromptu_sim::columns::{Table, TableError};
use rayon::prelude::*;

use crate::siso::{
    LinearMap, Rows,
    lag::{Axis, Lag, interpolate},
};

/// Seconds between samples of the logs.
pub const PERIOD: f64 = 0.04;
/// What to do where a column is missing.
const ADVICE: &str = "a log needs px, py, sp_ctrltarget_x and sp_ctrltarget_y in m, sampled every 40 ms";
/// Left out at the start (the loop comes from somewhere) and at the end (preview beyond the log), s.
const MARGIN: f64 = 2.0;
/// The window's span round now, and the distance of its samples, in samples.
const PAST: i64 = 10;
const AHEAD: i64 = 30;
const STEP: usize = 2;
const PENALTIES: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];

/// A flight, horizontally.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Name of the log.
    pub name: String,
    /// Set-point of x and y, m.
    pub reference: [Vec<f64>; 2],
    /// Position, m.
    pub position: [Vec<f64>; 2],
}

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FlightError {
    /// It is no table of numbers with the columns needed.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Nothing to learn from.
    #[error("{0} families are too few: one is predicted from the others; give logs of at least three")]
    Families(usize),
}

impl Flight {
    /// A log as text: a line of column names, then rows.
    ///
    /// # Errors
    /// If a column is missing or a number is none.
    pub fn parse(name: &str, text: &str) -> Result<Self, FlightError> {
        let mut table = Table::new(text.as_bytes(), name)?;
        let place = |column| table.require(column, ADVICE);
        let places = [place("sp_ctrltarget_x")?, place("sp_ctrltarget_y")?, place("px")?, place("py")?];
        let mut columns: [Vec<f64>; 4] = Default::default();
        for row in table.rows() {
            for (column, value) in columns.iter_mut().zip(row?.numbers(places)?) {
                column.push(value);
            }
        }
        let [rx, ry, px, py] = columns;
        Ok(Self { name: name.into(), reference: [rx, ry], position: [px, py] })
    }

    /// What its trajectory is, in all sizes and speeds: the name up to the second underscore.
    pub fn family(&self) -> &str {
        self.name.match_indices('_').nth(1).map_or(&self.name, |(end, _)| &self.name[..end])
    }

    fn axes(&self) -> [Axis<'_>; 2] {
        [0, 1].map(|axis| Axis { reference: &self.reference[axis], output: &self.position[axis] })
    }

    /// RMS distance of `paths` and `others` without the margins, m.
    fn distance(paths: &[Vec<f64>; 2], others: &[Vec<f64>; 2]) -> f64 {
        let margin = (MARGIN / PERIOD) as usize;
        let samples = paths[0].len();
        let counted = margin..samples.saturating_sub(margin).max(margin);
        let count = counted.len().max(1) as f64;
        let square = |axis: usize| counted.clone().map(|i| (paths[axis][i] - others[axis][i]).powi(2)).sum::<f64>();
        libm::sqrt((square(0) + square(1)) / count)
    }

    /// The model's run with references made of the set-points, and its error against the set-points.
    fn error(&self, lag: &Lag, adapt: &dyn Fn(&[f64]) -> Vec<f64>) -> f64 {
        let runs = [0, 1].map(|axis| {
            let reference = adapt(&self.reference[axis]);
            lag.beside(&Axis { reference: &reference, output: &self.position[axis] }, PERIOD)
        });
        Self::distance(&runs, &self.reference)
    }
}

/// Flights without those that repeat another one's numbers under another name.
pub fn distinct(flights: Vec<Flight>) -> Vec<Flight> {
    let mut kept: Vec<Flight> = Vec::new();
    for flight in flights {
        if !kept.iter().any(|other| other.reference == flight.reference && other.position == flight.position) {
            kept.push(flight);
        }
    }
    kept
}

/// What is predicted for a flight, RMS errors in m.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// The flight.
    pub name: String,
    /// As flown.
    pub measured: f64,
    /// Of the model without add-on.
    pub repeated: f64,
    /// Between the model's free run and the flight.
    pub misfit: f64,
    /// Of the model with the learned window.
    pub window: f64,
    /// Of the model with every set-point given earlier by a fixed time.
    pub shift: f64,
    /// That time, s.
    pub shift_time: f64,
    /// The model.
    pub model: Lag,
}

impl Prediction {
    /// The predicted error with the window and the model's misfit, as if they had nothing to do with each other.
    pub fn cautious(&self) -> f64 {
        libm::hypot(self.window, self.misfit)
    }
}

fn offsets() -> impl Iterator<Item = i64> {
    (-PAST..=AHEAD).step_by(STEP)
}

/// Reference less output, from the outputs round now less the output now.
fn rows(flights: &[&Flight]) -> Rows {
    let mut rows = Vec::new();
    for axis in flights.iter().flat_map(|flight| flight.axes()) {
        let samples = axis.output.len() as i64;
        for now in PAST..samples - AHEAD {
            let at = |offset: i64| axis.output[(now + offset) as usize];
            rows.push((offsets().map(|offset| at(offset) - at(0)).collect(), axis.reference[now as usize] - at(0)));
        }
    }
    Rows::new(&rows)
}

fn windowed(map: &LinearMap, desired: &[f64]) -> Vec<f64> {
    let at = |index: i64| desired[index.clamp(0, desired.len() as i64 - 1) as usize];
    (0..desired.len() as i64)
        .map(|now| {
            let inputs: Vec<f64> = offsets().map(|offset| at(now + offset) - at(now)).collect();
            // Without the intercept: no direction is special.
            at(now) + map.output(&inputs) - map.intercept
        })
        .collect()
}

fn shifted(desired: &[f64], seconds: f64) -> Vec<f64> {
    (0..desired.len()).map(|now| interpolate(desired, now as f64 + seconds / PERIOD)).collect()
}

/// Predicts every flight from the flights of the other families.
///
/// # Errors
/// If there are less than three families.
pub fn predict(flights: &[Flight]) -> Result<Vec<Prediction>, FlightError> {
    let mut families: Vec<&str> = flights.iter().map(Flight::family).collect();
    families.sort_unstable();
    families.dedup();
    if families.len() < 3 {
        return Err(FlightError::Families(families.len()));
    }
    Ok(families.par_iter().flat_map_iter(|family| predict_family(flights, family)).collect())
}

fn predict_family(flights: &[Flight], family: &str) -> Vec<Prediction> {
    let others: Vec<&Flight> = flights.iter().filter(|flight| flight.family() != family).collect();
    let axes: Vec<Axis<'_>> = others.iter().flat_map(|flight| flight.axes()).collect();
    let model = Lag::identify(&axes, PERIOD);
    let total = |adapt: &dyn Fn(&[f64]) -> Vec<f64>| others.iter().map(|flight| flight.error(&model, adapt)).sum::<f64>();
    let least = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0);
    let times = (0..=50).map(|step| f64::from(step) * 0.02);
    let (_, shift_time) = times.map(|time| (total(&|desired| shifted(desired, time)), time)).min_by(least).unwrap_or((0.0, 0.0));
    let rows = rows(&others);
    let maps = PENALTIES.iter().filter_map(|penalty| LinearMap::fit(&rows, *penalty));
    let map = maps.map(|map| (total(&|desired| windowed(&map, desired)), map)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, map)) = map else { return Vec::new() };
    let own = flights.iter().filter(|flight| flight.family() == family);
    own.map(|flight| {
        let run = flight.axes().map(|axis| model.beside(&axis, PERIOD));
        Prediction {
            name: flight.name.clone(),
            measured: Flight::distance(&flight.position, &flight.reference),
            repeated: Flight::distance(&run, &flight.reference),
            misfit: Flight::distance(&run, &flight.position),
            window: flight.error(&model, &|desired| windowed(&map, desired)),
            shift: flight.error(&model, &|desired| shifted(desired, shift_time)),
            shift_time,
            model,
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::Multisine;

    fn flight(name: &str, seed: u64) -> Flight {
        let lag = Lag { frequency: 3.0, damping: 0.6, gain: 1.0, feed_forward: 0.1, delay: 0.08 };
        let reference = [0, 1].map(|axis| {
            let signal = Multisine::random(4, [0.05, 0.4], 0.4, 0.0, seed * 2 + axis);
            (0..500).map(|sample| signal.at(f64::from(sample) * PERIOD)).collect::<Vec<f64>>()
        });
        let position = reference.each_ref().map(|reference| lag.output(reference, PERIOD, reference[0], 0.0));
        Flight { name: name.into(), reference, position }
    }

    #[test]
    fn a_loop_that_is_a_lag_is_predicted_and_the_window_beats_the_shift() {
        let flights = ["B1_a_rep1", "B1_a_rep2", "B2_b_rep1", "B3_c_rep1"].iter().zip(1..).map(|(name, seed)| flight(name, seed));
        let flights: Vec<Flight> = flights.collect();
        assert_eq!(flights[0].family(), "B1_a");
        assert!(matches!(predict(&flights[..2]), Err(FlightError::Families(1))));
        for prediction in predict(&flights).unwrap() {
            assert!(prediction.misfit < 0.02 * prediction.measured, "{prediction:?}");
            assert!(prediction.window < 0.5 * prediction.shift && prediction.shift < 0.6 * prediction.repeated, "{prediction:?}");
        }
    }

    #[test]
    fn a_copy_under_another_name_is_dropped_and_a_broken_log_named() {
        let (one, mut copy) = (flight("B1_a_rep1", 1), flight("B1_a_rep7", 1));
        assert_eq!(distinct(vec![one.clone(), copy.clone()]).len(), 1);
        copy.position[0][3] += 1e-3;
        assert_eq!(distinct(vec![one, copy]).len(), 2);
        let text = "t,px,py,sp_ctrltarget_x,sp_ctrltarget_y\n0.0,1,2,3,4\n0.04,1,nan,3,4\n";
        let refused = Flight::parse("l", text).unwrap_err().to_string();
        assert!(refused.starts_with("l, line 3: `py` is `nan`"), "{refused}");
        let log = Flight::parse("l", "px,sp_ctrltarget_y,py,sp_ctrltarget_x\n1,2,3,4\n").unwrap();
        assert_eq!((log.position, log.reference), ([vec![1.0], vec![3.0]], [vec![4.0], vec![2.0]]));
        let refused = Flight::parse("l", "px\n").unwrap_err().to_string();
        assert!(refused.starts_with("l: column `sp_ctrltarget_x` is missing (there are: px)"), "{refused}");
    }
}
