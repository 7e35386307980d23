//! The flights of an experiment: one vehicle with its gains under one condition.

use impromptu_firmware::{adapter::Lanes, guard::GuardSettings, model::Model};
use impromptu_flight::{
    control::PositionGains,
    flight::Settings,
    learning::{FlightLearning, Guess},
};

use crate::{
    condition::Condition,
    controller::Controller,
    flight_log::FlightLog,
    plant::Vehicle,
    rollout::{self, Dither, FlightPlan, FlightRecord, RolloutError},
    trajectory::{Motion, Trajectory, TrajectoryError},
};

/// Why flights were not flown.
#[derive(Debug, thiserror::Error)]
pub enum FlightsError {
    /// A trajectory cannot be sampled.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The rollout refuses.
    #[error(transparent)]
    Rollout(#[from] RolloutError),
}

/// How the response is known that a loop has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Response {
    /// It is measured in hover, before anything is learned.
    Commissioned,
    /// It is guessed from the gains.
    Guessed(Guessed),
}

/// How the response that a loop is guessed to have differs from what its gains say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guessed {
    /// Factor on the gain at rest.
    pub gain: f64,
    /// Factor on the natural frequency.
    pub speed: f64,
    /// Further delay, s.
    pub late_s: f64,
}

impl Guessed {
    /// In nothing.
    pub const RIGHT: Self = Self { gain: 1.0, speed: 1.0, late_s: 0.0 };
}

/// A vehicle, its gains and what it meets.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Vehicle.
    pub vehicle: Vehicle,
    /// The loop that flies it, unless a flight stack of its own is given ([`rollout::fly_on`]).
    pub controller: Controller,
    /// Name of the position gains; the controller's if it has its own.
    pub gains: String,
    /// Settings of the flight stack.
    pub settings: Settings,
    /// Condition.
    pub condition: Condition,
    /// Guard of the add-on.
    pub guard: GuardSettings,
}

impl Loop {
    /// A vehicle with the gains of that name.
    ///
    /// # Errors
    /// If the vehicle has no such gains.
    pub fn new(vehicle: Vehicle, gains: &str, condition: Condition) -> Result<Self, RolloutError> {
        Ok(Self {
            settings: rollout::settings(&vehicle, gains)?,
            vehicle,
            controller: Controller::Se3,
            gains: gains.into(),
            condition,
            guard: GuardSettings::default(),
        })
    }

    /// The same vehicle flown by a controller, which brings its own gains: they go by its name.
    ///
    /// # Errors
    /// If the controller is not for this vehicle.
    pub fn flown_by(mut self, controller: Controller) -> Result<Self, RolloutError> {
        controller.check(&self.vehicle)?;
        if let Some(gains) = controller.position_gains(&self.vehicle) {
            self.settings.position = rollout::position_gains(&gains);
            self.gains = controller.name().into();
        }
        Ok(Self { controller, ..self })
    }

    /// The same loop with `seconds` more delay in the whole of it ([`Condition::delayed`]).
    #[must_use]
    pub fn delayed(&self, seconds: f64) -> Self {
        Self { condition: self.condition.delayed(seconds), ..self.clone() }
    }

    /// The same loop without a guard: for flights that judge what an add-on does by itself.
    #[must_use]
    pub fn unguarded(&self) -> Self {
        Self { guard: GuardSettings::OFF, ..self.clone() }
    }

    /// Rate of the references, Hz.
    pub fn rate_hz(&self) -> f64 {
        f64::from(self.settings.rates.reference_hz())
    }

    /// Flies plans under this loop's condition.
    ///
    /// # Errors
    /// The first plan that cannot be flown.
    pub fn fly(&self, plans: &[FlightPlan<'_>]) -> Result<Vec<FlightRecord>, RolloutError> {
        rollout::fly(&self.vehicle, self.controller, &self.settings, &self.condition, plans)
    }

    /// Learns beside its flights, from nothing and with a guess of its response from its gains.
    ///
    /// # Errors
    /// If the gains are not those of a loop of second order.
    pub fn learning(&self, guessed: &Guessed) -> Result<FlightLearning, RolloutError> {
        let (age, rate) = (self.condition.measurement_delay_s as f32, self.rate_hz() as f32);
        let PositionGains { kp, kd, .. } = self.settings.position;
        let speed = guessed.speed as f32;
        // As fast as that, with the same damping.
        let position =
            PositionGains { kp: kp.map(|kp| speed * speed * kp), kd: kd.map(|kd| speed * kd), ..self.settings.position };
        let wrong = Guess::of(&Settings { position, ..self.settings }, age + guessed.late_s as f32);
        let learning = Guess::of(&self.settings, age).zip(wrong).and_then(|(mut guesses, wrong)| {
            for ((guess, wrong), kd) in guesses.iter_mut().zip(&wrong).zip(kd) {
                guess.response = wrong.response.amplified(guessed.gain as f32);
                // The Crazyflie's PID is given positions alone.
                guess.drag = if self.controller == Controller::Pid { kd } else { 0.0 };
            }
            FlightLearning::new(&guesses, rate, age)
        });
        learning.ok_or_else(|| {
            RolloutError::Airframe(format!("gains `{}`: no loop of second order, whose response could be guessed", self.gains))
        })
    }

    /// Flies a plan while it learns; what was learned before is known.
    ///
    /// # Errors
    /// If it cannot be flown.
    pub fn fly_learning(&self, plan: &FlightPlan<'_>, learning: &mut FlightLearning) -> Result<FlightRecord, RolloutError> {
        rollout::fly_learning(&self.vehicle, self.controller, &self.settings, &self.condition, plan, learning)
    }

    /// Logs of the baseline over motions, with a dither on the position reference if given.
    ///
    /// # Errors
    /// If a motion cannot be sampled or flown.
    pub fn collect(&self, motions: &[Motion], dither: Option<Dither>, seed: u64) -> Result<Vec<FlightLog>, FlightsError> {
        let trajectories: Vec<Trajectory> =
            motions.iter().map(|motion| motion.sampled(self.rate_hz())).collect::<Result<_, _>>()?;
        let plans: Vec<FlightPlan<'_>> = trajectories
            .iter()
            .zip(seed..)
            .map(|(trajectory, seed)| FlightPlan { dither, log: true, ..FlightPlan::new(trajectory, seed) })
            .collect();
        Ok(self.fly(&plans)?.into_iter().filter_map(|record| record.log).collect())
    }

    /// RMS errors, m, over trajectories with a model, at a loop gain of the feedback lane.
    ///
    /// # Errors
    /// If the model does not fit the flight stack.
    pub fn errors(
        &self,
        trajectories: &[Trajectory],
        model: Option<(&Model<'_>, Lanes)>,
        loop_gain: f32,
        seed: u64,
    ) -> Result<Vec<f64>, RolloutError> {
        let plans: Vec<FlightPlan<'_>> = trajectories
            .iter()
            .zip(seed..)
            .map(|(trajectory, seed)| FlightPlan { model, loop_gain, guard: self.guard, ..FlightPlan::new(trajectory, seed) })
            .collect();
        Ok(self.fly(&plans)?.into_iter().map(|record| record.rms).collect())
    }
}

/// Reduction of errors against the baseline's, in per cent: mean and worst over the flights.
pub fn reduction(baseline: &[f64], errors: &[f64]) -> (f64, f64) {
    let reductions = baseline.iter().zip(errors).map(|(baseline, error)| 100.0 * (1.0 - error / baseline));
    let worst = reductions.clone().fold(f64::INFINITY, f64::min);
    (reductions.sum::<f64>() / baseline.len().max(1) as f64, worst)
}
