//! Fig. 4: difference learning on a baseline without unit DC gain.
//!
//! *in* the predecessor's loop with its vertical reference halved; *out* where the height settles; *never* another training for
//! the two lists but their inputs; *source* Zhou 2017, Lemma 1 and Fig. 4: y_ss = K0 (K + b). The cure with absolute heights is
//! ours.

use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::Model,
};
use impromptu_model_export::ExportError;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};
use impromptu_sim::{
    flight_log::FlightLog,
    rollout::{FlightPlan, fly_on},
    trajectory::{Sample, Trajectory, tones::smooth_step},
};
use impromptu_training::{Labels, Purpose, derived};
use rayon::prelude::*;

use super::{
    addon::learn,
    ground::{Ground, multisine},
    half_height::{GAIN, HalfHeight},
    inputs::{Origin, twelve},
};

const SECTION: &str = "Fig. 4: a baseline with a DC gain of 0.5 in z";
const TABLE: &str = "Half of the height: what is left of the error";
/// Heights of the steps, m; within what the training flights reached. The first is the paper's unit step.
const HEIGHTS: [f64; 4] = [1.0, 0.5, 0.75, 1.25];
/// Time of a step, and until its end is judged, s.
const STEP: f64 = 2.0;
const SETTLED: f64 = 12.0;

/// From rest on the ground to a height by a quintic, and waiting there.
fn step_to(height: f64, rate_hz: f64) -> Trajectory {
    let lead = rate_hz.round() as usize;
    let count = (SETTLED * rate_hz) as usize;
    let at = |index: usize| {
        let [rise, speed, bend] = smooth_step((index as f64 - lead as f64) / rate_hz / STEP);
        let along = |value: f64| [0.0, 0.0, height * value];
        Sample { position: along(rise), velocity: along(speed / STEP), acceleration: along(bend / (STEP * STEP)), yaw: 0.0 }
    };
    Trajectory { name: format!("step to {height} m"), rate_hz, samples: (0..count).map(at).collect(), scored: lead..count }
}

/// Flies with halved heights, all at once.
fn fly(ground: &Ground<'_>, trajectories: &[Trajectory], file: Option<&[u8]>) -> anyhow::Result<Vec<FlightLog>> {
    let closed_loop = &ground.closed_loop;
    let model = file.map(Model::from_bytes).transpose().map_err(ExportError::Refused)?;
    let delay = closed_loop.condition.command_delay_ticks(closed_loop.settings.rates.control_hz.into());
    trajectories
        .par_iter()
        .enumerate()
        .map(|(seed, trajectory)| {
            let stack = HalfHeight::new(&closed_loop.settings, delay, model.as_ref())?
                .ok_or_else(|| anyhow::anyhow!("the predecessor's airframe cannot be mixed"))?;
            let plan = FlightPlan { log: true, ..FlightPlan::new(trajectory, seed as u64) };
            let record = fly_on(stack, &closed_loop.vehicle, &closed_loop.settings, &closed_loop.condition, &plan)?;
            record.log.ok_or_else(|| anyhow::anyhow!("no log"))
        })
        .collect()
}

/// Height at the end, m.
fn settled(log: &FlightLog) -> f64 {
    log.rows.last().and_then(|row| row.true_position).map_or(f64::NAN, |position| position[2])
}

/// The lists: the paper's, and the same with heights as they are.
fn lists() -> [(&'static str, &'static str, Vec<Feature>); 2] {
    let paper = twelve(Origin::Desired);
    let absolute = paper
        .iter()
        .map(|feature| match feature {
            Feature { source: Source::Desired, channel: 2, .. } => Feature { relative: Relative::Nothing, ..*feature },
            _ => *feature,
        })
        // The height now, which the difference would have taken away.
        .chain([Feature { source: Source::Desired, channel: 2, offset: 0, relative: Relative::Nothing }])
        .collect();
    [("difference", "difference learning", paper), ("absolute_z", "absolute heights as inputs", absolute)]
}

/// Flights of the steps: name, words, logs.
type Flown = (String, String, Vec<FlightLog>);

