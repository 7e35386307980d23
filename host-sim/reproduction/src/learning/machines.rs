//! Loops that are no quadrotor: a servo with friction, an axis of two masses, and one that first goes the other way.
//!
//! *in* a machine and a seed; *out* errors of unseen motions without and with what is learned, each machine measured by its
//! own add-on before; *never* a response that the simulator hands over; *source* the servo of the pilot of learning in
//! flight; two masses on a spring as in Spong 1987, with its motor held by a PD; the zero in the right half plane of the
//! paper's third system.

use std::f64::consts::TAU;

use anyhow::{Context as _, ensure};
use impromptu_firmware::learning::{AHEAD, AxisSettings, LearningAddOn, Limits, Measured, Phase, Probe};
use impromptu_sim::learned::Flown;
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Ticks of the learner a second, and steps of the simulation within one.
const HZ: usize = 100;
const STEPS: usize = 10;
const H: f64 = 1.0 / (HZ * STEPS) as f64;
/// A motion, s, and how far it goes, rad.
const MOTION_S: usize = 18;
const FAR: f64 = 1.5;
/// Rest in which the response is measured, s.
const REST_S: usize = 25;
/// Motions that are not judged.
const FIRST: usize = 4;
/// Of the loop that first goes the other way, rad/s: natural frequency and zero.
const FREQUENCY: f64 = 6.0;
/// See [`FREQUENCY`].
const ZERO: f64 = 8.0;
/// Noise of angle and rate, rad and rad/s.
const NOISE: [f64; 2] = [1e-3, 1e-2];

/// What is moved; all are told angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// A servo: PD behind 20 ms, viscous and Coulomb friction.
    Servo,
    /// A motor with a PD drives a load by a spring that swings with 3 Hz and a damping of 0.05; the load is measured.
    TwoMass,
    /// A loop of 6 rad/s with a zero at +8 rad/s: it first goes the other way.
    NonMinimumPhase,
}

impl Machine {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Servo, Self::TwoMass, Self::NonMinimumPhase];

    /// Name in the JSON document, and of its loop.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::Servo => ["servo", "pd"],
            Self::TwoMass => ["two_mass", "pd"],
            Self::NonMinimumPhase => ["non_minimum_phase", "second_order"],
        }
    }

    /// Least mean and worst reduction, %.
    pub fn asked(self) -> Option<[f64; 2]> {
        (self == Self::Servo).then_some([95.0, 80.0])
    }
}

/// A machine that runs.
struct Running {
    machine: Machine,
    random: Xoshiro256PlusPlus,
    /// Angle and speed of what is measured, and of the motor that drives it.
    state: [f64; 4],
    disturbance: f64,
    line: [f64; 21],
}

impl Running {
    fn new(machine: Machine, seed: u64) -> Self {
        let random = Xoshiro256PlusPlus::seed_from_u64(seed);
        Self { machine, random, state: [0.0; 4], disturbance: 0.0, line: [0.0; 21] }
    }

    fn normal(&mut self) -> f64 {
        self.random.sample(StandardNormal)
    }

    fn angle(&self) -> f64 {
        self.output()[0]
    }

    /// What is measured, without noise.
    fn output(&self) -> [f64; 2] {
        let [angle, speed, ..] = self.state;
        match self.machine {
            Machine::Servo | Machine::TwoMass => [angle, speed],
            // y = x - x'/z, with x the output of the loop without the zero.
            Machine::NonMinimumPhase => [angle - speed / ZERO, speed - self.pull() / ZERO],
        }
    }

    /// Acceleration of the loop with the zero, without the zero, rad/s².
    fn pull(&self) -> f64 {
        let [angle, speed, ..] = self.state;
        FREQUENCY * FREQUENCY * (self.line[0] - angle) - 2.0 * 0.8 * FREQUENCY * speed
    }

    fn measured(&mut self) -> Measured {
        let [angle, rate] = self.output();
        let [of_angle, of_rate] = NOISE.map(|sigma| sigma * self.normal());
        Measured { value: (angle + of_angle) as f32, rate: Some((rate + of_rate) as f32) }
    }

