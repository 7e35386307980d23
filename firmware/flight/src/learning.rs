//! What a flight stack learns while it flies: corrections of its position references, from nothing.
//!
//! *in* a flight stack before each control tick, and the state that it will get; *out* the offset of its position reference;
//! *never* more than the limits; *source* [`impromptu_firmware::learning`], one learner an axis of the world frame, ENU.
//!
//! The learner knows nothing of what flies: the loop, with or without a model before it, is what the position reference goes
//! into. Its response may be a guess ([`Guess`]).

use impromptu_firmware::{
    learning::{AxisSettings, Kept, LearningAddOn, Limits, Measured, NotKept, Phase, Probe, Progress, Response, identity},
    math::{clamp, sqrt},
};
use nalgebra::Vector3;

use crate::{
    caps,
    flight::{Flight, Frozen, Settings},
    quadrotor::{self, REFERENCE},
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
/// Where the loop asks for more than all thrust, there is none left to keep the attitude with: corrections shrink, by so much a
/// second for each of what is too much, 1/s, and grow again, 1/s. What the loop does then is not learned.
const SHRINK: f32 = 50.0;
/// See [`SHRINK`].
const GROWTH: f32 = 5.0;
/// Share of all thrust that is asked for and above which nothing is learned.
const SATURATED: f32 = 1.05;
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

/// How a response is measured in hover: how much acceleration the loop asks for at each step to a side, m/s², and its size, m, at
/// least and at most.
const PROBE_ACCELERATION: f32 = 0.45;
/// See [`PROBE_ACCELERATION`].
const PROBE_SIZE: [f32; 2] = [0.05, 0.2];
/// How long, in rad of the slowest axis's natural frequency: 6 s at 2.55 rad/s.
const PROBE_TURNS: f32 = 15.3;

/// How old a position is when it arrives from motion capture over a radio, s, where nobody knows better.
pub const POSITION_AGE_S: f32 = 0.024;

/// Bytes of what is kept of a flight stack.
pub const KEPT: usize = Kept::length(3);

/// Learns beside a flight stack.
#[derive(Clone, Debug)]
pub struct FlightLearning {
    add_on: LearningAddOn<3>,
    guesses: Option<[Guess; 3]>,
    age_s: f32,
    frozen: Frozen,
    /// Reference tick of the last correction.
    last: Option<i32>,
    offset: Vector3<f32>,
    /// Share of their room that corrections do not have, since thrust is short.
    withheld: f32,
}

impl FlightLearning {
    /// Beside a flight stack that nobody has told of yet: it is off, and [configured](Self::configure) where it lies, since it is
    /// large (8 KB).
    pub const fn empty() -> Self {
        Self {
            add_on: LearningAddOn::empty(),
            guesses: None,
            age_s: 0.0,
            frozen: Frozen::EMPTY,
            last: None,
            offset: Vector3::new(0.0, 0.0, 0.0),
            withheld: 0.0,
        }
    }

    /// Nothing learned yet; both parts learn and act. `rate_hz` is the rate of the references, `age_s` the age of a position when
    /// it arrives. `None` if a limit is not a positive number.
    pub fn new(guesses: &[Guess; 3], rate_hz: f32, age_s: f32) -> Option<Self> {
        let mut new = Self::empty();
        new.configure(Some(guesses), rate_hz, age_s);
        new.add_on.learn().ok()?;
        Some(new)
    }

    /// Off, with nothing learned, unless this is the loop that it knows: then what was learned stays, and it goes on with what it
    /// does. `None`: no loop of second order, beside which nothing is learned.
    pub fn configure(&mut self, guesses: Option<&[Guess; 3]>, rate_hz: f32, age_s: f32) {
        let same = self.guesses.as_ref() == guesses && self.add_on.rate_hz() == rate_hz && self.age_s == age_s;
        if same {
            return;
        }
        let slowest = guesses.iter().copied().flatten().fold(f32::MAX, |slowest, guess| slowest.min(guess.response.turn()));
        let [least, most] = PROBE_SIZE;
        let axis = |guess: &Guess| AxisSettings {
            response: Some(guess.response),
            limits: guess.limits,
            probe: Probe {
                size: clamp(PROBE_ACCELERATION / guess.stiffness, least, most).min(guess.limits.correction),
                seconds: PROBE_TURNS / (slowest * rate_hz),
            },
        };
        let known = guesses.filter(|[x, y, z]| self.add_on.configure(&[axis(x), axis(y), axis(z)], rate_hz, age_s));
        (self.guesses, self.age_s) = (known.copied(), age_s);
        self.restart();
    }

    /// Whether it knows the loop beside which it learns.
    pub fn is_configured(&self) -> bool {
        self.guesses.is_some()
    }

    /// What learns, to be told what to do.
    pub fn add_on(&mut self) -> &mut LearningAddOn<3> {
        &mut self.add_on
    }

    /// Whether it measures the responses, which asks for lanes that do not act.
    fn measures(&self) -> bool {
        self.add_on.phase() == Phase::Commissioning
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        self.add_on.progress()
    }

    /// Writes what was learned to the start of `bytes`, [`KEPT`] of them; `model` is the check sum of the model that flies, if
    /// there is one. `None` if it does not fit, or while the responses are measured.
    pub fn keep<'b>(&self, model: Option<u32>, bytes: &'b mut [u8]) -> Option<&'b [u8]> {
        self.add_on.keep(self.identity(model), bytes)
    }

    /// Goes on with what was kept beside the same model.
    ///
    /// # Errors
    /// If nothing was kept there, it is damaged, or of another loop; then nothing changes.
    pub fn recall(&mut self, model: Option<u32>, bytes: &[u8]) -> Result<(), NotKept> {
        self.add_on.recall(self.identity(model), bytes)
    }

    fn identity(&self, model: Option<u32>) -> u32 {
        identity(quadrotor::signals(), self.add_on.rate_hz(), model)
    }

    /// Another flight: what was learned stays.
    pub fn restart(&mut self) {
        self.add_on.restart();
        (self.last, self.offset, self.frozen, self.withheld) = (None, Vector3::zeros(), Frozen::EMPTY, 0.0);
    }

    /// The offset of the last reference tick, m, world ENU.
    pub fn offset(&self) -> Vector3<f32> {
        self.offset
    }

    /// Whether [`FlightLearning::step`] does anything in this control tick: it is the first one of a reference tick.
    pub fn is_due(&self, flight: &Flight<'_>, tick: Tick) -> bool {
        self.last != Some(flight.reference_tick(tick))
    }

    /// Before a control tick of the flight stack, with the state that it will get: at a reference tick the offset of its
    /// position reference, which it gets in the place of a dither. No state, one that no vehicle can be in, and a position that
    /// stands still although it must have changed, are missing samples, and so is what is measured while the loop asks for more
    /// thrust than there is. On the ground, and after a gap, it begins anew at rest. While the responses are measured no lane
    /// of a model acts: a feedback lane takes the steps for a disturbance.
    pub fn step(&mut self, flight: &mut Flight<'_>, tick: Tick, state: Option<&State>) -> Vector3<f32> {
        if !self.is_due(flight, tick) {
            return self.offset;
        }
        let now = flight.reference_tick(tick);
        self.last = Some(now);
        flight.suspend_lanes(self.measures());
        let guesses = match &self.guesses {
            Some(guesses) if !self.add_on.is_idle() => guesses,
            _ => return self.be_idle(flight),
        };
        let thrust = flight.thrust_share();
        let change = if thrust > 1.0 { SHRINK * (thrust - 1.0) } else { -GROWTH };
        self.withheld = clamp(self.withheld + change / self.add_on.rate_hz(), 0.0, 1.0);
        let left = 1.0 - self.withheld;
        let present = flight.setpoint(now);
        let motion = present.velocity.iter().zip(&present.acceleration);
        for (axis, (guess, (velocity, acceleration))) in guesses.iter().zip(motion).enumerate() {
            let [low, high] = guess.room(*acceleration, *velocity, if axis == 2 { VERTICAL } else { ACROSS });
            self.add_on.bound(axis, left * low, left * high);
        }
        // The first reference channels are those of the position.
        for (axis, correction) in
            flight.adapter().map_or([0.0; REFERENCE], |adapter| adapter.fed_back()).into_iter().take(3).enumerate()
        {
            self.add_on.tell_other(axis, correction);
        }
        let known = state.filter(|state| {
            let frozen = self.frozen.ticks(state, &present.velocity, self.add_on.rate_hz()) > 0;
            state.is_physical() && !frozen && thrust < SATURATED
        });
        let measured = core::array::from_fn(|axis| {
            let (value, rate) = known?.position.get(axis).copied().zip(known?.velocity.get(axis).copied())?;
            Some(Measured { value, rate: Some(rate) })
        });
        let offset = self.add_on.step(now, |tick| flight.setpoint(tick).position.into(), &measured, flight.airborne());
        self.offset = offset.into();
        flight.set_dither(self.offset);
        self.offset
    }

    /// A reference tick in which it is off: it costs nothing.
    fn be_idle(&mut self, flight: &mut Flight<'_>) -> Vector3<f32> {
        self.add_on.restart();
        if self.offset != Vector3::zeros() {
            self.offset = Vector3::zeros();
            flight.set_dither(self.offset);
        }
        self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{settings::tests::GOOD, types::Setpoint};
    use impromptu_firmware::{learning::AHEAD, network::Scratch};
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
                let offset = learning.step(&mut flight, now, Some(&state));
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

    /// A vehicle that is so far away that the loop asks for more thrust than there is.
    #[test]
    fn where_thrust_is_short_corrections_shrink_and_nothing_is_learned() {
        let far = |tick: i32| {
            let state = behind(tick);
            let away = if (700..760).contains(&tick) { 8.0 } else { 0.0 };
            State { position: state.position - Vector3::new(0.0, 0.0, away), ..state }
        };
        let (short, enough) = (offsets(0, 900, |_| true, far), offsets(0, 900, |_| true, behind));
        let largest = |offsets: &[[u32; 3]], axis: usize| {
            offsets.iter().map(|offset| f32::from_bits(offset[axis]).abs()).fold(0.0, f32::max)
        };
        assert_eq!(short[..701], enough[..701]);
        assert!(largest(&enough[730..760], 0) > 0.05);
        assert!(largest(&short[730..760], 0) < 1e-3, "{}", largest(&short[730..760], 0));
        // What was learned is still there.
        assert!(largest(&short[850..], 0) > 0.5 * largest(&enough[850..], 0));
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
