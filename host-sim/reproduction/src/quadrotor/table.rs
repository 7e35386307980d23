//! Table I and Fig. 3: 12 against 36 inputs, everything else identical.
//!
//! *in* the predecessor's loop and training logs; *out* reductions over five trajectories, paths, delays; *never* a difference
//! between the two trainings but the list of inputs; *source* Zhou 2017, section V-B and C.

use impromptu_model_export::FloatNetwork;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Asked, Finding, Study},
};
use impromptu_sim::{flight_log::FlightLog, flights::Loop};
use impromptu_training::Labels;
use rayon::prelude::*;

use super::{
    addon::{Learned, learn},
    ground::{Ground, TEST},
    inputs::{Origin, thirty_six, twelve},
};

const SECTION: &str = "Table I and Fig. 3: 12 against 36 inputs";
const TABLE: &str = "Table I: reduction of the RMS error";
/// Reductions that the paper states, 12 and 36 inputs, per cent; its five trajectories are others.
const PAPER: [[f64; 5]; 2] = [[52.4, 48.4, 42.0, 46.6, 36.9], [55.6, 61.4, 39.7, 43.9, 26.6]];
const PAPER_MEAN: [f64; 2] = [45.2, 45.5];

/// The two networks, and the reference points with which they fly.
pub(super) struct Networks {
    pub(super) twelve: Learned,
    pub(super) thirty_six: Learned,
    /// Inputs relative to, output added to: chosen on validation strokes.
    pub(super) origins: (Origin, Origin),
}

impl Networks {
    /// The file of one of the maps with 12 inputs.
    pub(super) fn twelve_file(&self, closed_loop: &Loop, network: &FloatNetwork) -> anyhow::Result<Vec<u8>> {
        let (inputs, base) = self.origins;
        Ok(self.twelve.file(closed_loop, network, &twelve(inputs), base)?)
    }
}

/// The reference points with which the network with 12 inputs reduces the error of the validation strokes most.
fn best_origins(ground: &Ground<'_>, learned: &Learned) -> anyhow::Result<(Origin, Origin)> {
    let mut best = (f64::NEG_INFINITY, (Origin::Desired, Origin::Desired));
    for inputs in [Origin::Desired, Origin::Measured] {
        for base in [Origin::Desired, Origin::Measured] {
            let file = learned.file(&ground.closed_loop, &learned.maps.network, &twelve(inputs), base)?;
            let (mean, _) = ground.validation.reduction(&ground.closed_loop, &file)?;
            if mean > best.0 {
                best = (mean, (inputs, base));
            }
        }
    }
    Ok(best.1)
}

