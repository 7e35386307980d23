//! A flight of the firmware's flight stack with a simple vehicle, recorded.

use std::collections::VecDeque;

use impromptu_firmware::{adapter::Lanes, model::Model, network::Scratch};
use impromptu_flight::{
    control::Airframe,
    flight::Flight,
    replay::{Event, Recorded, Recorder},
    types::{MotorCommand, Setpoint, State, Tick},
};
use impromptu_tests::settings::crazyflie;
use nalgebra::{UnitQuaternion, Vector3};

/// Seconds for each control tick.
const TICK: f64 = 0.002;
/// Control ticks after which the loop learns of a position.
const DELAY: usize = 6;
/// Setpoints that are pushed before the flight.
const AHEAD: u32 = 120;
/// The trajectory's last reference tick: before the flight's end, so that its end rules are flown too.
const LAST_SETPOINT: u32 = 1_400;

/// The vehicle: heavier than the loop believes, with drag and slow motors.
struct Vehicle {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    rates: Vector3<f64>,
    fractions: [f64; 4],
}

impl Vehicle {
    fn step(&mut self, airframe: &Airframe, command: &MotorCommand) {
        let largest = f64::from(airframe.thrust_coefficient) * f64::from(airframe.max_rotor_speed).powi(2);
        let ratio = f64::from(airframe.torque_coefficient) / f64::from(airframe.thrust_coefficient);
        let (mut thrust, mut moment) = (0.0, Vector3::zeros());
        for (rotor, fraction) in self.fractions.iter_mut().enumerate() {
            *fraction += (f64::from(command.fractions()[rotor]) - *fraction) * (TICK / 0.02);
            let force = largest * *fraction * *fraction;
            let [x, y] = airframe.rotors[rotor].map(f64::from);
            thrust += force;
            moment += force * Vector3::new(y, -x, f64::from(airframe.directions[rotor]) * ratio);
        }
        let inertia = Vector3::from(airframe.inertia.map(f64::from));
        let spin = (moment - self.rates.cross(&inertia.component_mul(&self.rates))).component_div(&inertia);
        self.rates += spin * TICK;
        self.attitude *= UnitQuaternion::from_scaled_axis(self.rates * TICK);
        self.attitude.renormalize();
        let push = self.attitude * Vector3::new(0.0, 0.0, thrust / (1.05 * f64::from(airframe.mass)));
        self.velocity += (push - self.velocity * 0.3 - Vector3::new(0.0, 0.0, 9.81)) * TICK;
        self.position += self.velocity * TICK;
    }
}

/// Sines that start at rest; the heading turns from the fifth second on.
fn setpoint(reference_tick: u32) -> Setpoint {
    let time = f64::from(reference_tick) * 0.01;
    let [mut position, mut velocity, mut acceleration] = [Vector3::zeros(); 3];
    for (axis, (amplitude, frequency)) in [(0.6, 1.9), (0.5, 1.3), (0.2, 0.9)].into_iter().enumerate() {
        let (sine, cosine) = libm::sincos(frequency * time);
        position[axis] = amplitude * (1.0 - cosine);
        velocity[axis] = amplitude * frequency * sine;
        acceleration[axis] = amplitude * frequency * frequency * cosine;
    }
    position.z += 1.0;
    let yaw = 0.4 * (1.0 - libm::cos(0.7 * (time - 5.0).max(0.0)));
    Setpoint { position: position.cast(), velocity: velocity.cast(), acceleration: acceleration.cast(), yaw: yaw as f32 }
}

/// Flies and records `ticks` control ticks. `switches` says what is switched before a tick: lanes or dither.
///
/// # Panics
/// If the vehicle does not stay near its trajectory: such a flight would prove little.
pub(crate) fn fly(addon: Option<(&Model<'_>, Lanes)>, ticks: u32, switches: impl Fn(u32) -> Option<Event>) -> Recorded<Vec<u8>> {
    let settings = crazyflie();
    let mut recorder = Recorder::new(&settings, addon);
    let mut flight = Flight::new(&settings).unwrap();
    let mut scratch = Scratch::new();
    if let Some((model, lanes)) = addon {
        flight.attach(model, lanes).unwrap();
    }
    let mut vehicle = Vehicle {
        position: setpoint(0).position.cast(),
        velocity: Vector3::zeros(),
        attitude: UnitQuaternion::identity(),
        rates: Vector3::zeros(),
        fractions: [0.73; 4],
    };
    let mut late: VecDeque<_> = [(vehicle.position, vehicle.velocity); DELAY].into();
    for tick in 0..ticks {
        if tick.is_multiple_of(settings.rates.position_divisor) {
            let reference_tick = tick / settings.rates.position_divisor;
            while flight.next_setpoint() <= (reference_tick + AHEAD).min(LAST_SETPOINT) as i32 {
                let setpoint = setpoint(flight.next_setpoint() as u32);
                flight.push_setpoint(&setpoint);
                recorder.setpoint(&setpoint);
            }
            let error = vehicle.position - setpoint(reference_tick.min(LAST_SETPOINT)).position.cast();
            assert!(error.norm() < 0.6, "the vehicle is {} m from its trajectory at tick {tick}", error.norm());
        }
        if let Some(event) = switches(tick) {
            event.prepare(&mut flight);
            match event {
                Event::Lanes(lanes) => recorder.lanes(lanes),
                Event::Dither(offset) => recorder.dither(offset),
                other => panic!("{other:?} is no switch"),
            }
        }
        late.push_back((vehicle.position, vehicle.velocity));
        let (position, velocity) = late.pop_front().unwrap();
        let state = State {
            position: position.cast(),
            velocity: velocity.cast(),
            attitude: vehicle.attitude.cast(),
            rates: vehicle.rates.cast(),
            vertical_acceleration: 0.0,
        };
        let command = flight.step(Tick(tick), &state, &mut scratch);
        recorder.tick(&state, &command, flight.reference());
        vehicle.step(&settings.airframe, &command);
    }
    recorder.finish()
}
