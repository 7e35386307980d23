//! Hosts that are clumsy or hostile, at the end of the vehicle's line.
//!
//! *in* commands as bytes; *out* what the motors and reports of the application are; *never* motors that turn without news, a
//! report that cannot be decoded, or a refused message that changed something.

mod learning;
mod random;

use std::vec::Vec;

use impromptu_firmware::adapter::{Job, Lanes};

use super::*;
use crate::{
    link::{
        Reports,
        message::{Inertial, InputReport, LearnOrder, Position, TimedSetpoint},
    },
    settings::{
        Setting, Settings,
        tests::{GOOD, numbers},
    },
    types::{MotorCommand, Reference},
};

/// Control ticks behind the one with the last news in which the motors still turn.
const SILENCE: usize = 124;

/// A vehicle and its host. Heights are 1.5 m, where the vehicle always is.
struct Line<L = NoLearner> {
    application: Application<'static, L>,
    sender: Sender,
    reports: Receiver<Reports>,
    heard: Vec<String>,
    outcomes: Vec<Outcome>,
    inputs: InputReport,
    tick: u32,
    /// What the host stamps its first tick with.
    epoch: u32,
}

fn inertial(tick: u32) -> Command<'static> {
    Command::Inertial(Inertial { tick, attitude: [1.0, 0.0, 0.0, 0.0], rates: [0.0; 3] })
}

fn position(tick: u32) -> Command<'static> {
    Command::Position(Position { tick, position: [0.0, 0.0, 1.5], velocity: [0.0; 3], vertical_acceleration: 0.0 })
}

fn timed(tick: i32, x: f32, vx: f32) -> TimedSetpoint {
    TimedSetpoint { tick, position: [x, 0.0, 1.5], velocity: [vx, 0.0, 0.0], acceleration: [0.0; 3], yaw: 0.0 }
}

fn setpoint(tick: i32) -> Command<'static> {
    Command::Setpoint(timed(tick, 0.0, 0.0))
}

impl Line {
    /// A vehicle with its board's settings.
    fn new() -> Self {
        Self::with(Application::new())
    }

    /// Armed, with `setpoints` of a trajectory.
    fn armed(setpoints: impl IntoIterator<Item = Command<'static>>) -> Self {
        Self::new().arm(setpoints)
    }
}

impl<L: Learns> Line<L> {
    fn with(mut application: Application<'static, L>) -> Self {
        application.autopilot().configure(&GOOD).unwrap();
        let (sender, reports) = (Sender::new(), Receiver::new());
        Self { application, sender, reports, heard: vec![], outcomes: vec![], inputs: InputReport::default(), tick: 0, epoch: 2 }
    }

    fn arm(self, setpoints: impl IntoIterator<Item = Command<'static>>) -> Self {
        let mut line = self;
        for command in [Command::Hello].into_iter().chain(setpoints).chain([inertial(1), position(1), Command::Arm]) {
            line.say(&command);
        }
        assert_eq!(line.outcomes, [Outcome::Done]);
        line
    }

    fn say(&mut self, command: &Command<'_>) {
        let mut frame = [0; FRAME];
        for byte in self.sender.encode(command, &mut frame).unwrap().1 {
            self.application.on_byte(*byte);
        }
        self.hear();
    }

    fn hear(&mut self) {
        let bytes = self.application.outbox().to_vec();
        self.application.sent();
        for byte in bytes {
            if let Some(report) = self.reports.push(byte) {
                let report = report.expect("every report can be decoded").message;
                match report {
                    Report::Acknowledge { outcome, .. } => self.outcomes.push(outcome),
                    Report::Inputs(inputs) => self.inputs = inputs,
                    _ => {}
                }
                self.heard.push(format!("{report:?}"));
            }
        }
    }

    fn step(&mut self) -> (MotorCommand, Reference) {
        let mut job = Job::EMPTY;
        let (command, _) = self.application.step(&Meters::default(), &mut job);
        self.hear();
        self.tick += 1;
        (command, *self.application.autopilot().reference())
    }

    /// A tick with news.
    fn fly(&mut self) -> (MotorCommand, Reference) {
        let stamp = self.epoch.wrapping_add(self.tick);
        self.say(&inertial(stamp));
        if self.tick.is_multiple_of(5) {
            self.say(&position(stamp));
        }
        self.step()
    }

    /// Ticks until the motors are off, in silence.
    fn silent(&mut self) -> usize {
        (0..100_000).position(|_| self.step().0 == MotorCommand::OFF).unwrap()
    }
}

fn hover() -> impl Iterator<Item = Command<'static>> {
    (0..150).map(setpoint)
}

