//! Machines that are no quadrotor, simulated: a servo, a gantry with a resonance, a gimbal, an arm of six axes.
//!
//! *in* a machine, trajectories, a seed; *out* logs, and errors with and without a model; *never* a response that the simulator
//! hands over: what is known of a machine are its description and its logs; *source* drives with friction behind a position loop
//! of PD; two masses on a spring as in Spong 1987; the arm's axes have gravity and pull at their neighbours.

mod plant;

use std::f64::consts::TAU;

use impromptu_firmware::{
    Lanes,
    model::{LargestModel, MAX_CHANNELS, Refusal},
};
use impromptu_model_export::description::Signals;
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use plant::Plant;

use crate::{
    description::{AxisDescription, Fresh, FreshKind, LoopDescription},
    layout::{Layout, TooManyChannels, write},
    reading::{AxisLog, AxisSignals, slope},
    replay::{HostAddOn, host_add_on},
};

/// A machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// One axis with friction, 100 Hz.
    Servo,
    /// Two axes, each of which carries its load by a spring that swings with 4 Hz, 100 Hz.
    Gantry,
    /// Three quick axes, 200 Hz.
    Gimbal,
    /// Six axes with gravity, friction and pulls at their neighbours, 125 Hz.
    Arm,
    /// One axis, drawn from a seed: 50 to 200 Hz, a position loop of 2 to 20 rad/s with a damping of 0.5 to 1.2, a spring in
    /// every third, friction, gravity, dead time, disturbance and noise of any size.
    Drawn(u64),
}

/// Steps of the simulation in a tick.
const STEPS: usize = 10;
/// Time between new signs of a dither, time constants.
const HOLD: f64 = 0.1;

impl Machine {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Servo, Self::Gantry, Self::Gimbal, Self::Arm];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Servo => "servo",
            Self::Gantry => "gantry",
            Self::Gimbal => "gimbal",
            Self::Arm => "arm",
            Self::Drawn(_) => "drawn",
        }
    }

    /// The machine of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|machine| machine.name() == name)
    }

    fn plant(self) -> Plant {
        match self {
            Self::Servo => Plant::servo(),
            Self::Gantry => Plant::gantry(),
            Self::Gimbal => Plant::gimbal(),
            Self::Arm => Plant::arm(),
            Self::Drawn(seed) => Plant::drawn(seed),
        }
    }

    /// What its owner would write of it. Its drive's acceleration is logged, which tells the age of what is measured.
    pub fn description(self) -> LoopDescription {
        let plant = self.plant();
        let axes = plant.axes.iter().map(|name| AxisDescription {
            frame: "its base".into(),
            desired: Some(format!("{name}_desired")),
            velocity: Some(format!("{name}_velocity")),
            fresh: Some(Fresh { column: format!("{name}_acceleration"), kind: FreshKind::Acceleration }),
            cap: Some(plant.far),
            cap_rate: Some(40.0 * plant.far),
            ..AxisDescription::new(name, plant.unit, format!("{name}_reference"), format!("{name}_measured"))
        });
        let axes = axes.collect();
        LoopDescription { name: self.name().into(), time: "time_s".into(), rate_hz: Some(plant.rate_hz), age_ms: None, axes }
    }
}

/// A machine that runs: of each axis load and drive.
struct Running {
    plant: Plant,
    random: Xoshiro256PlusPlus,
    /// Position and velocity of the load, then of the drive.
    state: Vec<[f64; 4]>,
    accelerations: Vec<f64>,
    disturbances: Vec<f64>,
    /// References on their way, and measurements.
    told: Vec<Vec<f64>>,
    seen: Vec<Vec<[f64; 2]>>,
}

