//! How a draw is flown and judged.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use impromptu_firmware::model::Model;
use impromptu_reproduction::robustness::{Change, Mismatch, handover::windows};
use impromptu_sim::{condition::Condition, flights::Loop, plant::Vehicle, trajectory::Trajectory};

use super::draw::Draw;

/// What the RMS error may be: this many times the baseline's, without and with delay added, and so much more, m.
const FACTORS: [f64; 2] = [1.1, 1.5];
const MORE: f64 = 0.01;
/// Seconds over which errors are compared.
const WINDOW: f64 = 4.0;
/// The baseline is lost beyond this error and what is desired to change at once, m, or beyond this many times its RMS without
/// delay and so much more, m.
const LOST: f64 = 2.0;
const LOST_TIMES: f64 = 5.0;
const LOST_MORE: f64 = 0.5;

/// Files of the demo's models, by vehicle and condition.
pub(crate) struct Models(BTreeMap<(&'static str, &'static str), Vec<u8>>);

impl Models {
    pub(crate) fn of_the_demo() -> Self {
        let mut files = BTreeMap::new();
        for vehicle in ["crazyflie", "crazyflie-brushless"] {
            for condition in Condition::NAMES {
                let file = crate::demo::models().join(format!("{vehicle}-stock-{condition}-seed1.impromptu"));
                files.insert((vehicle, condition), std::fs::read(file).expect("the demo's model"));
            }
        }
        Self(files)
    }
}

/// What came of a draw.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Verdict {
    /// The baseline is lost.
    pub(crate) lost: bool,
    /// Largest RMS error over four seconds, less what it may be more, over the baseline's,
    pub(crate) ratio: f64,
    /// where those begin, s,
    pub(crate) at: f64,
    /// and what it may be.
    allowed: f64,
}

impl Verdict {
    pub(crate) fn worse(&self) -> bool {
        !self.lost && (self.ratio > self.allowed || self.ratio.is_nan())
    }
}

/// Flies and judges each draw, on every processor.
pub(crate) fn verdicts(models: &Models, draws: &[Draw]) -> Vec<Verdict> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(vec![Verdict::default(); draws.len()]));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(draw) = draws.get(index) else { return };
            let verdict = judge(models, draw);
            found.lock().expect("nobody panics with it")[index] = verdict;
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from).min(draws.len()) {
            scope.spawn(work);
        }
    });
    found.into_inner().expect("nobody panics with it")
}

fn judge(models: &Models, draw: &Draw) -> Verdict {
    let model = Model::from_bytes(&models.0[&(draw.vehicle, draw.condition)]).expect("a model");
    let condition = Condition::named(draw.condition).expect("a condition");
    let closed_loop = Loop::new(Vehicle::named(draw.vehicle).expect("a vehicle"), "stock", condition).expect("a loop");
    let closed_loop = change(draw).applied(&closed_loop);
    let rate_hz = closed_loop.rate_hz();
    let trajectory = draw.desired.trajectory(rate_hz, draw.direction);
    let flown = closed_loop.delayed(draw.delay_ms * 1e-3);
    let baseline = squares(&flown, draw, None, &trajectory);
    let peak = baseline.iter().copied().fold(0.0, f64::max).sqrt();
    let lost = peak > LOST + draw.desired.jump()
        || draw.delay_ms > 0.0 && {
            let undelayed = squares(&closed_loop, draw, None, &trajectory);
            peak > LOST_TIMES * (undelayed.iter().sum::<f64>() / undelayed.len() as f64).sqrt() + LOST_MORE
        };
    if lost {
        return Verdict { lost, ..Verdict::default() };
    }
    let assisted = squares(&flown, draw, Some(&model), &trajectory);
    let ticks = (WINDOW * rate_hz) as usize;
    let preview = model.card().preview_span().1 as usize;
    let [baseline, assisted] = [baseline, assisted].map(|squares| windows(&squares, ticks));
    let mut verdict = Verdict { allowed: FACTORS[usize::from(draw.delay_ms > 0.0)], ..Verdict::default() };
    for (tick, error) in assisted.iter().enumerate() {
        let later = baseline.get(tick + preview).copied().unwrap_or(0.0);
        let ratio = (error - MORE) / baseline[tick].max(later).max(1e-9);
        if ratio > verdict.ratio || ratio.is_nan() {
            (verdict.ratio, verdict.at) = (ratio, tick as f64 / rate_hz);
        }
    }
    verdict
}

/// How the vehicle, its loop and what they are told differ in a draw.
fn change(draw: &Draw) -> Change {
    let mismatch = Mismatch {
        thrust: draw.thrust,
        drag: draw.drag,
        wind: draw.wind,
        wind_direction: draw.direction + 1.0,
        ..Mismatch::NONE
    };
    Change { mismatch, gains: draw.gains, noise: draw.noise, fault: draw.fault, direction: draw.direction }
}

/// Squared error at each reference tick, m².
fn squares(closed_loop: &Loop, draw: &Draw, model: Option<&Model<'_>>, trajectory: &Trajectory) -> Vec<f64> {
    change(draw).fly(closed_loop, model, trajectory, draw.number.into()).expect("a flight").squared_errors()
}
