//! The vehicle in the air: a rigid body with four rotors, eight flights at once.
//!
//! *in*: commanded rotor speeds, air velocity and an added acceleration, a time step; *out*: the next state;
//! *never*: a result that depends on the processor, on the member, or on the other seven flights;
//! *source*: RotorPy 3.0.0 (Folk, Paulos, Kumar, "RotorPy: a Python-based multirotor simulator with aerodynamics for
//! education and research", 2023), whose own derivatives and steps are the test vectors.
//!
//! With R the rotation body to world, v_a the airspeed in the body frame, w the body rates, rotor i at r_i with speed
//! O_i and sense s_i, K = diag(k_d, k_d, k_z):
//!
//! ```text
//! v_a = R^T (v - wind)                 v_i = v_a + w x r_i
//! F_i = k_eta O_i^2 e_z - O_i K v_i + k_h (v_ix^2 + v_iy^2) e_z
//! F   = sum F_i - |v_a| diag(c_D) v_a
//! M   = sum r_i x F_i + s_i k_m O_i^2 e_z - k_flap O_i (v_i x e_z)
//! dx = v       dv = R F / m - g e_z + disturbance       dq = q (0, w) / 2
//! dw = J^-1 (M - w x J w)              dO = (clamp(command) - O) / tau_m
//! ```
//!
//! No gyroscopic torque of the rotors, ground effect, inflow dynamics or battery.

mod constants;
mod motion;
mod runge_kutta;
mod state;
mod vehicle;
mod wrench;

use pulp::Arch;

pub use constants::{GRAVITY, Variation};
pub use state::{BATCH, Batch, Disturbance, State, States};
pub use vehicle::{AttitudeGains, Inertia, PositionGains, Rotor, Vehicle, VehicleError};
pub use wrench::Wrench;

use constants::Constants;
use motion::{Motion, Rotation};
use runge_kutta::Step;
use state::{gather, scatter};
use wrench::{Full, Model, Planar};

/// Which of the terms in the equations the vehicle has; the others are not computed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// Rotors in the plane of the centre of mass, principal axes, no flapping, parasitic drag or translational lift.
    Planar,
    /// As `Planar`, with translational lift.
    PlanarWithLift,
    /// Every term.
    Full,
}

/// The equations of motion with the constants of [`BATCH`] vehicles.
#[derive(Debug, Clone)]
pub struct Plant {
    constants: Constants,
    form: Form,
    arch: Arch,
}

impl Plant {
    /// The plant of `vehicle`, each member varied in its own way.
    pub fn new(vehicle: &Vehicle, variations: [Variation; BATCH]) -> Self {
        let simple = vehicle.rotors.iter().all(|rotor| rotor.position[2] == 0.0)
            && vehicle.inertia.is_diagonal()
            && vehicle.flapping == 0.0
            && vehicle.parasitic_drag == [0.0; 3];
        Self {
            constants: Constants::new(vehicle, &variations),
            form: match (simple, vehicle.translational_lift == 0.0) {
                (true, true) => Form::Planar,
                (true, false) => Form::PlanarWithLift,
                (false, _) => Form::Full,
            },
            arch: Arch::new(),
        }
    }

    /// Advances every flight by `duration` (s): one step of the classical Runge-Kutta method with the commanded rotor
    /// speeds (`commands[rotor][member]`, rad/s, clamped to the vehicle's range) and the disturbance held, then
    /// normalises the quaternions, as the derivative does not keep their length.
    ///
    /// The widest vector instructions of the processor are used; no multiplication is fused with an addition, so that
    /// the bits are the same on each.
    #[inline]
    pub fn step(&self, states: &mut States, commands: &[Batch; 4], disturbance: &Disturbance, duration: f64) {
        self.step_with(self.arch, states, commands, disturbance, duration);
    }

    /// [`Plant::step`] on a given instruction set.
    #[inline]
    fn step_with(&self, arch: Arch, states: &mut States, commands: &[Batch; 4], disturbance: &Disturbance, duration: f64) {
        let constants = &self.constants;
        match self.form {
            Form::Planar => arch.dispatch(Step::<Planar<false>>::new(constants, states, commands, disturbance, duration)),
            Form::PlanarWithLift => arch.dispatch(Step::<Planar<true>>::new(constants, states, commands, disturbance, duration)),
            Form::Full => arch.dispatch(Step::<Full>::new(constants, states, commands, disturbance, duration)),
        }
    }

    /// The time derivative of every flight's state: each component per second. `commands[rotor][member]`, rad/s.
    pub fn derivative(&self, states: &States, commands: &[Batch; 4], disturbance: &Disturbance) -> States {
        match self.form {
            Form::Planar => self.derivative_of::<Planar<false>>(states, commands, disturbance),
            Form::PlanarWithLift => self.derivative_of::<Planar<true>>(states, commands, disturbance),
            Form::Full => self.derivative_of::<Full>(states, commands, disturbance),
        }
    }

    fn derivative_of<M: Model>(&self, states: &States, commands: &[Batch; 4], disturbance: &Disturbance) -> States {
        let mut derivative = *states;
        derivative.position = states.velocity;
        for member in 0..BATCH {
            let state = states.member(member);
            let constants = self.constants.member(member);
            let rates = wrench::derivative::<M>(
                &self.constants,
                &constants,
                &Motion { velocity: state.velocity, attitude: state.attitude, body_rates: state.body_rates },
                &state.rotor_speeds,
                &gather(&disturbance.wind_velocity, member),
                &gather(&disturbance.acceleration, member),
            );
            scatter(&mut derivative.velocity, member, &rates.velocity);
            scatter(&mut derivative.attitude, member, &rates.attitude);
            scatter(&mut derivative.body_rates, member, &rates.body_rates);
            let commands = self.constants.clamp(gather(commands, member));
            let distances = commands.iter().zip(&state.rotor_speeds);
            for (rate, (command, speed)) in derivative.rotor_speeds.iter_mut().zip(distances) {
                rate[member] = (command - speed) * constants.motor_rate;
            }
        }
        derivative
    }

    /// Force (N) and moment about the centre of mass (N m) of the rotors and the air on the body, body FLU, without
    /// gravity, in each member.
    pub fn wrench(&self, states: &States, disturbance: &Disturbance) -> [Wrench; BATCH] {
        std::array::from_fn(|member| {
            let state = states.member(member);
            let wind = gather(&disturbance.wind_velocity, member);
            let rotation = Rotation::new(&state.attitude);
            let airspeed = rotation.to_body(&std::array::from_fn(|axis| state.velocity[axis] - wind[axis]));
            let (shared, own) = (&self.constants, self.constants.member(member));
            let (rates, speeds) = (&state.body_rates, &state.rotor_speeds);
            match self.form {
                Form::Planar => Planar::<false>::wrench(shared, &own, &airspeed, rates, speeds),
                Form::PlanarWithLift => Planar::<true>::wrench(shared, &own, &airspeed, rates, speeds),
                Form::Full => Full::wrench(shared, &own, &airspeed, rates, speeds),
            }
        })
    }
}

#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;
