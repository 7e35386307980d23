//! The simulated closed position loop at hover, along one axis, as a linear system from one reference tick to the next.
//!
//! *in* a loop; *out* matrices of the state (plant, past measurements on their way, disturbance); *never* an equation of the
//! vehicle or of its controller written down again: plant and flight stack are differentiated as they are; *source* central
//! differences.

use std::array;

use impromptu_flight::{
    flight::{Flight, PREVIEW},
    types::{Setpoint, State as FirmwareState, Tick},
};
use impromptu_sim::{
    flights::Loop,
    plant::{BATCH, Disturbance, GRAVITY, Plant, State, States, Variation},
    rollout::RolloutError,
};
use nalgebra::{DMatrix, DVector};

/// One axis of the loop, in deviations from hover. With r the correction of the position reference (m) and y the position (m) and
/// velocity (m/s) as the loop and the add-on receive them at the same tick:
///
/// `x(k+1) = dynamics x(k) + input r(k) + from_measurement y(k) + w(k)`, `y(k) = measurement x(k) + n(k)`.
#[derive(Clone, Debug)]
pub struct HoverAxis {
    /// n x n.
    pub dynamics: DMatrix<f64>,
    /// n.
    pub input: DVector<f64>,
    /// n x 2.
    pub from_measurement: DMatrix<f64>,
    /// 2 x n.
    pub measurement: DMatrix<f64>,
    /// Covariance of w, n x n.
    pub process: DMatrix<f64>,
    /// Variances of n: position (m²), velocity (m²/s²).
    pub noise: [f64; 2],
}

/// Where the true position is in the state.
pub const POSITION: usize = 0;
const VELOCITY: usize = 1;
/// Rotors.
const ROTORS: usize = 4;
/// Half steps of the differences: 1 cm, 1 cm/s, 5 mrad (half of a rotation by 10 mrad), 0.02 rad/s, 1 rad/s: large against f32,
/// small against a radian.
const STEPS: [f64; 5] = [0.01, 0.01, 0.005, 0.02, 1.0];

/// The components of a state that move along an axis: position, velocity, quaternion and rate about the axis that tilts, rotors.
struct Components {
    axis: usize,
    /// Body axis about which the vehicle tilts; none for the vertical axis.
    tilt: Option<usize>,
}

impl Components {
    fn new(axis: usize) -> Self {
        Self { axis, tilt: [Some(1), Some(0), None][axis] }
    }

    /// Number of components.
    fn len(&self) -> usize {
        2 + ROTORS + if self.tilt.is_some() { 2 } else { 0 }
    }

    /// First rotor.
    fn rotors(&self) -> usize {
        self.len() - ROTORS
    }

    fn value<'a>(&self, state: &'a mut State, component: usize) -> &'a mut f64 {
        match (component, self.tilt) {
            (POSITION, _) => &mut state.position[self.axis],
            (VELOCITY, _) => &mut state.velocity[self.axis],
            (2, Some(tilt)) => &mut state.attitude[1 + tilt],
            (3, Some(tilt)) => &mut state.body_rates[tilt],
            _ => &mut state.rotor_speeds[component - self.rotors()],
        }
    }

    fn step(&self, component: usize) -> f64 {
        if component >= self.rotors() { STEPS[4] } else { STEPS[component] }
    }
}

/// A loop at hover.
struct Hover<'a> {
    closed_loop: &'a Loop,
    state: State,
    tick: f64,
}

impl Hover<'_> {
    /// The state a control tick later, under rotor commands and an acceleration.
    fn next(&self, state: &State, commands: [f64; ROTORS], axis: usize, acceleration: f64) -> State {
        let plant = Plant::new(&self.closed_loop.vehicle, [Variation::default(); BATCH]);
        let mut states = States::splat(state);
        let mut disturbance = Disturbance::default();
        let mut added = [0.0; 3];
        added[axis] = acceleration;
        for member in 0..BATCH {
            disturbance.set_member(member, [0.0; 3], added);
        }
        plant.step(&mut states, &commands.map(|command| [command; BATCH]), &disturbance, self.tick);
        states.member(0)
    }

    /// Rotor commands (rad/s) of the flight stack in a control tick with a reference tick.
    fn commands(&self, state: &State) -> Result<[f64; ROTORS], RolloutError> {
        let name = &self.closed_loop.vehicle.name;
        let refuse = || RolloutError::Airframe(format!("`{name}`: no vehicle has its settings; check its constants and gains"));
        let mut flight = Flight::new(&self.closed_loop.settings).ok_or_else(refuse)?;
        for _ in 0..PREVIEW / 2 {
            flight.push_setpoint(&Setpoint::default());
        }
        let single = |values: [f64; 3]| values.map(|value| value as f32);
        let known = FirmwareState::from_raw(
            single(state.position),
            single(state.velocity),
            state.attitude.map(|value| value as f32),
            single(state.body_rates),
        );
        let known = known.ok_or_else(refuse)?;
        let (command, _) = flight.control(Tick(0), &known);
        Ok(command.fractions().map(|fraction| f64::from(fraction) * self.closed_loop.vehicle.rotor_speed_max))
    }
}