/// Trains both networks and flies the five trajectories.
pub(super) fn run(ground: &Ground<'_>, study: &mut Study) -> anyhow::Result<Networks> {
    let closed_loop = &ground.closed_loop;
    let lists = [("12", twelve(Origin::Measured)), ("36", thirty_six(Origin::Measured))];
    let learned: Vec<Learned> = lists
        .par_iter()
        .map(|(_, list)| learn(&ground.recipe(list.clone()), closed_loop, &ground.logs, Labels::Corrections))
        .collect::<anyhow::Result<_>>()?;
    let mut learned = learned.into_iter();
    let (Some(twelve), Some(thirty_six)) = (learned.next(), learned.next()) else { anyhow::bail!("two lists, two networks") };
    let networks = Networks { origins: best_origins(ground, &twelve)?, twelve, thirty_six };
    let files = [
        [&networks.twelve.maps.network, &networks.twelve.maps.ridge].map(|map| networks.twelve_file(closed_loop, map)),
        [networks.thirty_six.network_file(closed_loop), networks.thirty_six.ridge_file(closed_loop)].map(|file| Ok(file?)),
    ];
    let determinations = [networks.twelve.maps.determination, networks.thirty_six.maps.determination];
    let baseline = ground.test.logs(closed_loop, None)?;
    let mut logs: Vec<Vec<FlightLog>> = Vec::new();
    for ((((name, _), [file, ridge]), determination), (paper, paper_mean)) in
        lists.iter().zip(files).zip(determinations).zip(PAPER.iter().zip(PAPER_MEAN))
    {
        let (file, ridge) = (file?, ridge?);
        let column = format!("{name} inputs");
        let errors = ground.test.errors(closed_loop, &file, super::addon::NETWORK)?;
        let reductions = ground.test.reductions(&errors);
        for ((trajectory, reduction), paper) in TEST.iter().zip(&reductions).zip(paper) {
            let key = trajectory.replace(':', "_").to_lowercase();
            study.find(
                Finding::new(
                    SECTION,
                    &format!("table_1_{name}_{key}"),
                    &[21, 25],
                    &format!("{name} inputs, {trajectory}: reduction of the RMS error"),
                    *reduction,
                    "%",
                )
                .cell(TABLE, trajectory, &column)
                .paper(*paper),
            );
        }
        let mean = reductions.iter().sum::<f64>() / reductions.len() as f64;
        let finding = Finding::new(
            SECTION,
            &format!("table_1_{name}_mean"),
            &[21, 22, 23, 25],
            &format!("{name} inputs: mean reduction over the five"),
            mean,
            "%",
        )
        .paper(paper_mean)
        .cell(TABLE, "mean reduction over the five", &column);
        study.find(if *name == "12" { finding.asked(Asked::AtLeast(80.0)) } else { finding });
        let (validation, worst) = ground.validation.reduction(closed_loop, &file)?;
        let (ridge, _) = ground.test.reduction(closed_loop, &ridge)?;
        for (key, what, value) in [
            ("validation", "mean over the validation strokes", validation),
            ("validation_worst", "worst of the validation strokes", worst),
            ("ridge", "ridge regression on the same inputs, mean over the five", ridge),
            ("rows", "R² of the network on the flights kept from training", 100.0 * determination),
        ] {
            let text = format!("{column}: {what}");
            let found = Finding::new(SECTION, &format!("inputs_{name}_{key}"), &[21], &text, value, "%");
            study.find(found.cell(TABLE, what, &column));
        }
        let cm = 100.0 * errors.iter().sum::<f64>() / errors.len() as f64;
        let text = format!("{column}: mean RMS error");
        let found = Finding::new(SECTION, &format!("inputs_{name}_error"), &[25], &text, cm, "cm");
        study.find(found.cell(TABLE, "mean RMS error", &column));
        logs.push(ground.test.logs(closed_loop, Some(&file))?);
    }
    let cm = 100.0 * ground.test.baseline.iter().sum::<f64>() / 5.0;
    let found = Finding::new(SECTION, "baseline_error", &[20, 25], "baseline: mean RMS error", cm, "cm");
    study.find(found.cell(TABLE, "mean RMS error", "baseline"));
    delays(study, [("baseline", &baseline), ("12 inputs", &logs[0]), ("36 inputs", &logs[1])]);
    figures(study, [("baseline", &baseline[0]), ("12 inputs", &logs[0][0]), ("36 inputs", &logs[1][0])]);
    study.note(
        SECTION,
        &format!(
            "The predecessor's loop, 4 x 128 ReLU, one network for all six references, held for 0.15 s, no noise. 36 inputs: \
             positions relative to the \
             measured one, output added to the desired one, as in the paper. 12 inputs: relative to {}, output added to {}, the \
             best of four choices on \
             validation strokes (next section); training does not depend on it. The five trajectories are this project's own: \
             the paper's are not \
             published but for the letters. Its 45 % are of a real vehicle that was trained on three growing tones; here air \
             and sensors are still and the \
             training signal is rich. What the paper's signal does to the same network stands under \u{201c}Training \
             signals\u{201d}.",
            networks.origins.0.word(),
            networks.origins.1.word()
        ),
    );
    Ok(networks)
}

/// Delay of each axis against the desired one, over all flights, by cross-correlation.
fn delays(study: &mut Study, flights: [(&str, &Vec<FlightLog>); 3]) {
    for (name, logs) in flights {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let Some(delay) = delay(logs, axis) else { continue };
            let text = format!("{name}: delay of {letter} by cross-correlation");
            let found = Finding::new(SECTION, &format!("delay_{letter}_{}", name.replace(' ', "_")), &[26], &text, delay, "s");
            study.find(found.cell("Delay by cross-correlation", letter, name));
        }
    }
}

/// Longest delay that is looked for, s.
const LONGEST: f64 = 3.0;

