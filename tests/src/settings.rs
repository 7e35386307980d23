//! What the flight stack must survive: any settings, states, setpoints and commands.
//!
//! *in* bytes that say which; *out* how many settings were taken and ticks flown by them; *never* a panic, settings that no
//! vehicle has, a motor command outside of 0..=1, a reference that is not finite, or a refused value that changed something: that
//! is what the fuzz target and the test on stable Rust look for.
//!
//! Beside each vehicle stands another one that is not told what the first one refuses: both fly alike, to the bit.

mod lines;

use std::sync::LazyLock;

use impromptu_firmware::{Lanes, Model, Scratch};
use impromptu_flight::{
    control::{Airframe, AttitudeGains, Mixer, PositionGains},
    flight::{Flight, Rates, Settings},
    types::{MotorCommand, POSITION_LIMIT, Reference, Setpoint, State, Tick},
};
use impromptu_model_export::{Precision, encode};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::{bytes::Bytes, mcu::nets::Net};
use lines::Lines;

/// A quadrotor's model, as it is shipped.
static MODEL: LazyLock<Model<'static>> = LazyLock::new(|| {
    let Some(net) = Net::all().ok().and_then(|mut nets| nets.pop()) else { panic!("tests/models cannot be read") };
    let file = encode(&net.description, Some(&net.network), Precision::Int8, &net.calibration);
    let Ok(file) = file else { panic!("the shipped model cannot be exported") };
    Model::from_bytes(file.leak()).unwrap_or_else(|refusal| panic!("the shipped model is refused: {refusal}"))
});

/// A Crazyflie 2.1, about.
pub fn crazyflie() -> Settings {
    let arm = 0.0325;
    Settings {
        airframe: Airframe {
            mass: 0.03,
            inertia: [1.43e-5, 1.43e-5, 2.89e-5],
            rotors: [[arm, arm], [arm, -arm], [-arm, -arm], [-arm, arm]],
            directions: [1.0, -1.0, 1.0, -1.0],
            thrust_coefficient: 2.3e-8,
            torque_coefficient: 7.8e-10,
            max_rotor_speed: 2_500.0,
        },
        position: PositionGains { kp: [6.5, 6.5, 15.0], kd: [4.0, 4.0, 9.0], ki: [0.5, 0.5, 0.5], integral_limit: 0.5 },
        attitude: AttitudeGains { kp: 544.0, kd: 46.64 },
        rates: Rates::default(),
    }
}

/// Flies as the bytes say, by calls and by the link; gives how many settings were taken and ticks flown.
pub fn survive(bytes: &[u8]) -> [usize; 2] {
    let mut bytes = Bytes(bytes);
    match bytes.choice(2) {
        0 => Flights::new().fly(&mut bytes),
        _ => Lines::new().fly(&mut bytes),
    }
}

/// A Crazyflie's settings, of which some numbers are others.
fn settings(bytes: &mut Bytes<'_>) -> Settings {
    // As they go over the link: first the numbers, then the divisor.
    const NUMBERS: u8 = 32;
    let mut encoded = postcard::to_allocvec(&crazyflie()).unwrap_or_default();
    for _ in 0..bytes.choice(4) {
        let place = usize::from(bytes.choice(NUMBERS)) * size_of::<f32>();
        let Some(place) = encoded.get_mut(place..).and_then(|rest| rest.first_chunk_mut()) else { break };
        let number = match bytes.choice(4) {
            // Near what it was, so that it may be a vehicle's.
            0..=2 => f32::from_le_bytes(*place) * (0.5 + f32::from(bytes.byte()) / 128.0),
            _ => bytes.number(),
        };
        *place = number.to_le_bytes();
    }
    let mut settings: Settings = postcard::from_bytes(&encoded).unwrap_or_else(|_| crazyflie());
    if bytes.choice(4) == 0 {
        settings.rates.position_divisor = bytes.word() >> bytes.choice(32);
    }
    settings
}

/// What holds of any vehicle: it can hover, and its loops have a rate.
fn judge(settings: &Settings) {
    let encoded = postcard::to_allocvec(settings).unwrap_or_default();
    let numbers = encoded.as_chunks().0.iter().take(32).map(|bytes| f32::from_le_bytes(*bytes));
    assert!(numbers.into_iter().all(|number| number.is_finite() && !number.is_subnormal()), "{settings:?}");
    let Some(mixer) = Mixer::new(&settings.airframe) else { panic!("no mixer: {settings:?}") };
    let shares = mixer.hover_shares(settings.airframe.mass);
    assert!(shares.iter().all(|share| *share > 0.0 && *share <= 1.0), "{shares:?} of {settings:?}");
    assert!((20.0..=1e4).contains(&settings.rates.control_hz) && settings.rates.reference_hz() >= 5.0, "{settings:?}");
    let Airframe { mass, inertia, max_rotor_speed, thrust_coefficient, .. } = settings.airframe;
    assert!([mass, max_rotor_speed, thrust_coefficient].iter().chain(&inertia).all(|number| *number > 0.0), "{settings:?}");
}

/// A vehicle's answer: motors and reference, as bits; all of them numbers.
fn answer(command: &MotorCommand, reference: &Reference) -> Vec<u32> {
    assert!(command.fractions().iter().all(|fraction| (0.0..=1.0).contains(fraction)), "{command:?}");
    let Reference { position, velocity, yaw } = reference;
    let numbers = position.iter().chain(velocity).chain([yaw]).copied();
    assert!(numbers.clone().all(f32::is_finite), "{reference:?}");
    command.fractions().into_iter().chain(numbers).map(f32::to_bits).collect()
}

