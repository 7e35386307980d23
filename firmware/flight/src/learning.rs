//! What a flight stack learns while it flies: corrections of its position references, from nothing.
//!
//! *in* a flight stack before each control tick, and the state that it will get; *out* the offset of its position reference;
//! *never* more than the limits; *source* [`impromptu_firmware::learning`], one learner an axis of the world frame, ENU.
//!
//! The learner knows nothing of what flies: the loop, with or without a model before it, is what the position reference goes
//! into. Its response may be a guess ([`Guess`]).

use impromptu_firmware::{
    learning::{AHEAD, BEHIND, Learned, Learner, Limits, Measured, Parts, Response},
    math::sqrt,
};
use nalgebra::Vector3;

use crate::{
    caps,
    flight::{Flight, Settings},
    types::{State, Tick},
};

/// Acceleration that the loop is asked for by a correction in a calm flight, m/s².
const ACCELERATION: f32 = 6.5;
/// How far from what the desired motion needs a correction may take what the loop is asked for, m/s²: across, and up and down,
/// where thrust must be left to turn the vehicle with.
const ACROSS: f32 = 6.0;
/// See [`ACROSS`].
const VERTICAL: f32 = 4.0;
/// What the feedback part has of a calm flight's.
const FEEDBACK: f32 = 0.3;
/// Time in which a correction may go from nothing to its limit, s.
const RISE: f32 = 0.05;
/// From the position loop's command to the vehicle's acceleration, s: an attitude loop of 20 rad/s.
const ATTITUDE: f32 = 0.055;

/// What is known of an axis: how its loop answers, and what a correction may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Position reference to measured position.
    pub response: Response,
    /// Bounds of the correction, m and m/s.
    pub limits: Limits,
    /// Acceleration that the loop asks for of a position error, 1/s².
    pub stiffness: f32,
    /// Acceleration that it asks for against a velocity that it was not told, 1/s; 0 for a loop that has velocity references.
    pub drag: f32,
}

impl Guess {
    /// Of each axis, as the gains of the position loop say; positions are `age_s` old when they arrive. `None` if they are not
    /// those of a loop of second order.
    pub fn of(settings: &Settings, age_s: f32) -> Option<[Self; 3]> {
        let of = |kp: f32, kd: f32| {
            let (frequency, rate) = (sqrt(kp), settings.rates.reference_hz());
            let response = Response::second_order(1.0, frequency, 0.5 * kd / frequency, age_s + ATTITUDE, rate)?;
            let (scale, correction) = (ACCELERATION / kp, caps::ACCELERATION / kp);
            let limits = Limits { scale, correction, feedback: FEEDBACK * scale, rate: correction / RISE };
            Some(Self { response, limits, stiffness: kp, drag: 0.0 })
        };
        let ([px, py, pz], [dx, dy, dz]) = (settings.position.kp, settings.position.kd);
        Some([of(px, dx)?, of(py, dy)?, of(pz, dz)?])
    }

    /// Where a correction may be while this motion is desired, m: between nothing and what takes the loop's lag away, and a
    /// little further.
    fn room(&self, acceleration: f32, velocity: f32, margin: f32) -> [f32; 2] {
        let needs = [0.0, acceleration, acceleration + self.drag * velocity];
        let low = needs.iter().fold(0.0f32, |low, need| low.min(*need));
        let high = needs.iter().fold(0.0f32, |high, need| high.max(*need));
        [(low - margin) / self.stiffness, (high + margin) / self.stiffness]
    }
}

/// Learns beside a flight stack.
#[derive(Clone, Debug)]
pub struct FlightLearning {
    axes: [Learner; 3],
    guesses: [Guess; 3],
    /// Parts that learn, and parts that act.
    learn: Parts,
    act: Parts,
    /// Reference tick of the last correction.
    last: Option<i32>,
    offset: Vector3<f32>,
}

impl FlightLearning {
    /// Nothing learned yet; both parts learn and act. `rate_hz` is the rate of the references, `age_s` the age of a position when
    /// it arrives. `None` if a limit is not a positive number.
    pub fn new(guesses: &[Guess; 3], rate_hz: f32, age_s: f32) -> Option<Self> {
        let learner = |guess: &Guess| Learner::new(guess.response, rate_hz, age_s, guess.limits);
        let [x, y, z] = guesses;
        let axes = [learner(x)?, learner(y)?, learner(z)?];
        Some(Self { axes, guesses: *guesses, learn: Parts::BOTH, act: Parts::BOTH, last: None, offset: Vector3::zeros() })
    }

    /// Which parts learn, and which act.
    pub fn switch(&mut self, learn: Parts, act: Parts) {
        (self.learn, self.act) = (learn, act);
    }

    /// Another flight: what was learned stays.
    pub fn restart(&mut self) {
        (self.last, self.offset) = (None, Vector3::zeros());
    }

    /// Forgets what was learned.
    pub fn forget(&mut self) {
        self.axes.iter_mut().for_each(Learner::forget);
    }

    /// What was learned of each axis.
    pub fn learned(&self) -> [Learned; 3] {
        let [x, y, z] = &self.axes;
        [x.learned(), y.learned(), z.learned()]
    }

    /// How often what was learned was forgotten because it did harm.
    pub fn forgotten(&self) -> u16 {
        self.axes.iter().fold(0, |sum, axis| sum.saturating_add(axis.forgotten()))
    }

    /// The share of the correction that acts, 0..1, of the axis with the least.
    pub fn share(&self) -> f32 {
        self.axes.iter().fold(1.0, |least, axis| axis.share().min(least))
    }