/// The lag at which the flown coordinate fits the desired one best, s, between ticks by a parabola. Negative: early.
pub(super) fn delay(logs: &[FlightLog], axis: usize) -> Option<f64> {
    let rate = logs.first()?.rate_hz;
    let most = (LONGEST * rate) as i64;
    let correlation = |lag: i64| -> f64 {
        let (mut product, mut squares) = (0.0, [0.0; 2]);
        for log in logs {
            let rows = log.rows.len() as i64;
            let pairs = log.scored.clone().filter_map(|tick| {
                let from = tick as i64 - lag;
                let flown = log.rows[tick].true_position?[axis];
                (0..rows).contains(&from).then(|| (log.rows[from as usize].desired.position[axis], flown))
            });
            let pairs: Vec<(f64, f64)> = pairs.collect();
            let count = pairs.len().max(1) as f64;
            let mean = pairs.iter().fold([0.0; 2], |sum, pair| [sum[0] + pair.0 / count, sum[1] + pair.1 / count]);
            for (desired, flown) in pairs {
                let (desired, flown) = (desired - mean[0], flown - mean[1]);
                product += desired * flown;
                squares = [squares[0] + desired * desired, squares[1] + flown * flown];
            }
        }
        product / (squares[0] * squares[1]).sqrt()
    };
    let (best, _) = (-most / 4..=most).map(|lag| (lag, correlation(lag))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [before, at, after] = [best - 1, best, best + 1].map(correlation);
    let bend = before - 2.0 * at + after;
    let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((best as f64 + part) / rate)
}

/// The letters as a path, and over time.
fn figures(study: &mut Study, flights: [(&str, &FlightLog); 3]) {
    let drawn = |log: &FlightLog, of: &dyn Fn(usize) -> Option<(f64, f64)>| -> Vec<(f64, f64)> {
        log.scored.clone().step_by(4).filter_map(of).collect()
    };
    // The letters stand in a vertical plane: the coordinate that varies more is the horizontal one.
    let range = |axis: usize| {
        let values = flights[0].1.rows.iter().map(|row| row.desired.position[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let across = if range(0) >= range(1) { 0 } else { 1 };
    let curves = |x: &dyn Fn(&FlightLog, usize, bool) -> Option<f64>, y: &dyn Fn(&FlightLog, usize, bool) -> Option<f64>| {
        let mut curves = vec![Curve::line(
            "desired",
            drawn(flights[0].1, &|tick| Some((x(flights[0].1, tick, true)?, y(flights[0].1, tick, true)?))),
        )];
        curves.extend(
            flights
                .iter()
                .map(|(name, log)| Curve::line(name, drawn(log, &|tick| Some((x(log, tick, false)?, y(log, tick, false)?))))),
        );
        curves
    };
    let coordinate = |axis: usize| {
        move |log: &FlightLog, tick: usize, desired: bool| {
            let row = &log.rows[tick];
            if desired { Some(row.desired.position[axis]) } else { row.true_position.map(|position| position[axis]) }
        }
    };
    let time = |log: &FlightLog, tick: usize, _: bool| Some(log.rows[tick].time);
    let mut draw = |name: &str, title: &str, x: Axis, y: Axis, curves: Vec<Curve>| {
        study.draw(Figure { section: SECTION.into(), name: name.into(), title: title.into(), x, y, curves });
    };
    draw(
        "fig_3_path",
        "The letters 'DSL' in their plane",
        Axis::linear("across [m]"),
        Axis::linear("z [m]"),
        curves(&coordinate(across), &coordinate(2)),
    );
    draw(
        "fig_3_across",
        "The same over time, across",
        Axis::linear("time [s]"),
        Axis::linear("across [m]"),
        curves(&time, &coordinate(across)),
    );
    draw("fig_3_z", "The same over time, z", Axis::linear("time [s]"), Axis::linear("z [m]"), curves(&time, &coordinate(2)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use impromptu_sim::{flight_log::LogRow, trajectory::Sample};

    #[test]
    fn a_known_delay_is_found_between_ticks() {
        let wave = |time: f64| (1.3 * time).sin() + 0.4 * (3.1 * time).cos();
        let rows = (0..2000)
            .map(|tick| {
                let time = f64::from(tick) / 100.0;
                LogRow {
                    time,
                    desired: Sample { position: [wave(time); 3], ..Sample::default() },
                    true_position: Some([0.7 * wave(time - 0.4237); 3]),
                    ..LogRow::default()
                }
            })
            .collect();
        let log = FlightLog { name: "wave".into(), rate_hz: 100.0, scored: 100..1900, rows };
        assert!((delay(&[log], 1).unwrap() - 0.4237).abs() < 2e-3);
    }
}