/// A state: of unit length in most cases, and where what is desired is.
fn state(bytes: &mut Bytes<'_>, near: &Setpoint) -> State {
    let kind = bytes.choice(16);
    let [position, velocity, rates] = [(); 3].map(|()| if kind < 2 { bytes.numbers() } else { small(bytes) }.into());
    let [i, j, k] = if kind == 2 { bytes.numbers() } else { small(bytes) };
    let attitude = match kind {
        2 => UnitQuaternion::new_unchecked(Quaternion::new(bytes.number(), i, j, k)),
        _ => UnitQuaternion::new_normalize(Quaternion::new(1.0, i, j, k)),
    };
    let vertical_acceleration = if kind == 3 { bytes.number() } else { 0.0 };
    let (position, velocity) = if kind < 2 { (position, velocity) } else { (near.position + position, near.velocity + velocity) };
    State { position, velocity, attitude, rates, vertical_acceleration }
}

/// Numbers within ±0.5.
fn small(bytes: &mut Bytes<'_>) -> [f32; 3] {
    [(); 3].map(|()| f32::from(bytes.byte()) / 256.0 - 0.5)
}

/// A setpoint: a slow one in most cases.
fn setpoint(bytes: &mut Bytes<'_>) -> Setpoint {
    let any = bytes.choice(8) == 0;
    let [position, velocity, acceleration] = [(); 3].map(|()| if any { bytes.numbers() } else { small(bytes) }.into());
    Setpoint { position, velocity, acceleration, yaw: if any { bytes.number() } else { 0.0 } }
}

/// Two flight stacks.
struct Flights {
    told: Flight<'static>,
    other: Flight<'static>,
    /// The newest state that was one.
    known: Option<State>,
    tick: u32,
    taken: usize,
    flown: usize,
}

impl Flights {
    fn new() -> Self {
        Self { told: Flight::empty(), other: Flight::empty(), known: None, tick: 0, taken: 0, flown: 0 }
    }

    fn fly(mut self, bytes: &mut Bytes<'_>) -> [usize; 2] {
        self.configure(&crazyflie());
        self.attach(Lanes::BOTH);
        while !bytes.is_empty() {
            self.call(bytes);
        }
        [self.taken, self.flown]
    }

    fn configure(&mut self, settings: &Settings) {
        let taken = self.told.configure(settings);
        assert_eq!(taken, settings.check().is_ok());
        if taken {
            judge(settings);
            self.other.configure(settings);
            (self.known, self.tick) = (None, 0);
        }
        self.taken += usize::from(taken);
    }

    fn attach(&mut self, lanes: Lanes) {
        if self.told.attach(&MODEL, lanes).is_ok() {
            assert!(self.other.attach(&MODEL, lanes).is_ok());
        }
    }

    fn both(&mut self, call: impl Fn(&mut Flight<'static>)) {
        call(&mut self.told);
        call(&mut self.other);
    }

    fn push(&mut self, setpoint: &Setpoint) {
        let before = self.told.next_setpoint();
        let taken = self.told.push_setpoint(setpoint);
        assert_eq!((taken, self.told.next_setpoint()), (setpoint.is_physical(), before.wrapping_add(i32::from(taken))));
        if taken {
            self.other.push_setpoint(setpoint);
        }
    }

    fn control(&mut self, state: &State) {
        if state.is_physical() {
            self.known = Some(*state);
        }
        let fly = |flight: &mut Flight<'static>, state: &State| {
            let (command, job) = flight.control(Tick(self.tick), state);
            if let (Some(job), Some(network)) = (job, MODEL.network()) {
                flight.deliver(job.run(network, &mut Scratch::new()));
            }
            answer(&command, flight.reference())
        };
        let found = fly(&mut self.told, state);
        match &self.known {
            Some(known) => assert_eq!(found, fly(&mut self.other, known), "a state that no vehicle is in"),
            None => assert_eq!(found[..4], [0; 4], "motors are off before there is a state"),
        }
        self.flown += usize::from(self.known.is_some());
    }

    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.choice(16) {
            0..=5 => {
                let near = self.told.setpoint(self.told.reference_tick(Tick(self.tick)));
                for _ in 0..=bytes.choice(16) {
                    self.control(&state(bytes, &near));
                    self.tick = self.tick.wrapping_add(1);
                }
            }
            6 => {
                self.tick = bytes.tick(self.tick as i32) as u32;
                self.control(&state(bytes, &Setpoint::ORIGIN));
            }
            7 | 8 => {
                let setpoint = setpoint(bytes);
                self.push(&setpoint);
            }
            9 => {
                // A trajectory.
                let mut at = setpoint(bytes);
                for _ in 0..bytes.byte() {
                    at.position += at.velocity * 0.01;
                    self.push(&at);
                }
            }
            10 | 11 => self.configure(&settings(bytes)),
            12 => {
                let lanes = bytes.byte();
                self.attach(Lanes { network: lanes & 1 == 0, feedback: lanes & 2 == 0 });
            }
            13 => {
                let dither = bytes.numbers();
                self.told.set_dither(dither.into());
                if dither.iter().all(|number| number.abs() <= POSITION_LIMIT) {
                    self.other.set_dither(dither.into());
                }
            }
            14 => {
                let from = bytes.tick(self.told.next_setpoint());
                self.both(|flight| flight.replace_setpoints(from));
            }
            _ => {
                let first = bytes.tick(self.told.next_setpoint());
                match bytes.choice(3) {
                    0 => self.both(|flight| flight.clear_setpoints(first)),
                    1 => self.both(Flight::detach),
                    _ => {
                        self.both(Flight::reset);
                        (self.known, self.tick) = (None, 0);
                    }
                }
            }
        }
    }
}
