//! What is flown.
//!
//! *in* nothing; *out* the list of cases; *never* a case that knows what it will find; *source* the promises of learning in
//! flight.

use impromptu_firmware::learning::Parts;
use impromptu_sim::{
    condition::Condition,
    controller::Controller,
    flights::{Guessed, Loop, Response},
    plant::Vehicle,
    rollout::RolloutError,
};

use super::seconds::Seconds;
use crate::robustness::Mismatch;

/// What is known before anything is learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Nothing.
    Nothing,
    /// A model that was made for this loop.
    Same,
    /// A model that was made for a Crazyflie.
    OtherVehicle,
    /// A model that was made for the stock gains.
    OtherGains,
}

impl Start {
    /// Name in the JSON document.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Same => "same",
            Self::OtherVehicle => "other_vehicle",
            Self::OtherGains => "other_gains",
        }
    }
}

/// What is flown for a row.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Vehicle.
    pub vehicle: &'static str,
    /// Its loop.
    pub controller: Controller,
    /// Gains of its loop, if they are not the loop's own.
    pub gains: &'static str,
    /// Name of the air and the sensors.
    pub air: &'static str,
    /// What differs from what the model, if there is one, was made for; and in words.
    pub mismatch: Mismatch,
    /// See `mismatch`.
    pub what: &'static str,
    /// Steady wind along x, m/s.
    pub wind: f64,
    /// Factor on the speed.
    pub speed: f64,
    /// What is known.
    pub start: Start,
    /// How long is learned.
    pub seconds: Seconds,
    /// Learned parts.
    pub parts: Parts,
    /// How the response is known.
    pub response: Response,
    /// Vehicles that are drawn, each of which flies some of the strokes; 0: the one that is named.
    pub draws: u32,
    /// More delay in the loop once it has learned, s.
    pub then_later_s: f64,
    /// Least mean and worst reduction, %.
    pub asked: Option<[f64; 2]>,
}

/// Factors on the speed of the strokes at which the Crazyflie's loops have the errors that their C code has on other strokes:
/// 27.3 cm, 5.77 cm, 1.35 cm.
const PID_SPEED: f64 = 0.7;
/// See [`PID_SPEED`].
const MELLINGER_SPEED: f64 = 0.92;

/// A Crazyflie with its stock gains in `lab`, from nothing.
const PLAIN: Case = Case {
    vehicle: "crazyflie",
    controller: Controller::Se3,
    gains: "stock",
    air: "lab",
    mismatch: Mismatch::NONE,
    what: "",
    wind: 0.0,
    speed: 1.0,
    start: Start::Nothing,
    seconds: Seconds::FromFirstStroke,
    parts: Parts::BOTH,
    response: Response::Commissioned,
    draws: 0,
    then_later_s: 0.0,
    asked: None,
};

impl Case {
    /// Kind of the baseline loop.
    pub fn kind(&self) -> &'static str {
        self.controller.name()
    }

    /// Learned parts, as the JSON document names them.
    pub fn parts_name(&self) -> &'static str {
        match self.parts {
            Parts { preview: true, feedback: true } => "both",
            Parts { preview: true, .. } => "preview",
            Parts { feedback: true, .. } => "feedback",
            Parts::NONE => "none",
        }
    }

    /// What the flights meet, in words.
    pub fn condition(&self) -> String {
        let mut words = self.air.to_owned();
        if !self.what.is_empty() {
            words += &format!(", {}", self.what);
        }
        if self.then_later_s > 0.0 {
            words += &format!(", then +{:.0} ms", 1e3 * self.then_later_s);
        }
        words
    }

    /// Whether a picture shows its first minute: the row of each kind of loop that has a promise and begins with nothing.
    pub(super) fn in_a_picture(&self) -> bool {
        let plain = self.start == Start::Nothing && self.seconds == Seconds::FromFirstStroke && self.then_later_s == 0.0;
        plain && self.asked.is_some() && self.air == "lab" && self.gains == "stock"
    }

    /// Vehicle, loop and what the flights meet.
    pub(super) fn loop_name(&self) -> String {
        let gains = if self.controller == Controller::Se3 { self.gains } else { self.kind() };
        format!("{} {gains}, {}", self.vehicle, self.condition())
    }

    /// All of it in words.
    pub fn name(&self) -> String {
        format!("{}, {}", self.loop_name(), self.seconds.words())
    }

    /// The loop that is flown.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn closed_loop(&self) -> Result<Loop, RolloutError> {
        let mut flown = self.mismatch.applied(&named(self.vehicle, self.gains, self.air)?.flown_by(self.controller)?);
        flown.condition.weather.mean_wind[0] += self.wind;
        Ok(flown)
    }

    /// Name of the loop that the model was made for, and the loop; `None` without a model.
    pub fn made_for(&self) -> Option<Result<(String, Loop), RolloutError>> {
        let (vehicle, gains) = match self.start {
            Start::Nothing => return None,
            Start::Same => (self.vehicle, self.gains),
            Start::OtherVehicle => ("crazyflie", self.gains),
            Start::OtherGains => (self.vehicle, "stock"),
        };
        Some(named(vehicle, gains, self.air).map(|closed_loop| (format!("{vehicle} {gains} {}", self.air), closed_loop)))
    }
}

