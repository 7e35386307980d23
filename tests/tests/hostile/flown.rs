//! How a draw is flown and judged.

use std::{
    collections::BTreeMap,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use impromptu_firmware::{adapter::Lanes, guard::Trips, model::Model, network::Scratch};
use impromptu_flight::{
    flight::{Flight, PREVIEW},
    types::{MotorCommand, Reference, Setpoint, State, Tick},
};
use impromptu_reproduction::robustness::Mismatch;
use impromptu_sim::{
    condition::Condition,
    flights::Loop,
    plant::Vehicle,
    rollout::{FaultyFlight, FlightPlan, FlightStack, fly_on},
    trajectory::Trajectory,
};
use nalgebra::Vector3;

use super::draw::{Draw, Fault};

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
    let closed_loop = closed_loop(draw);
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

fn closed_loop(draw: &Draw) -> Loop {
    let condition = Condition::named(draw.condition).expect("a condition");
    let mut closed_loop = Loop::new(Vehicle::named(draw.vehicle).expect("a vehicle"), "stock", condition).expect("a loop");
    let gains = &mut closed_loop.settings.position;
    // With the damping that it had.
    gains.kp = gains.kp.map(|gain| gain * draw.gains as f32);
    gains.kd = gains.kd.map(|gain| gain * (draw.gains as f32).sqrt());
    let noise = &mut closed_loop.condition.noise;
    for sigma in [&mut noise.position, &mut noise.velocity, &mut noise.attitude, &mut noise.body_rates] {
        *sigma *= draw.noise;
    }
    let wind_direction = draw.direction + 1.0;
    Mismatch { thrust: draw.thrust, drag: draw.drag, wind: draw.wind, wind_direction, ..Mismatch::NONE }.applied(&closed_loop)
}

/// Root mean square over each `ticks` ticks.
fn windows(squares: &[f64], ticks: usize) -> Vec<f64> {
    squares.windows(ticks.min(squares.len())).map(|window| (window.iter().sum::<f64>() / window.len() as f64).sqrt()).collect()
}

/// Squared error at each reference tick, m².
fn squares(closed_loop: &Loop, draw: &Draw, model: Option<&Model<'_>>, trajectory: &Trajectory) -> Vec<f64> {
    let settings = &closed_loop.settings;
    let mut flight = Flight::new(settings).expect("a vehicle's settings");
    if let Some(model) = model {
        flight.attach(model, Lanes::BOTH).expect("a model for this loop");
    }
    let delay = closed_loop.condition.command_delay_ticks(settings.rates.control_hz.into());
    let stack = Stack {
        inside: FaultyFlight::new(flight, 1.0, delay),
        scratch: Scratch::new(),
        fault: draw.fault,
        direction: draw.direction,
        control_hz: settings.rates.control_hz.into(),
        period: 1.0 / closed_loop.rate_hz(),
        seconds: 0.0,
        held: None,
    };
    let plan = FlightPlan { log: true, ..FlightPlan::new(trajectory, draw.number.into()) };
    let record = fly_on(stack, &closed_loop.vehicle, settings, &closed_loop.condition, &plan).expect("a flight");
    let square = |row: &impromptu_sim::flight_log::LogRow| {
        let position = row.true_position.unwrap_or(row.measured_position);
        (0..3).map(|axis| (row.desired.position[axis] - position[axis]).powi(2)).sum::<f64>()
    };
    record.log.expect("a log").rows.iter().map(square).collect()
}

/// A flight stack to which faults happen.
struct Stack<'m> {
    inside: FaultyFlight<'m>,
    scratch: Scratch,
    fault: Fault,
    direction: f64,
    control_hz: f64,
    /// Of the references, s.
    period: f64,
    /// Time of flight, s.
    seconds: f64,
    /// Position that stands still.
    held: Option<Vector3<f32>>,
}

impl FlightStack for Stack<'_> {
    fn push_setpoint(&mut self, setpoint: &Setpoint) {
        let starved = match self.fault {
            Fault::Starved { at, seconds } => (at..at + seconds).contains(&self.seconds),
            _ => false,
        };
        if !starved {
            self.inside.flight.push_setpoint(setpoint);
        }
    }

    fn next_setpoint(&self) -> i32 {
        self.inside.flight.next_setpoint()
    }

    fn set_dither(&mut self, offset: Vector3<f32>) {
        self.inside.flight.set_dither(offset);
    }

    fn step(&mut self, tick: Tick, state: &State) -> MotorCommand {
        self.seconds = f64::from(tick.0) / self.control_hz;
        let mut told = *state;
        match self.fault {
            Fault::Frozen { at, seconds } if (at..at + seconds).contains(&self.seconds) => {
                told.position = *self.held.get_or_insert(state.position);
            }
            Fault::Jumps { size, each } if self.seconds.rem_euclid(each) < self.period => {
                told.position += Vector3::new(self.direction.cos(), self.direction.sin(), 0.0).map(|part| (size * part) as f32);
            }
            _ => {}
        }
        self.inside.step(tick, &told, &mut self.scratch)
    }

    fn reference(&self) -> &Reference {
        self.inside.flight.reference()
    }

    fn trips(&mut self) -> Trips {
        self.inside.flight.adapter().map(|adapter| adapter.trips()).unwrap_or_default()
    }
}

// A draw starves for less than what is stored ahead.
const _: () = assert!(PREVIEW > 80);
