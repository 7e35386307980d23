//! What an add-on would have left of logged errors: flights on a model of the loop, with the disturbances of the log.
//!
//! *in* a model file, models of the axes, pieces of logs; *out* the error of each axis, as it was measured; *never* another
//! add-on than the firmware's; *source* superposition: what the model does not explain of a log comes again as it was, so that
//! without an add-on a model of the whole log gives the log back.
//!
//! Further delay of the whole loop is flown in this way: a loop that acts on reference minus measured position, and is told a
//! measurement older by d, is the identified one with the reference r + y(now) - y(now - d), and as much for the velocity where
//! it accepts one, which weighs against the position as the two references do.

use impromptu_firmware::{
    AddOn, Cap, Caps, Lanes, Scratch,
    guard::GuardSettings,
    model::{LargestModel, MAX_AXES, MAX_CHANNELS, MAX_OUTPUTS, Refusal},
};
use impromptu_training::feedback_design::ArxModel;

use crate::{
    layout::{Layout, write},
    reading::{AxisSignals, at},
    response::ratio_of_gains,
};

/// Most samples of the desired trajectory that an add-on on the host keeps.
const PREVIEW: usize = 1024;

/// The add-on of any loop, with a model of any size.
pub type HostAddOn<'m> = AddOn<'m, MAX_CHANNELS, MAX_CHANNELS, MAX_CHANNELS, PREVIEW, MAX_CHANNELS, MAX_OUTPUTS, MAX_AXES>;

/// How a flight differs from the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// Further delay of the whole loop, ticks.
    pub delay: usize,
    /// Factor on what the loop makes of a correction.
    pub gain: f64,
}

impl Case {
    /// As it was logged.
    pub const NOMINAL: Self = Self { name: "nominal", delay: 0, gain: 1.0 };
}

/// A piece of a log of all axes, flown on models of them.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    /// Of each axis the signals, all of one length.
    pub signals: Vec<&'a AxisSignals>,
    /// Of each axis the model.
    pub models: Vec<&'a ArxModel>,
    /// Of each axis what the velocity weighs beside the position where the loop acts on both, s.
    weights: Vec<f64>,
    /// Of each axis what the model does not explain of position and velocity.
    unexplained: Vec<Vec<[f64; 2]>>,
}

/// One step of a model.
fn next(model: &ArxModel, tick: usize, told: &[[f64; 2]], seen: &[[f64; 2]]) -> [f64; 2] {
    let mut found = [0.0; 2];
    for (value, equation) in found.iter_mut().zip([&model.position, &model.velocity]) {
        for lag in 0..model.lags() {
            let ([position, velocity], [reference, rate]) = (seen[tick - lag], told[tick - lag]);
            *value += equation.position[lag] * position
                + equation.velocity[lag] * velocity
                + equation.reference_position[lag] * reference
                + equation.reference_velocity[lag] * rate;
        }
    }
    found
}

impl<'a> Piece<'a> {
    /// A piece of a log for models of its axes.
    pub fn new(signals: Vec<&'a AxisSignals>, models: Vec<&'a ArxModel>, rate_hz: f64) -> Self {
        let unexplained = signals
            .iter()
            .zip(&models)
            .map(|(signals, model)| {
                let (told, seen) = pairs(signals);
                let first = model.lags() - 1;
                (0..signals.len())
                    .map(|tick| match (first..signals.len().saturating_sub(1)).contains(&tick) {
                        true => {
                            let [position, velocity] = next(model, tick, &told, &seen);
                            [seen[tick + 1][0] - position, seen[tick + 1][1] - velocity]
                        }
                        false => [0.0; 2],
                    })
                    .collect()
            })
            .collect();
        let weights = signals.iter().zip(&models).map(|(signals, model)| {
            let told = signals.reference_velocity.iter().any(|value| *value != 0.0);
            if told { ratio_of_gains(model, 1.0 / rate_hz) } else { signals.ratio }
        });
        let weights = weights.collect();
        Self { signals, models, weights, unexplained }
    }

