//! One step of the classical fourth-order Runge-Kutta method for all members.

use std::marker::PhantomData;

use pulp::{Simd, WithSimd};

use super::constants::Constants;
use super::motion::Motion;
use super::state::{BATCH, Batch, Disturbance, States, gather, scatter};
use super::wrench::{Model, derivative};

/// The arguments of a step, to be run with the instruction set that is found at run time.
pub(super) struct Step<'a, M> {
    constants: &'a Constants,
    states: &'a mut States,
    commands: &'a [Batch; 4],
    disturbance: &'a Disturbance,
    duration: f64,
    model: PhantomData<M>,
}

impl<'a, M: Model> Step<'a, M> {
    pub(super) fn new(
        constants: &'a Constants,
        states: &'a mut States,
        commands: &'a [Batch; 4],
        disturbance: &'a Disturbance,
        duration: f64,
    ) -> Self {
        Self { constants, states, commands, disturbance, duration, model: PhantomData }
    }
}

impl<M: Model> WithSimd for Step<'_, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        step::<M>(self.constants, self.states, self.commands, self.disturbance, self.duration);
    }
}

/// A plain loop over the members without a branch in its body, which the compiler turns into vector instructions
/// (everything below is inlined into it).
///
/// Two of the five parts of the state need no stages of their own. The derivative of the position is the velocity, so
/// that its four stages sum up to the velocity and the first three accelerations. A rotor's speed follows a linear
/// equation with a constant command, so that each stage is the speed plus a multiple, known beforehand, of the
/// distance to the command. Both are the Runge-Kutta step, rearranged.
#[inline(always)]
fn step<M: Model>(constants: &Constants, states: &mut States, commands: &[Batch; 4], disturbance: &Disturbance, duration: f64) {
    let half = 0.5 * duration;
    let sixth = duration / 6.0;
    let sixth_squared = duration * sixth;
    // A local result, as nothing tells the compiler that the states do not overlap with the inputs.
    let mut next = *states;
    for member in 0..BATCH {
        let own = constants.member(member);
        let wind = gather(&disturbance.wind_velocity, member);
        let pushed = gather(&disturbance.acceleration, member);
        let start = Motion {
            velocity: gather(&states.velocity, member),
            attitude: gather(&states.attitude, member),
            body_rates: gather(&states.body_rates, member),
        };
        let speeds = gather(&states.rotor_speeds, member);
        let command = constants.clamp(gather(commands, member));
        let distance: [f64; 4] = [command[0] - speeds[0], command[1] - speeds[1], command[2] - speeds[2], command[3] - speeds[3]];
        let ratio = duration * own.motor_rate;
        let second = 0.5 * ratio;
        let third = second * (1.0 - second);
        let fourth = ratio * (1.0 - third);
        let last = ratio * (1.0 / 6.0) * (6.0 - 2.0 * (second + third) - fourth);

        let rate1 = derivative::<M>(constants, &own, &start, &speeds, &wind, &pushed);
        let middle = advance(&speeds, &distance, second);
        let motion = start.advance(&rate1, half);
        let rate2 = derivative::<M>(constants, &own, &motion, &middle, &wind, &pushed);
        let middle = advance(&speeds, &distance, third);
        let motion = start.advance(&rate2, half);
        let rate3 = derivative::<M>(constants, &own, &motion, &middle, &wind, &pushed);
        let end = advance(&speeds, &distance, fourth);
        let motion = start.advance(&rate3, duration);
        let rate4 = derivative::<M>(constants, &own, &motion, &end, &wind, &pushed);

        let rate = rate1.weighted_sum(&rate2, &rate3, &rate4);
        let finish = start.advance(&rate, sixth);
        for axis in 0..3 {
            next.position[axis][member] += duration * start.velocity[axis]
                + sixth_squared * (rate1.velocity[axis] + rate2.velocity[axis] + rate3.velocity[axis]);
        }
        let [w, x, y, z] = finish.attitude;
        let scale = 1.0 / ((w * w + x * x) + (y * y + z * z)).sqrt();
        let attitude = [w * scale, x * scale, y * scale, z * scale];
        scatter(&mut next.velocity, member, &finish.velocity);
        scatter(&mut next.attitude, member, &attitude);
        scatter(&mut next.body_rates, member, &finish.body_rates);
        scatter(&mut next.rotor_speeds, member, &advance(&speeds, &distance, last));
    }
    *states = next;
}

#[inline(always)]
fn advance(speeds: &[f64; 4], distance: &[f64; 4], factor: f64) -> [f64; 4] {
    [
        speeds[0] + distance[0] * factor,
        speeds[1] + distance[1] * factor,
        speeds[2] + distance[2] * factor,
        speeds[3] + distance[3] * factor,
    ]
}