    /// A tick towards a reference.
    fn run(&mut self, reference: f64) {
        for _ in 0..STEPS {
            self.line.rotate_right(1);
            self.line[0] = reference;
            self.disturbance += -H / 0.4 * self.disturbance + 0.5 * (2.0 * H / 0.4f64).sqrt() * self.normal();
            let (disturbance, told, pull) = (self.disturbance, self.line[20], self.pull());
            let [angle, speed, motor, motor_speed] = &mut self.state;
            match self.machine {
                Machine::Servo => {
                    let torque = (60.0 * (told - *angle) - 9.0 * *speed).clamp(-40.0, 40.0);
                    *speed += H * (torque - 2.0 * *speed - 1.5 * (*speed / 0.02).tanh() + disturbance);
                }
                Machine::TwoMass => {
                    // Motor and load weigh as much; the motor's loop has 15 rad/s.
                    let spring = (TAU * 3.0).powi(2);
                    let coupling = spring * (*motor - *angle) + 2.0 * 0.05 * TAU * 3.0 * (*motor_speed - *speed);
                    let torque = 225.0 * (told - *motor) - 24.0 * *motor_speed;
                    *motor_speed += H * (torque - coupling);
                    *motor += H * *motor_speed;
                    *speed += H * (coupling + disturbance);
                }
                Machine::NonMinimumPhase => *speed += H * (pull + disturbance),
            }
            *angle += H * *speed;
        }
    }
}

/// A sum of five sines of 0.1 to 1.2 Hz, from rest.
fn motion(seed: u64) -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let tones: Vec<[f64; 3]> = (0..5)
        .map(|_| {
            let hz = random.random_range(0.1f64.ln()..1.2f64.ln()).exp();
            [hz, random.random_range(0.3..1.0) / hz, random.random_range(0.0..TAU)]
        })
        .collect();
    let at = |t: f64| tones.iter().map(|[hz, size, phase]| size * (TAU * hz * t + phase).sin()).sum::<f64>();
    let ramp = |t: f64| t.min(1.0).powi(2) * (3.0 - 2.0 * t.min(1.0));
    let values: Vec<f64> = (0..MOTION_S * HZ).map(|tick| tick as f64 / HZ as f64).map(|t| (at(t) - at(0.0)) * ramp(t)).collect();
    let most = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    values.iter().map(|value| FAR * value / most).collect()
}

/// Root mean square of the error over a motion, rad; with an add-on it goes on learning.
fn flown(mut machine: Running, desired: &[f64], mut learns: Option<(&mut LearningAddOn<1>, &mut i32)>) -> f64 {
    let mut square = 0.0;
    if let Some((add_on, _)) = &mut learns {
        add_on.restart();
    }
    for (tick, target) in desired.iter().enumerate() {
        square += (machine.angle() - target).powi(2);
        let measured = machine.measured();
        let correction = match &mut learns {
            Some((add_on, now)) => {
                **now += 1;
                let (first, last) = (desired[0], desired[desired.len() - 1]);
                let start = **now - tick as i32;
                let at = |asked: i32| match usize::try_from(asked - start) {
                    Ok(index) => [desired.get(index).copied().unwrap_or(last) as f32],
                    Err(_) => [first as f32],
                };
                add_on.step(**now, at, &[Some(measured)], true)[0]
            }
            None => 0.0,
        };
        machine.run(target + f64::from(correction));
    }
    (square / desired.len() as f64).sqrt()
}

/// Motions one after another, each with what those before it taught, of a machine that measured its own response before; the
/// first four are not judged. Errors are in rad.
///
/// # Errors
/// If the response cannot be measured.
pub(super) fn learned(machine: Machine, motions: usize, seed: u64) -> anyhow::Result<Flown> {
    let axis = AxisSettings {
        response: None,
        limits: Limits { scale: 1.0, correction: 1.0, feedback: 0.3, rate: 40.0 },
        probe: Probe { size: 0.1, seconds: 6.0 },
    };
    let mut add_on = LearningAddOn::new(&[axis], HZ as f32, 0.0).context("settings that no loop has")?;
    let mut now = -AHEAD;
    add_on.commission();
    flown(Running::new(machine, seed ^ 0x5eed), &vec![0.0; REST_S * HZ], Some((&mut add_on, &mut now)));
    let progress = add_on.progress();
    ensure!(progress.phase == Phase::Learning, "{machine:?}: {progress:?}");
    let mut found = Flown { seconds: (REST_S + motions * MOTION_S) as f64, ..Flown::default() };
    for number in 0..motions as u64 {
        let desired = motion(seed.wrapping_add(number));
        let own = seed.wrapping_mul(31).wrapping_add(number);
        let baseline = flown(Running::new(machine, own), &desired, None);
        let error = flown(Running::new(machine, own), &desired, Some((&mut add_on, &mut now)));
        if number == 0 {
            found.first = Some(100.0 * (1.0 - error / baseline));
        }
        if number as usize >= FIRST {
            found.baseline.push(baseline);
            found.errors.push(error);
        }
    }
    found.forgotten = add_on.progress().forgotten.into();
    Ok(found)
}