fn named(vehicle: &str, gains: &str, air: &str) -> Result<Loop, RolloutError> {
    let condition = Condition::named(air)
        .ok_or_else(|| RolloutError::Condition { name: air.into(), reason: "there is none of this name".into() })?;
    Loop::new(Vehicle::named(vehicle)?, gains, condition)
}

/// All that is flown.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    for (air, asked) in [("lab", Some([96.0, 92.0])), ("rough", None)] {
        all.push(Case { air, asked, ..PLAIN });
        all.push(Case { air, parts: Parts::PREVIEW, ..PLAIN });
        all.extend([0, 10, 30, 60, 180].map(|seconds| Case { air, seconds: Seconds::After(seconds), ..PLAIN }));
    }
    all.push(Case { then_later_s: 0.02, asked: Some([90.0, 84.0]), ..PLAIN });
    all.push(Case { gains: "soft", asked: Some([92.0, 80.0]), ..PLAIN });
    all.push(Case { vehicle: "crazyflie-brushless", ..PLAIN });
    all.push(Case { speed: 1.7, ..PLAIN });
    // The Crazyflie's own loops, at speeds at which their errors are those that were measured with its C code.
    for air in ["lab", "rough"] {
        let asked = Some(if air == "lab" { [97.5, 94.5] } else { [95.0, 91.0] });
        all.push(Case { controller: Controller::Pid, air, speed: PID_SPEED, asked, ..PLAIN });
    }
    // Each stroke is a first one.
    let first = Case { controller: Controller::Pid, speed: PID_SPEED, seconds: Seconds::After(0), ..PLAIN };
    all.push(Case { asked: Some([78.0, -10.0]), ..first });
    all.push(Case { controller: Controller::Pid, ..PLAIN });
    for (feed_forward, asked, later) in [(false, None, None), (true, Some([75.0, 67.0]), Some([42.0, 30.0]))] {
        let mellinger = Case { controller: Controller::Mellinger { feed_forward }, speed: MELLINGER_SPEED, ..PLAIN };
        all.push(Case { asked, ..mellinger });
        all.push(Case { seconds: Seconds::After(60), asked, ..mellinger });
        all.push(Case { then_later_s: 0.02, asked: later, ..mellinger });
    }
    for (what, gain, speed, late_s) in [
        ("response guessed with gain x0.5", 0.5, 1.0, 0.0),
        ("response guessed with gain x2", 2.0, 1.0, 0.0),
        ("response guessed 50 ms late", 1.0, 1.0, 0.05),
        ("response guessed 100 ms late", 1.0, 1.0, 0.1),
        ("response guessed half as fast", 1.0, 0.5, 0.0),
        ("response guessed twice as fast", 1.0, 2.0, 0.0),
    ] {
        let response = Response::Guessed(Guessed { gain, speed, late_s });
        all.push(Case { what, response, ..PLAIN });
        all.push(Case { what, response, controller: Controller::Pid, speed: PID_SPEED, ..PLAIN });
    }
    // On top of a model with both of its lanes.
    let model = |start, seconds, asked| Case { start, seconds: Seconds::After(seconds), asked, ..PLAIN };
    all.push(model(Start::Same, 0, None));
    all.push(model(Start::Same, 60, None));
    for (seconds, asked) in [(0, None), (10, Some([96.5, 93.5]))] {
        all.push(Case { vehicle: "crazyflie-brushless", ..model(Start::OtherVehicle, seconds, asked) });
    }
    for (what, mismatch, seconds, asked) in [
        ("thrust -9 %", Mismatch { thrust: 0.91, ..Mismatch::NONE }, 10, [97.0, 94.5]),
        ("drag x4", Mismatch { drag: 4.0, ..Mismatch::NONE }, 30, [96.5, 93.0]),
        ("+20 ms", Mismatch { delay_s: 0.02, ..Mismatch::NONE }, 10, [95.5, 93.0]),
    ] {
        all.push(Case { what, mismatch, ..model(Start::Same, seconds, Some(asked)) });
    }
    all.push(Case { what: "steady wind of 6 m/s", wind: 6.0, ..model(Start::Same, 10, Some([95.0, 90.0])) });
    all.push(Case { gains: "soft", ..model(Start::OtherGains, 30, Some([92.0, 85.0])) });
    let drawn = Case { vehicle: "crazyflie-brushless", what: "200 drawn vehicles", draws: 200, ..model(Start::Same, 10, None) };
    all.push(Case { asked: Some([95.5, 85.0]), ..drawn });
    let weak = Mismatch { thrust: 0.91, ..Mismatch::NONE };
    all.push(Case { speed: 1.7, what: "thrust -9 %", mismatch: weak, ..model(Start::Same, 30, Some([94.0, 88.0])) });
    all
}
