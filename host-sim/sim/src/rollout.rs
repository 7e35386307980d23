//! Closed-loop flights: eight at once through the plant, each with the firmware's own flight stack.
//!
//! *in* [`FlightPlan`]s; *out* a [`FlightRecord`] each; *never* a result that depends on the order of the plans, on the other
//! flights or on the number of threads; *source* Zhou 2017, Fig. 1; rates of `impromptu_flight::flight::Rates`.

mod conversion;
mod faults;
mod link;
mod loops;
mod pilot;
mod plan;
mod stack;

use impromptu_flight::{
    flight::{Rates, Settings},
    learning::FlightLearning,
};
#[cfg(feature = "threads")]
use rayon::prelude::*;

use crate::{
    condition::Condition,
    controller::Controller,
    plant::{BATCH, GRAVITY, Plant, State, States, Variation, Vehicle},
    weather::Weather,
};
pub use conversion::{position_gains, setpoint, settings};
pub use faults::FaultyFlight;
use pilot::Pilot;
pub use plan::{Dither, FlightPlan, FlightRecord, RolloutError};
pub use stack::FlightStack;
use stack::Software;

/// Flies every plan under one condition with one loop; results in the plans' order. Groups of eight run
/// on the threads of the current rayon pool with the feature `threads`, one after another without.
///
/// # Errors
/// The first plan that cannot be flown.
pub fn fly(
    vehicle: &Vehicle,
    controller: Controller,
    settings: &Settings,
    condition: &Condition,
    plans: &[FlightPlan<'_>],
) -> Result<Vec<FlightRecord>, RolloutError> {
    // Flights of like length share a group, so that few members idle.
    let mut order: Vec<usize> = (0..plans.len()).collect();
    order.sort_by_key(|&index| plans[index].trajectory.samples.len());
    let groups: Vec<&[usize]> = order.chunks(BATCH).collect();
    let fly = |group: &&[usize]| {
        let plans: Vec<&FlightPlan<'_>> = group.iter().map(|&index| &plans[index]).collect();
        let stacks =
            plans.iter().map(|plan| Software::new(vehicle, controller, settings, condition, plan)).collect::<Result<_, _>>()?;
        let records = Group::new(vehicle, settings, condition, &plans, stacks)?.fly();
        Ok(group.iter().copied().zip(records).collect())
    };
    #[cfg(feature = "threads")]
    let groups = groups.par_iter();
    #[cfg(not(feature = "threads"))]
    let groups = groups.iter();
    let flown: Vec<Vec<(usize, FlightRecord)>> = groups.map(fly).collect::<Result<_, RolloutError>>()?;
    let mut records = vec![FlightRecord::default(); plans.len()];
    for (index, record) in flown.into_iter().flatten() {
        records[index] = record;
    }
    Ok(records)
}

/// Flies one plan with a flight stack that learns: it knows what it learned before, and more afterwards. What it learns comes in
/// the place of a dither.
///
/// # Errors
/// If the plan cannot be flown.
pub fn fly_learning(
    vehicle: &Vehicle,
    controller: Controller,
    settings: &Settings,
    condition: &Condition,
    plan: &FlightPlan<'_>,
    learning: &mut FlightLearning,
) -> Result<FlightRecord, RolloutError> {
    let stack = Software::new(vehicle, controller, settings, condition, plan)?.learning(learning);
    fly_on(stack, vehicle, settings, condition, plan)
}

/// Flies one plan with a flight stack of its own: the same flight as [`fly`]'s, to the bit, if the stack gives the same bits.
///
/// # Errors
/// If the plan cannot be flown.
pub fn fly_on(
    stack: impl FlightStack,
    vehicle: &Vehicle,
    settings: &Settings,
    condition: &Condition,
    plan: &FlightPlan<'_>,
) -> Result<FlightRecord, RolloutError> {
    let records = Group::new(vehicle, settings, condition, &[plan], vec![stack])?.fly();
    Ok(records.into_iter().next().unwrap_or_default())
}

/// Flights that run in step.
struct Group<'a, S> {
    plant: Plant,
    states: States,
    weather: Weather,
    pilots: Vec<Pilot<'a, S>>,
    rates: Rates,
    rotor_speed_max: f64,
}

impl<'a, S: FlightStack> Group<'a, S> {
    fn new(
        vehicle: &Vehicle,
        settings: &Settings,
        condition: &Condition,
        plans: &[&FlightPlan<'a>],
        stacks: Vec<S>,
    ) -> Result<Self, RolloutError> {
        let rates = settings.rates;
        let tick = 1.0 / f64::from(rates.control_hz);
        let mut variations = [Variation::default(); BATCH];
        let mut seeds = [0; BATCH];
        let mut states = States::splat(&State::at_rest([0.0; 3]));
        let mut pilots = Vec::with_capacity(BATCH);
        for (member, (plan, stack)) in plans.iter().zip(stacks).enumerate() {
            variations[member] = plan.variation;
            seeds[member] = plan.seed;
            let pilot = Pilot::new(stack, settings, condition, (*plan).clone(), tick)?;
            let hover = plan.variation.payload_factor * vehicle.mass * GRAVITY
                / (4.0 * vehicle.thrust_coefficient * plan.variation.thrust_factor);
            let mut state = State::at_rest(plan.trajectory.samples[0].position);
            let half_yaw = 0.5 * plan.trajectory.samples[0].yaw;
            state.attitude = [half_yaw.cos(), 0.0, 0.0, half_yaw.sin()];
            state.rotor_speeds = [hover.sqrt(); 4];
            states.set_member(member, &state);
            pilots.push(pilot);
        }
        let weather = Weather::new(&condition.weather, tick, seeds)
            .map_err(|error| RolloutError::Condition { name: condition.name.clone(), reason: error.to_string() })?;
        Ok(Self {
            plant: Plant::new(vehicle, variations),
            states,
            weather,
            pilots,
            rates,
            rotor_speed_max: vehicle.rotor_speed_max,
        })
    }

    fn fly(mut self) -> Vec<FlightRecord> {
        let divisor = self.rates.position_divisor as usize;
        let duration = 1.0 / f64::from(self.rates.control_hz);
        let ticks = self.pilots.iter().map(|pilot| pilot.plan.trajectory.samples.len()).max().unwrap_or(0) * divisor;
        let mut commands = [[0.0; BATCH]; 4];
        for tick in 0..ticks {
            for (member, pilot) in self.pilots.iter_mut().enumerate() {
                let state = self.states.member(member);
                let fractions = pilot.step(tick, divisor, &state);
                for (command, fraction) in commands.iter_mut().zip(fractions) {
                    command[member] = fraction * self.rotor_speed_max;
                }
            }
            self.plant.step(&mut self.states, &commands, self.weather.now(), duration);
            self.weather.advance();
        }
        self.pilots.into_iter().map(Pilot::finish).collect()
    }
}