impl Running {
    fn new(machine: Machine, seed: u64) -> Self {
        let plant = machine.plant();
        let axes = plant.axes.len();
        let step = 1.0 / (plant.rate_hz * STEPS as f64);
        let (dead, age) = ((plant.dead_s / step).round() as usize, (plant.age_s / step).round() as usize);
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            state: vec![[0.0; 4]; axes],
            accelerations: vec![0.0; axes],
            disturbances: vec![0.0; axes],
            told: vec![vec![0.0; dead + 1]; axes],
            seen: vec![vec![[0.0; 2]; age + 1]; axes],
            plant,
        }
    }

    fn normal(&mut self) -> f64 {
        self.random.sample(StandardNormal)
    }

    /// Position and velocity of each axis as the loop is told.
    fn measured(&mut self) -> Vec<[f64; 2]> {
        let noise = self.plant.noise;
        (0..self.state.len())
            .map(|axis| {
                let [position, velocity] = self.seen[axis][self.seen[axis].len() - 1];
                [position + noise[0] * self.normal(), velocity + noise[1] * self.normal()]
            })
            .collect()
    }

    /// A tick towards references.
    fn run(&mut self, references: &[f64]) {
        let h = 1.0 / (self.plant.rate_hz * STEPS as f64);
        let Plant { frequency, damping, spring_hz, friction, gravity, pull, far, .. } = self.plant;
        let disturbance = self.plant.disturbance * far * frequency * frequency;
        for _ in 0..STEPS {
            let before = self.accelerations.clone();
            for (axis, reference) in references.iter().enumerate() {
                let draw = self.normal();
                self.disturbances[axis] += -h / 0.4 * self.disturbances[axis] + disturbance * (2.0 * h / 0.4).sqrt() * draw;
                self.told[axis].rotate_right(1);
                self.told[axis][0] = *reference;
                let told = self.told[axis][self.told[axis].len() - 1];
                let [mut position, mut velocity, mut drive, mut drive_velocity] = self.state[axis];
                let (at, speed) = if spring_hz > 0.0 { (drive, drive_velocity) } else { (position, velocity) };
                let neighbours =
                    [axis.checked_sub(1), Some(axis + 1)].into_iter().flatten().filter_map(|other| before.get(other));
                let outside = self.disturbances[axis] - gravity * (at + 0.3).sin() + pull * neighbours.sum::<f64>();
                let push =
                    frequency * frequency * (told - at) - 2.0 * damping * frequency * speed - friction * (speed / 0.02).tanh();
                let acceleration = if spring_hz > 0.0 {
                    let stiffness = (TAU * spring_hz).powi(2);
                    let coupling = stiffness * (drive - position) + 0.1 * TAU * spring_hz * (drive_velocity - velocity);
                    drive_velocity += h * (push - 0.3 * coupling);
                    drive += h * drive_velocity;
                    coupling + outside
                } else {
                    push + outside
                };
                velocity += h * acceleration;
                position += h * velocity;
                self.state[axis] = [position, velocity, drive, drive_velocity];
                self.accelerations[axis] = acceleration;
                self.seen[axis].rotate_right(1);
                self.seen[axis][0] = [position, velocity];
            }
        }
    }
}

/// Desired positions of each axis, `[axis][tick]`: sums of five tones, from rest.
pub fn motion(machine: Machine, seconds: f64, seed: u64) -> Vec<Vec<f64>> {
    let plant = machine.plant();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let ticks = (seconds * plant.rate_hz) as usize;
    let of_axis = |_: &&str| {
        let tones: Vec<[f64; 3]> = (0..5)
            .map(|_| {
                let hz = random.random_range((0.08 * plant.fastest_hz).ln()..plant.fastest_hz.ln()).exp();
                [hz, random.random_range(0.3..1.0) / hz, random.random_range(0.0..TAU)]
            })
            .collect();
        let at = |t: f64| tones.iter().map(|[hz, size, phase]| size * (TAU * hz * t + phase).sin()).sum::<f64>();
        let ramp = |t: f64| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
        let time = |tick: usize| tick as f64 / plant.rate_hz;
        let values: Vec<f64> = (0..ticks).map(time).map(|t| (at(t) - at(0.0)) * ramp(t) * ramp(seconds - t)).collect();
        let most = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        values.iter().map(|value| plant.far * value / most.max(1e-9)).collect()
    };
    plant.axes.iter().map(of_axis).collect()
}