    /// Before a control tick of the flight stack, with the state that it will get: at a reference tick the offset of its position
    /// reference, which it gets in the place of a dither. A state that no vehicle can be in is a missing sample. On the ground,
    /// and after a gap, it begins anew at rest.
    pub fn step(&mut self, flight: &mut Flight<'_>, tick: Tick, state: &State) -> Vector3<f32> {
        let now = flight.reference_tick(tick);
        if self.last == Some(now) {
            return self.offset;
        }
        let goes_on = self.last.is_some_and(|last| last.wrapping_add(1) == now) && flight.airborne();
        self.last = Some(now);
        let known = state.is_physical();
        let present = flight.setpoint(now);
        for (axis, (learner, guess)) in self.axes.iter_mut().zip(&self.guesses).enumerate() {
            let [velocity, acceleration] =
                [present.velocity, present.acceleration].map(|vector| vector.get(axis).copied().unwrap_or(0.0));
            let [low, high] = guess.room(acceleration, velocity, if axis == 2 { VERTICAL } else { ACROSS });
            learner.bound(low, high);
            let desired = |offset: i32| {
                let tick = now.wrapping_add(offset.clamp(-BEHIND - 1, AHEAD));
                flight.setpoint(tick).position.get(axis).copied().unwrap_or(0.0)
            };
            let [value, rate] = [state.position, state.velocity].map(|vector| vector.get(axis).copied().unwrap_or(0.0));
            let measured = known.then_some(Measured { value, rate });
            if !goes_on {
                learner.start(desired(0));
            }
            let correction = learner.step(desired, measured, self.learn, self.act);
            if let Some(offset) = self.offset.get_mut(axis) {
                *offset = if flight.airborne() { correction } else { 0.0 };
            }
        }
        flight.set_dither(self.offset);
        self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{settings::tests::GOOD, types::Setpoint};
    use impromptu_firmware::network::Scratch;
    use proptest::prelude::*;

    fn learning() -> FlightLearning {
        FlightLearning::new(&Guess::of(&GOOD, 0.024).unwrap(), 100.0, 0.024).unwrap()
    }

    /// A motion along x, from rest at tick 100 of the position loop.
    fn desired(tick: i32) -> Setpoint {
        let t = 0.01 * (tick - 100).max(0) as f32;
        let x = 0.5 - 0.5 * (2.0 * t).cos();
        let (v, a) = ((2.0 * t).sin(), 2.0 * (2.0 * t).cos());
        let moving = if tick > 100 { 1.0 } else { 0.0 };
        Setpoint {
            position: Vector3::new(x, 0.0, 1.0),
            velocity: Vector3::new(v, 0.0, 0.0),
            acceleration: Vector3::new(moving * a, 0.0, 0.0),
            yaw: 0.0,
        }
    }

    /// Flies in a world in which the vehicle is where it is desired to be, but late and pushed: offsets of each reference tick.
    fn offsets(start: u32, ticks: i32, airborne: impl Fn(i32) -> bool, state: impl Fn(i32) -> State) -> Vec<[u32; 3]> {
        let (mut flight, mut learning, mut scratch) = (Flight::new(&GOOD).unwrap(), learning(), Scratch::new());
        let mut all = Vec::new();
        for tick in 0..ticks {
            while flight.next_setpoint() <= tick + AHEAD + 1 {
                assert!(flight.push_setpoint(&desired(flight.next_setpoint())));
            }
            flight.set_airborne(airborne(tick));
            for phase in 0..5 {
                let now = Tick(start.wrapping_add(5 * tick as u32 + phase));
                let state = state(tick);
                let offset = learning.step(&mut flight, now, &state);
                flight.step(now, &state, &mut scratch);
                if phase == 0 {
                    all.push(offset.map(f32::to_bits).into());
                }
            }
        }
        all
    }

    fn behind(tick: i32) -> State {
        State { position: desired(tick - 20).position, velocity: desired(tick - 20).velocity, ..State::ORIGIN }
    }

    #[test]
    fn it_corrects_in_the_air_and_not_on_the_ground() {
        let in_the_air = offsets(0, 900, |_| true, behind);
        let largest = in_the_air.iter().map(|[x, ..]| f32::from_bits(*x).abs()).fold(0.0, f32::max);
        assert!(largest > 0.05, "{largest}");
        let landed = offsets(0, 900, |tick| tick < 600, behind);
        assert_eq!(landed[..600], in_the_air[..600]);
        assert!(landed[600..].iter().flatten().all(|bits| f32::from_bits(*bits) == 0.0));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn an_offset_is_a_number_within_its_limits_whatever_is_measured(
            odd in prop::collection::vec((any::<[f32; 6]>(), prop::array::uniform6(-3f32..3.0), any::<bool>()), 1..40)
        ) {
            let limits = Guess::of(&GOOD, 0.024).unwrap().map(|guess| guess.limits.correction);
            let state = |tick: i32| {
                let (bits, sane, insane) = odd[tick as usize % odd.len()];
                let [px, py, pz, vx, vy, vz] = if insane && tick % 7 == 0 { bits } else { sane };
                State { position: Vector3::new(px, py, pz), velocity: Vector3::new(vx, vy, vz), ..State::ORIGIN }
            };
            for offset in offsets(0, 500, |tick| tick % 200 != 150, state) {
                for (bits, limit) in offset.into_iter().zip(limits) {
                    prop_assert!(f32::from_bits(bits).abs() <= limit, "{offset:?}");
                }
            }
        }
    }
}