    fn ticks(&self) -> usize {
        self.signals.iter().map(|signals| signals.len()).min().unwrap_or(0)
    }

    /// First tick that a model can predict.
    fn first(&self) -> usize {
        self.models.iter().map(|model| model.lags()).max().unwrap_or(1)
    }

    /// RMS error of each axis, as it was measured, from `settled` ticks on; without an add-on nothing but what is desired is the
    /// reference.
    pub fn errors(&self, case: Case, age_ticks: f64, settled: usize, flies: Option<&mut Flight<'_, '_>>) -> Vec<f64> {
        let (ticks, first) = (self.ticks(), self.first());
        let axes = self.signals.len();
        let mut told: Vec<Vec<[f64; 2]>> = Vec::with_capacity(axes);
        let mut seen: Vec<Vec<[f64; 2]>> = Vec::with_capacity(axes);
        for signals in &self.signals {
            let (t, s) = pairs(signals);
            told.push(t);
            seen.push(s);
        }
        let mut flies = flies;
        if let Some(flight) = &mut flies {
            flight.begin(first, self);
        }
        let mut squares = vec![0.0; axes];
        let mut judged = 0usize;
        for tick in first..ticks.saturating_sub(1) {
            let corrections = match &mut flies {
                Some(flight) => flight.step(tick, self, &seen, case.delay),
                None => vec![[0.0; 2]; axes],
            };
            let scored = tick >= first + settled;
            judged += usize::from(scored);
            for axis in 0..axes {
                let signals = self.signals[axis];
                let [position, _] = seen[axis][tick];
                let [moved, faster] = since(&seen[axis], tick, case.delay);
                let [delta, rate] = corrections[axis].map(|correction| case.gain * correction);
                // A combined reference takes the velocity's correction with the position's.
                let apart = if signals.ratio > 0.0 { 0.0 } else { rate };
                told[axis][tick] = [
                    signals.base[tick] + delta + signals.ratio * rate + moved + self.weights[axis] * faster,
                    signals.reference_velocity[tick] + apart,
                ];
                if scored {
                    squares[axis] += (position - at(&signals.desired, tick as f64 - age_ticks)).powi(2);
                }
                let [p, v] = next(self.models[axis], tick, &told[axis], &seen[axis]);
                let [more_p, more_v] = self.unexplained[axis][tick];
                seen[axis][tick + 1] = [p + more_p, v + more_v].map(|value| if value.abs() < 1e12 { value } else { 1e12 });
            }
        }
        squares.iter().map(|square| (square / judged.max(1) as f64).sqrt()).collect()
    }
}

/// What position and velocity have changed by in the last `delay` ticks, in means of two: what alternates from tick to tick is
/// noise, and how the loop answers to that no log shows.
fn since(seen: &[[f64; 2]], tick: usize, delay: usize) -> [f64; 2] {
    let mean = |tick: usize| [0, 1].map(|index| 0.5 * (seen[tick][index] + seen[tick.saturating_sub(1)][index]));
    let ([position, velocity], [older, slower]) = (mean(tick), mean(tick.saturating_sub(delay)));
    [position - older, velocity - slower]
}

fn pairs(signals: &AxisSignals) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let both = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| [*a, *b]).collect::<Vec<_>>();
    (both(&signals.reference, &signals.reference_velocity), both(&signals.measured, &signals.velocity))
}

/// The add-on with a model, for an application that lets corrections be as large as the model's limits.
///
/// # Errors
/// If the model runs at another rate, or looks further than the preview keeps.
pub fn host_add_on<'m>(model: &'m LargestModel<'m>, rate_hz: f64, lanes: Lanes) -> Result<Box<HostAddOn<'m>>, Refusal> {
    let card = model.card();
    let cap = |channel: usize| {
        let output = card.outputs.iter().find(|output| usize::from(output.channel) == channel);
        let [limit, rate] = output.map_or([1.0; 2], |output| [output.limit, output.slew * rate_hz as f32]);
        Cap { limit: limit.max(1e-6), rate: rate.max(1e-6) }
    };
    let channels: Vec<Cap> = (0..card.signals.reference.len()).map(cap).collect();
    let mut add_on = Box::new(HostAddOn::empty());
    add_on.load(model, &card.signals, rate_hz as f32, &Caps { channels: &channels, sums: &[] })?;
    add_on.switch(lanes);
    Ok(add_on)
}