#[test]
fn settings_that_no_vehicle_has_are_refused_by_name_and_change_nothing() {
    type Change = fn(&mut Settings);
    let cases: [(Change, Setting); 10] = [
        (|s| s.rates.control_hz = 1e9, Setting::ControlRate),
        (|s| s.rates.control_hz = 5000.0, Setting::ControlRate),
        (|s| s.rates.control_hz = -500.0, Setting::ControlRate),
        (|s| s.rates.control_hz = 0.0, Setting::ControlRate),
        (|s| s.rates.control_hz = 1e-30, Setting::ControlRate),
        (|s| s.airframe.mass = -1.0, Setting::Mass),
        (|s| s.attitude.kp = -544.0, Setting::AttitudeKp),
        (|s| s.position.kp = [1e38; 3], Setting::PositionKp),
        (|s| s.rates.position_divisor = u32::MAX, Setting::PositionDivisor),
        (|s| s.rates.position_divisor = 0, Setting::PositionDivisor),
    ];
    for (change, what) in cases {
        let mut settings = GOOD;
        change(&mut settings);
        // Others that are well would act if the rest of the message were taken.
        settings.position.ki = [3.0; 3];
        settings.position.integral_limit = 2.0;
        let (mut told, mut other) = (Line::new(), Line::armed(hover()));
        for command in [Command::Settings(settings)].into_iter().chain(hover()).chain([inertial(1), position(1), Command::Arm]) {
            told.say(&command);
        }
        assert_eq!(told.outcomes, [Outcome::Refused(Reason::Setting { what }), Outcome::Done]);
        for _ in 0..30 {
            assert_eq!(told.fly(), other.fly(), "{what:?}");
        }
        assert_eq!(told.silent(), SILENCE);
    }
    // Armed: nothing at all.
    let mut line = Line::armed(hover());
    line.say(&Command::Settings(GOOD));
    assert_eq!(line.outcomes.last(), Some(&Outcome::Refused(Reason::Armed)));
}

#[test]
fn a_stamp_from_the_future_costs_itself_alone() {
    for ahead in [200, 1000, u32::MAX / 2 - 10, u32::MAX / 2 + 10] {
        let (mut line, mut other) = (Line::armed(hover()), Line::armed(hover()));
        for tick in 0..400 {
            if tick == 100 {
                line.say(&inertial(tick + ahead));
                line.say(&position(tick + ahead));
            }
            assert_eq!(line.fly(), other.fly(), "{ahead} ahead, tick {tick}");
        }
        assert!(line.application.autopilot().armed());
        assert_eq!(line.inputs.refused, if ahead < u32::MAX / 2 { 2 } else { 0 }, "counted");
    }
}

#[test]
fn a_host_that_starts_again_in_flight_is_heard_and_flies_nothing_old() {
    let mut line = Line::armed(hover());
    for _ in 0..100 {
        line.fly();
    }
    // Everything that a host says at its start, in flight: the sequence and the stamps begin anew.
    line.sender = Sender::new();
    line.epoch = 0u32.wrapping_sub(line.tick);
    let before = line.application.autopilot().inputs();
    line.say(&Command::Hello);
    for tick in 0..30 {
        line.say(&Command::Setpoint(timed(tick, 5.0, 0.0)));
    }
    line.say(&Command::Arm);
    assert_eq!(line.outcomes.last(), Some(&Outcome::Refused(Reason::Armed)), "no second flight");
    assert_eq!(line.application.autopilot().inputs().reach, before.reach, "no old setpoint is flown");
    for _ in 0..600 {
        let (command, reference) = line.fly();
        assert!(command != MotorCommand::OFF && reference.position.x == 0.0);
    }
    assert!(line.application.autopilot().armed(), "heard again before the motors go off");
    line.say(&setpoint(-500));
    assert!(matches!(line.outcomes.last(), Some(Outcome::Refused(Reason::Setpoint { expected: 150 }))), "told where to go on");
    assert_eq!(line.silent(), SILENCE);
}

#[test]
fn what_no_vehicle_measures_is_one_missed_sample() {
    let (mut line, mut other) = (Line::armed(hover()), Line::armed(hover()));
    for tick in 0..1000u32 {
        if tick == 100 {
            let far = Position { tick: 102, position: [3e19, 0.0, 1.5], velocity: [0.0; 3], vertical_acceleration: 0.0 };
            line.say(&Command::Position(far));
            line.say(&Command::Inertial(Inertial { tick: 102, attitude: [1.0, 0.0, 0.0, 0.0], rates: [3e38; 3] }));
            line.say(&Command::Setpoint(TimedSetpoint { position: [-3.3e38, 0.0, 0.0], ..timed(150, 0.0, 0.0) }));
        }
        assert_eq!(line.fly(), other.fly());
    }
    let telemetry = line.heard.iter().filter(|text| text.starts_with("Telemetry")).count();
    assert_eq!(telemetry, 20);
    assert!(line.heard.iter().rev().any(|text| text.contains("damaged: 3")), "counted");
}

