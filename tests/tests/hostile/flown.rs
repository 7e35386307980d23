//! How a draw is flown and judged.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use impromptu_firmware::{learning::Parts, model::Model};
use impromptu_flight::learning::FlightLearning;
use impromptu_reproduction::robustness::{Change, Mismatch, handover::windows};
use impromptu_sim::{
    condition::Condition,
    flights::{Loop, Response},
    learned::{LearningLoop, taught, teaching},
    plant::Vehicle,
    trajectory::Trajectory,
};

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

/// Seed of what teaches.
const TAUGHT: u64 = 9;

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

/// What a minute of strokes taught, by vehicle and condition.
pub(crate) struct Taught(BTreeMap<(&'static str, &'static str), FlightLearning>);

impl Taught {
    /// Nothing.
    pub(crate) fn nothing() -> Self {
        Self(BTreeMap::new())
    }

    pub(crate) fn of_a_minute() -> Self {
        let mut all = BTreeMap::new();
        for vehicle in ["crazyflie", "crazyflie-brushless"] {
            for condition in Condition::NAMES {
                let closed_loop = stock(vehicle, condition);
                let (parts, response) = (Parts::BOTH, Response::Commissioned);
                let learned = LearningLoop { closed_loop: &closed_loop, model: None, parts, response, seed: TAUGHT };
                let strokes = teaching(TAUGHT, 60, 1.0, closed_loop.rate_hz()).expect("strokes");
                all.insert((vehicle, condition), taught(&learned, 60, &strokes).expect("flights").0);
            }
        }
        Self(all)
    }
}

fn stock(vehicle: &str, condition: &str) -> Loop {
    let condition = Condition::named(condition).expect("a condition");
    Loop::new(Vehicle::named(vehicle).expect("a vehicle"), "stock", condition).expect("a loop")
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
pub(crate) fn verdicts(models: &Models, taught: &Taught, draws: &[Draw]) -> Vec<Verdict> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(vec![Verdict::default(); draws.len()]));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(draw) = draws.get(index) else { return };
            let verdict = judge(models, taught, draw);
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

fn judge(models: &Models, taught: &Taught, draw: &Draw) -> Verdict {
    let model = Model::from_bytes(&models.0[&(draw.vehicle, draw.condition)]).expect("a model");
    let closed_loop = change(draw).applied(&stock(draw.vehicle, draw.condition));
    let rate_hz = closed_loop.rate_hz();
    let trajectory = draw.desired.trajectory(rate_hz, draw.direction);
    let flown = closed_loop.delayed(draw.delay_ms * 1e-3);
    let baseline = squares(&flown, draw, None, None, &trajectory);
    let peak = baseline.iter().copied().fold(0.0, f64::max).sqrt();
    let lost = peak > LOST + draw.desired.jump()
        || draw.delay_ms > 0.0 && {
            let undelayed = squares(&closed_loop, draw, None, None, &trajectory);
            peak > LOST_TIMES * (undelayed.iter().sum::<f64>() / undelayed.len() as f64).sqrt() + LOST_MORE
        };
    if lost {
        return Verdict { lost, ..Verdict::default() };
    }
    let mut learning = taught.0.get(&(draw.vehicle, draw.condition)).cloned();
    let flown_model = learning.is_none().then_some(&model);
    let assisted = squares(&flown, draw, flown_model, learning.as_mut(), &trajectory);
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
fn squares(
    closed_loop: &Loop,
    draw: &Draw,
    model: Option<&Model<'_>>,
    learning: Option<&mut FlightLearning>,
    trajectory: &Trajectory,
) -> Vec<f64> {
    let flown = change(draw).fly_learning(closed_loop, model, learning, trajectory, draw.number.into());
    flown.expect("a flight").squared_errors()
}
