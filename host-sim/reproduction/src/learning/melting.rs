//! How the error melts over the first minute.
//!
//! *in* settings; *out* a figure; *never* a curve of one lucky flight: the root mean square over flights, second by second;
//! *source* none.

use impromptu_report::{Axis, Curve, Figure};
use impromptu_sim::{
    flight_log::{FlightLog, LogRow},
    rollout::FlightPlan,
    trajectory::{Trajectory, strokes},
};
use impromptu_training::{Purpose, derived};
use rayon::prelude::*;

use super::{Settings, cases::cases, report::SECTION};

/// What is drawn, s, and flights that are averaged.
const SHOWN: usize = 60;
const FLIGHTS: u64 = 10;

/// The error second by second, without anything and with what is learned.
pub(super) fn figure(settings: &Settings) -> anyhow::Result<Figure> {
    let case = cases().into_iter().next().unwrap_or_else(|| unreachable!("there are cases"));
    let closed_loop = case.closed_loop()?;
    let seed = derived(settings.seed, Purpose::Test);
    let flown: Vec<[Vec<f64>; 2]> = (0..FLIGHTS)
        .into_par_iter()
        .map(|flight| {
            // Strokes that no other flight has, one after another as one motion that begins anew where the last one ended.
            let motions = strokes(seed ^ (flight + 1), 4, 1.0, closed_loop.rate_hz())?;
            let mut learning = closed_loop.learning()?;
            let mut errors = [Vec::new(), Vec::new()];
            for (stroke, seed) in motions.iter().zip(seed..) {
                let plan = FlightPlan { log: true, ..FlightPlan::new(stroke, seed) };
                let records =
                    [closed_loop.fly(std::slice::from_ref(&plan))?.remove(0), closed_loop.fly_learning(&plan, &mut learning)?];
                for (errors, record) in errors.iter_mut().zip(records) {
                    errors.extend(squares(stroke, &record.log.unwrap_or_default()));
                }
            }
            Ok(errors)
        })
        .collect::<anyhow::Result<_>>()?;
    let curve = |index: usize, label: &str| {
        let second = |second: usize| {
            let all = flown.iter().filter_map(|errors| errors[index].get(second));
            let (sum, count) = all.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
            (second as f64 + 0.5, 100.0 * (sum / f64::from(count.max(1))).sqrt())
        };
        Curve::line(label, (0..SHOWN).map(second))
    };
    Ok(Figure {
        section: SECTION.into(),
        name: "first_minute".into(),
        title: format!(
            "The error melts: {} in {}, nothing trained before. Position error of each second, root mean square of {FLIGHTS} \
             flights of unseen strokes; rests between strokes are left out.",
            closed_loop.vehicle.name, closed_loop.condition.name
        ),
        x: Axis::linear("time in motion [s]"),
        y: Axis::logarithmic("position error [cm]"),
        curves: vec![curve(0, "without learning"), curve(1, "learning")],
    })
}

/// Mean square of the error in each whole second of the drawn part, m².
fn squares(stroke: &Trajectory, log: &FlightLog) -> Vec<f64> {
    let rate = stroke.rate_hz as usize;
    let rows = log.rows.get(stroke.scored.clone()).unwrap_or_default();
    let of = |rows: &[LogRow]| {
        let square = |row: &LogRow| {
            let position = row.true_position.unwrap_or(row.measured_position);
            (0..3).map(|axis| (position[axis] - row.desired.position[axis]).powi(2)).sum::<f64>()
        };
        rows.iter().map(square).sum::<f64>() / rows.len().max(1) as f64
    };
    rows.chunks_exact(rate).map(of).collect()
}