#[test]
fn a_lost_setpoint_is_filled_the_shortest_way_round() {
    let yaw = |tick: i32| crate::motion::turn(3.0 + 0.01 * tick as f32);
    let all = (0..90).map(|tick| TimedSetpoint { yaw: yaw(tick), ..timed(tick, 0.0, 0.0) });
    let mut line = Line::armed(all.filter(|timed| !(10..18).contains(&timed.tick)).map(Command::Setpoint));
    for tick in 0..200 {
        let (_, reference) = line.fly();
        assert!(crate::motion::turn(reference.yaw - yaw(tick / 5)).abs() < 0.02, "tick {tick}: {}", reference.yaw);
    }
}

/// Flies and judges how far the reference moves from one reference tick to the next.
fn smooth(line: &mut Line, ticks: u32, most: f32, mut each: impl FnMut(&mut Line, i32)) -> Reference {
    let mut before = line.fly().1;
    for _ in 0..ticks {
        let now = (line.tick / 5) as i32;
        if line.tick.is_multiple_of(5) {
            each(line, now);
        }
        let reference = line.fly().1;
        let moved = (reference.position - before.position).norm();
        assert!(moved <= most, "tick {}: {moved} m", line.tick);
        before = reference;
    }
    before
}

#[test]
fn setpoints_that_starve_in_motion_and_resume_are_approached() {
    // 2 m/s; for 2 s nothing comes, so that the trajectory is 4 m ahead when it comes again.
    let moving = |tick: i32| Command::Setpoint(timed(tick, 0.02 * tick as f32, 2.0));
    for ahead in [1, 10, 90] {
        let mut line = Line::armed((0..100).map(moving));
        let last = smooth(&mut line, 5000, 0.08, |line, now| {
            if now > 300 {
                line.say(&moving(now + ahead));
            }
        });
        assert!((last.position.x - 0.02 * 1000.0).abs() < 0.05, "{last:?}");
    }
}

#[test]
fn a_replan_replaces_what_is_stored_without_a_jump() {
    let mut line = Line::armed((0..190).map(|tick| Command::Setpoint(timed(tick, 0.01 * tick as f32, 1.0))));
    let last = smooth(&mut line, 2000, 0.06, |line, now| match now {
        ..50 => {}
        50 => {
            line.say(&Command::Replan(timed(49, 0.0, 0.0)));
            assert_eq!(line.outcomes.last(), Some(&Outcome::Refused(Reason::Setpoint { expected: 50 })), "that is flown");
            line.say(&Command::Replan(timed(60, -2.0, 0.0)));
            assert_eq!(line.outcomes.last(), Some(&Outcome::Done));
        }
        _ => line.say(&Command::Setpoint(timed(now + 10, -2.0, 0.0))),
    });
    assert_eq!(last.position.x, -2.0);
}

#[test]
fn a_brake_comes_to_rest_and_stays_until_a_replan() {
    let mut line = Line::armed((0..190).map(|tick| Command::Setpoint(timed(tick, 0.02 * tick as f32, 2.0))));
    let last = smooth(&mut line, 2000, 0.021, |line, now| {
        if now == 50 {
            line.say(&Command::Brake);
            assert_eq!(line.outcomes.last(), Some(&Outcome::Done));
        }
        if now > 50 && now % 20 == 0 {
            line.say(&Command::Setpoint(timed(now + 90, 9.0, 0.0)));
            assert_eq!(line.outcomes.last(), Some(&Outcome::Refused(Reason::Braking)));
        }
    });
    // From 1 m at 2 m/s within 3 m/s² and 8 m/s³: 1.5 s by the cubic.
    assert!(last.velocity.norm() == 0.0 && (2.3..2.9).contains(&last.position.x), "{last:?}");
    assert!(line.inputs.braking && line.inputs.reach > 90);
    let first = (line.tick / 5) as i32 + 5;
    line.say(&Command::Replan(timed(first, 0.0, 0.0)));
    let last = smooth(&mut line, 2500, 0.05, |line, now| line.say(&Command::Setpoint(timed(now + 6, 0.0, 0.0))));
    assert!(last.position.x.abs() < 1e-6 && !line.inputs.braking, "{last:?}");
    let mut disarmed = Line::new();
    disarmed.say(&Command::Brake);
    assert_eq!(disarmed.outcomes, [Outcome::Refused(Reason::NotArmed)]);
}