/// Trains both and flies the steps.
pub(super) fn run(ground: &Ground<'_>, study: &mut Study) -> anyhow::Result<()> {
    let rate = ground.closed_loop.rate_hz();
    let steps: Vec<Trajectory> = HEIGHTS.iter().map(|height| step_to(*height, rate)).collect();
    let seed = derived(ground.settings.seed, Purpose::Training);
    let motions = multisine(ground.settings.flights.min(4)).motions(seed);
    let training: Vec<Trajectory> = motions.iter().map(|motion| motion.sampled(rate)).collect::<Result<_, _>>()?;
    let mut logs = fly(ground, &training, None)?;
    // The fall to half of the first height is no answer to the signal.
    for log in &mut logs {
        log.rows.drain(..(5.0 * rate) as usize);
    }
    let baseline = fly(ground, &steps, None)?;
    let learned: Vec<Vec<Flown>> = lists()
        .into_par_iter()
        .map(|(name, words, list)| {
            let learned = learn(&ground.recipe(list), &ground.closed_loop, &logs, Labels::Corrections)?;
            let network = fly(ground, &steps, Some(&learned.network_file(&ground.closed_loop)?))?;
            let ridge = fly(ground, &steps, Some(&learned.ridge_file(&ground.closed_loop)?))?;
            Ok(vec![(name.to_owned(), words.to_owned(), network), (format!("{name}_ridge"), format!("{words}, ridge"), ridge)])
        })
        .collect::<anyhow::Result<_>>()?;
    let mut flown: Vec<Flown> = vec![("baseline".into(), "no add-on".into(), baseline)];
    flown.extend(learned.into_iter().flatten());
    for (name, words, logs) in &flown {
        let finding = Finding::new(
            SECTION,
            &format!("fig_4_{name}"),
            &[16, 24, 27],
            &format!("{words}: height at which a unit step settles"),
            settled(&logs[0]),
            "m",
        )
        .cell(TABLE, words, "a unit step settles at");
        study.find(if name == "baseline" { finding.paper(f64::from(GAIN)) } else { finding });
        let worst = logs.iter().zip(HEIGHTS).map(|(log, height)| (settled(log) - height).abs()).fold(0.0, f64::max);
        study.find(
            Finding::new(
                SECTION,
                &format!("fig_4_{name}_worst"),
                &[16, 27],
                &format!("{words}: largest steady error of steps to 0.5, 0.75, 1 and 1.25 m"),
                100.0 * worst,
                "cm",
            )
            .cell(TABLE, words, "largest steady error, steps of 0.5 to 1.25 m"),
        );
    }
    let z = |log: &FlightLog, desired: bool| -> Vec<(f64, f64)> {
        let point = |row: &impromptu_sim::flight_log::LogRow| {
            let height = if desired { Some(row.desired.position[2]) } else { row.true_position.map(|position| position[2]) };
            height.map(|height| (row.time, height))
        };
        log.rows.iter().step_by(6).filter_map(point).collect()
    };
    let mut curves = vec![Curve::line("desired", z(&flown[0].2[0], true))];
    curves.extend(flown.iter().map(|(_, words, logs)| Curve::line(words, z(&logs[0], false))));
    study.draw(Figure {
        section: SECTION.into(),
        name: "fig_4".into(),
        title: "A step of the height, vertical reference halved behind the add-on".into(),
        x: Axis::linear("time [s]"),
        y: Axis::linear("z [m]"),
        curves,
    });
    let mut order: Vec<usize> = (0..HEIGHTS.len()).collect();
    order.sort_by(|a, b| HEIGHTS[*a].total_cmp(&HEIGHTS[*b]));
    study.draw(Figure {
        section: SECTION.into(),
        name: "fig_4_settled".into(),
        title: "Where steps settle: the bias of difference learning depends on the height, so that no constant removes it".into(),
        x: Axis::linear("desired height [m]"),
        y: Axis::linear("steady error [m]"),
        curves: flown
            .iter()
            .map(|(_, words, logs)| {
                Curve::line_and_dots(words, order.iter().map(|&index| (HEIGHTS[index], settled(&logs[index]) - HEIGHTS[index])))
            })
            .collect(),
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_rests_at_both_ends() {
        let step = step_to(1.25, 100.0);
        assert_eq!(step.samples[0].position[2], 0.0);
        let last = step.samples[step.samples.len() - 1];
        assert!((last.position[2] - 1.25).abs() < 1e-12 && last.velocity == [0.0; 3] && last.acceleration == [0.0; 3]);
    }
}