/// A log of each axis along a motion, with dither or without.
pub fn logged(machine: Machine, desired: &[Vec<f64>], dithered: bool, seed: u64) -> Vec<AxisLog> {
    let mut running = Running::new(machine, seed);
    let (rate_hz, size) = (running.plant.rate_hz, if dithered { running.plant.dither } else { 0.0 });
    let hold = ((HOLD * rate_hz * 2.0 / running.plant.frequency * 3.0).ceil() as usize).max(1);
    let mut signs = vec![1.0; desired.len()];
    let mut logs: Vec<AxisSignals> = desired
        .iter()
        .map(|desired| AxisSignals {
            base: desired.clone(),
            desired: desired.clone(),
            desired_velocity: slope(desired, rate_hz),
            reference_velocity: vec![0.0; desired.len()],
            fresh: Some(Vec::new()),
            ..AxisSignals::default()
        })
        .collect();
    for tick in 0..desired.first().map_or(0, Vec::len) {
        if tick % hold == 0 {
            signs.iter_mut().for_each(|sign| *sign = if running.random.random_bool(0.5) { 1.0 } else { -1.0 });
        }
        let measured = running.measured();
        let references: Vec<f64> = desired.iter().zip(&signs).map(|(desired, sign)| desired[tick] + size * sign).collect();
        for (axis, log) in logs.iter_mut().enumerate() {
            log.reference.push(references[axis]);
            log.measured.push(measured[axis][0]);
            log.velocity.push(measured[axis][1]);
            let noise = running.plant.disturbance * running.plant.far * running.plant.frequency.powi(2) * running.normal();
            let acceleration = running.accelerations[axis] + noise;
            log.fresh.get_or_insert_default().push(acceleration);
        }
        running.run(&references);
    }
    let log = |signals| AxisLog { file: machine.name().into(), rate_hz, signals, notes: Vec::new() };
    logs.into_iter().map(log).collect()
}

/// Why a model does not fly a machine.
#[derive(Debug, thiserror::Error)]
pub enum FlyError {
    /// It is refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// It is for another loop.
    #[error("the model is of `{0}`, whose signals this machine does not have: train one on this machine's logs")]
    Other(String),
    /// The machine has more channels than a model.
    #[error(transparent)]
    Channels(#[from] TooManyChannels),
}

/// RMS of the true error of each axis along a motion, with a model's lanes or without; its guard is on.
///
/// # Errors
/// If the model is for another loop.
pub fn flown(
    machine: Machine,
    desired: &[Vec<f64>],
    model: Option<(&LargestModel<'_>, Lanes)>,
    seed: u64,
) -> Result<Vec<f64>, FlyError> {
    let layout = Layout::of(&machine.description())?;
    if let Some((model, _)) = model
        && Signals::from(&model.card().signals) != layout.signals
    {
        return Err(FlyError::Other(model.card().provenance.vehicle.into()));
    }
    let mut running = Running::new(machine, seed);
    let velocities: Vec<Vec<f64>> = desired.iter().map(|desired| slope(desired, running.plant.rate_hz)).collect();
    let mut add_on: Option<(Box<HostAddOn<'_>>, i32)> = match model {
        Some((model, lanes)) => Some((host_add_on(model, running.plant.rate_hz, lanes)?, model.card().preview_span().1 as i32)),
        None => None,
    };
    let mut scratch = Box::new(impromptu_firmware::Scratch::<_>::new());
    let ticks = desired.first().map_or(0, Vec::len);
    let mut squares = vec![0.0; desired.len()];
    for tick in 0..ticks {
        for (axis, square) in squares.iter_mut().enumerate() {
            *square += (running.state[axis][0] - desired[axis][tick]).powi(2);
        }
        let measured = running.measured();
        let mut references: Vec<f64> = desired.iter().map(|desired| desired[tick]).collect();
        if let Some((add_on, ahead)) = &mut add_on {
            let mut channels = [0.0f32; MAX_CHANNELS];
            while add_on.next_tick() <= tick as i32 + *ahead {
                let at = (add_on.next_tick().max(0) as usize).min(ticks - 1);
                for (axis, of_axis) in layout.axes.iter().enumerate() {
                    write(&mut channels, &of_axis.desired, &[desired[axis][at], velocities[axis][at]]);
                }
                if add_on.push(channels).is_err() {
                    break;
                }
            }
            let mut told = [0.0f32; MAX_CHANNELS];
            for (of_axis, measured) in layout.axes.iter().zip(&measured) {
                write(&mut told, &of_axis.measured, measured);
            }
            let found = add_on.step(tick as i32, &told, &mut scratch);
            for (reference, of_axis) in references.iter_mut().zip(&layout.axes) {
                *reference = of_axis.reference[0].map_or(*reference, |channel| f64::from(found[usize::from(channel)]));
            }
        }
        running.run(&references);
    }
    Ok(squares.iter().map(|square| (square / ticks.max(1) as f64).sqrt()).collect())
}

#[cfg(test)]
mod tests;