/// A model in the firmware's add-on.
pub struct Flight<'m, 'l> {
    add_on: Box<HostAddOn<'m>>,
    scratch: Box<Scratch>,
    layout: &'l Layout,
    rate_hz: f64,
    ahead: i32,
}

impl<'m, 'l> Flight<'m, 'l> {
    /// A model for a loop of this layout and reference rate; the guard is on or off.
    ///
    /// # Errors
    /// If the model is for another loop.
    pub fn new(
        model: &'m LargestModel<'m>,
        layout: &'l Layout,
        rate_hz: f64,
        lanes: Lanes,
        guarded: bool,
    ) -> Result<Self, Refusal> {
        let mut add_on = host_add_on(model, rate_hz, lanes)?;
        if !guarded {
            add_on.set_guard(GuardSettings::OFF);
        }
        let ahead = model.card().preview_span().1 as i32;
        Ok(Self { add_on, scratch: Box::new(Scratch::new()), layout, rate_hz, ahead })
    }

    /// The trajectory from `first` on.
    fn begin(&mut self, first: usize, piece: &Piece<'_>) {
        let behind = self.add_on.model().map_or(0, |model| model.card().preview_span().0 as i32);
        let from = (first as i32 - behind).max(0);
        self.add_on.clear(from);
        let until = (first as i32 + self.ahead).min(from + PREVIEW as i32 - 1);
        for tick in from..=until {
            self.push(tick, piece);
        }
    }

    fn push(&mut self, tick: i32, piece: &Piece<'_>) {
        let last = piece.ticks() as i32 - 1;
        let at = tick.clamp(0, last) as usize;
        let mut desired = [0.0f32; MAX_CHANNELS];
        for (channels, signals) in self.layout.axes.iter().zip(&piece.signals) {
            let moving = (0..=last).contains(&tick);
            let (before, after) = (at.saturating_sub(1), (at + 1).min(last as usize));
            let steps = (after - before).max(1) as f64;
            let slope = (signals.desired_velocity[after] - signals.desired_velocity[before]) * self.rate_hz / steps;
            let [velocity, acceleration] = if moving { [signals.desired_velocity[at], slope] } else { [0.0; 2] };
            write(&mut desired, &channels.desired, &[signals.desired[at], velocity, acceleration]);
        }
        let _ = self.add_on.push(desired);
    }

    /// Corrections of position and velocity of the axes at a tick.
    fn step(&mut self, tick: usize, piece: &Piece<'_>, seen: &[Vec<[f64; 2]>], delay: usize) -> Vec<[f64; 2]> {
        while self.add_on.next_tick() <= tick as i32 + self.ahead {
            let tick = self.add_on.next_tick();
            self.push(tick, piece);
            if self.add_on.next_tick() == tick {
                break;
            }
        }
        let mut measured = [0.0f32; MAX_CHANNELS];
        for (channels, seen) in self.layout.axes.iter().zip(seen) {
            write(&mut measured, &channels.measured, &seen[tick.saturating_sub(delay)]);
        }
        let reference = self.add_on.step(tick as i32, &measured, &mut self.scratch);
        let desired = self.add_on.desired(tick as i32);
        self.layout
            .axes
            .iter()
            .map(|channels| {
                [0, 1].map(|derivative| match (channels.reference[derivative], channels.desired[derivative]) {
                    (Some(to), Some(from)) => f64::from(reference[usize::from(to)]) - f64::from(desired[usize::from(from)]),
                    _ => 0.0,
                })
            })
            .collect()
    }
}