/// Linearises the closed position loop of `closed_loop` along an axis (0, 1, 2: x, y, z). The delay of commands is not part of
/// it.
///
/// # Errors
/// If the vehicle cannot be flown.
pub fn linearise(closed_loop: &Loop, axis: usize) -> Result<HoverAxis, RolloutError> {
    let vehicle = &closed_loop.vehicle;
    let mut state = State::at_rest([0.0; 3]);
    state.rotor_speeds = [(vehicle.mass * GRAVITY / (4.0 * vehicle.thrust_coefficient)).sqrt(); ROTORS];
    let rates = closed_loop.settings.rates;
    let hover = Hover { closed_loop, state, tick: 1.0 / f64::from(rates.control_hz) };
    let parts = Components::new(axis);
    let count = parts.len();

    // What the stack commands against each component of what it is told, and the plant against state, commands, acceleration.
    let mut control = DMatrix::zeros(ROTORS, count);
    let mut plant_dynamics = DMatrix::zeros(count, count);
    for component in 0..count {
        let step = parts.step(component);
        let [low, high] = [-step, step].map(|step| {
            let mut state = hover.state;
            *parts.value(&mut state, component) += step;
            state
        });
        let (below, above) = (hover.commands(&low)?, hover.commands(&high)?);
        for rotor in 0..ROTORS {
            control[(rotor, component)] = (above[rotor] - below[rotor]) / (2.0 * step);
        }
        let [mut below, mut above] = [low, high].map(|state| hover.next(&state, hover.state.rotor_speeds, axis, 0.0));
        for row in 0..count {
            plant_dynamics[(row, component)] = (*parts.value(&mut above, row) - *parts.value(&mut below, row)) / (2.0 * step);
        }
    }
    // Rotor speeds are not measured: the stack's commands do not depend on them.
    let differences = |steps: [State; 2], step: f64| -> DVector<f64> {
        let [mut below, mut above] = steps;
        DVector::from_iterator(
            count,
            (0..count).map(|row| (*parts.value(&mut above, row) - *parts.value(&mut below, row)) / (2.0 * step)),
        )
    };
    let mut from_command = DMatrix::zeros(count, ROTORS);
    for rotor in 0..ROTORS {
        let step = STEPS[4];
        let moved = [-step, step].map(|step| {
            let mut commands = hover.state.rotor_speeds;
            commands[rotor] += step;
            hover.next(&hover.state, commands, axis, 0.0)
        });
        from_command.set_column(rotor, &differences(moved, step));
    }
    let step = 0.1;
    let from_disturbance = differences([-step, step].map(|a| hover.next(&hover.state, hover.state.rotor_speeds, axis, a)), step);
    Ok(lifted(closed_loop, &parts, &plant_dynamics, &from_command, &from_disturbance, &control))
}

/// From control ticks to reference ticks: the state with the measurements that are on their way and the disturbance.
fn lifted(
    closed_loop: &Loop,
    parts: &Components,
    plant_dynamics: &DMatrix<f64>,
    from_command: &DMatrix<f64>,
    from_disturbance: &DVector<f64>,
    control: &DMatrix<f64>,
) -> HoverAxis {
    let rates = closed_loop.settings.rates;
    let tick = 1.0 / f64::from(rates.control_hz);
    let late = (closed_loop.condition.measurement_delay_s / tick).round() as usize;
    let (count, size) = (parts.len(), parts.len() + 2 * late + 1);
    let disturbance = size - 1;
    let process = &closed_loop.condition.weather.acceleration;
    let decay = libm::exp(-tick / process.correlation_time);

    // Attitude and rates are fed back in every control tick, position and velocity through what the position loop last asked for.
    let mut inner = control.clone();
    inner.column_mut(POSITION).fill(0.0);
    inner.column_mut(VELOCITY).fill(0.0);
    inner.columns_mut(parts.rotors(), ROTORS).fill(0.0);
    let mut dynamics = DMatrix::zeros(size, size);
    dynamics.view_mut((0, 0), (count, count)).copy_from(&(plant_dynamics + from_command * &inner));
    dynamics.view_mut((0, disturbance), (count, 1)).copy_from(from_disturbance);
    dynamics[(disturbance, disturbance)] = decay;
    for lag in 0..late {
        for signal in 0..2 {
            let source = if lag == 0 { signal } else { count + 2 * (lag - 1) + signal };
            dynamics[(count + 2 * lag + signal, source)] = 1.0;
        }
    }
    let mut held = DMatrix::zeros(size, ROTORS);
    held.view_mut((0, 0), (count, ROTORS)).copy_from(from_command);

    // What each control tick adds: noise of attitude and rates through the commands, and the disturbance's own.
    let noise = &closed_loop.condition.noise;
    let mut added = DMatrix::zeros(size, size);
    if parts.tilt.is_some() {
        // A component of the quaternion is half an angle.
        for (component, sigma) in [(2, 0.5 * noise.attitude), (3, noise.body_rates)] {
            let column = DVector::from(&held * inner.column(component)) * sigma;
            added += &column * column.transpose();
        }
    }
    let sigma: f64 = process.sigma[parts.axis];
    added[(disturbance, disturbance)] = sigma * sigma * (1.0 - decay * decay);

    let mut power = DMatrix::identity(size, size);
    let mut from_held = DMatrix::zeros(size, ROTORS);
    let mut covariance = DMatrix::zeros(size, size);
    for _ in 0..rates.position_divisor {
        from_held += &power * &held;
        covariance += &power * &added * power.transpose();
        power = &dynamics * power;
    }
    let measured: [usize; 2] = array::from_fn(|signal| if late == 0 { signal } else { count + 2 * (late - 1) + signal });
    let mut measurement = DMatrix::zeros(2, size);
    for (row, column) in measured.into_iter().enumerate() {
        measurement[(row, column)] = 1.0;
    }
    let outer = control.columns(POSITION, 2).into_owned();
    HoverAxis {
        dynamics: power,
        // A reference that moves is a position that moves the other way.
        input: -(&from_held * outer.column(0)),
        from_measurement: &from_held * outer,
        measurement,
        process: covariance,
        noise: [noise.position * noise.position, noise.velocity * noise.velocity],
    }
}
