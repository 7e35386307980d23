//! The non-minimum-phase loop S2 with a window of the desired output: how much, on which signals, for how much preview.
//!
//! *in* a seed; *out* tracking errors of several feed-forward modules on signals of four kinds; *never* one of these signals in training, nor a
//! reference beyond the window's gain; *source* [`crate::siso::window`]. What counts is y - y_d while the trajectory lasts, from its first sample to
//! its last: the loop may start before it, as long as the preview reaches, and rests at zero before.

use impromptu_sim::trajectory::tones::smooth_step;
use rayon::prelude::*;

use super::PERIOD;
use crate::siso::{Module, Moment, Multisine, Run, Start, Window, fixtures, simulate, simulation::rms, window::offsets};

/// A desired output, zero before it starts.
pub struct Signal {
    /// Kind, the same for all of a kind.
    pub kind: &'static str,
    at: Box<dyn Fn(f64) -> f64 + Sync + Send>,
}

/// Length of every signal, s.
pub const SECONDS: f64 = 60.0;
/// Ridge of the learned window: what noise of 1 % in the logged outputs would do. Smooth signals hardly tell the taps apart; without it they are
/// large, and the corner at a trajectory's end goes through them.
pub const PENALTY: f64 = 1e-4;
/// Band of the references in training, Hz.
pub const BAND: [f64; 2] = [0.01, 1.0];

impl Signal {
    fn new(kind: &'static str, at: impl Fn(f64) -> f64 + Sync + Send + 'static) -> Self {
        Self { kind, at: Box::new(at) }
    }

    /// y_d at a time; held at its end.
    pub fn at(&self, seconds: f64) -> f64 {
        if seconds <= 0.0 { 0.0 } else { (self.at)(seconds.min(SECONDS)) }
    }
}

/// The paper's test, sums of sines slow to fast, smoothed steps, ramps.
pub fn signals(each: u64, seed: u64) -> Vec<Signal> {
    let mut signals = vec![Signal::new("the paper's test", fixtures::test_trajectory)];
    for index in 0..each {
        let seed = 55_000 + seed.wrapping_mul(100) + index;
        let slow = Multisine::random(5, [0.02, 0.1], 1.0, 1.0, seed);
        signals.push(Signal::new("sines 0.02-0.1 Hz", move |t| slow.risen(t, 10.0)));
        let fast = Multisine::random(5, [0.1, 0.4], 1.0, 1.0, seed + 20);
        signals.push(Signal::new("sines 0.1-0.4 Hz", move |t| fast.risen(t, 5.0)));
        let above = Multisine::random(5, [0.4, 0.9], 1.0, 0.0, seed + 40);
        signals.push(Signal::new("sines 0.4-0.9 Hz", move |t| above.risen(t, 5.0)));
        let levels = Multisine::random(6, [1.0, 2.0], 2.0, 0.0, seed + 60);
        let steps = levels.clone();
        signals.push(Signal::new("smoothed steps", move |t| {
            let moves = steps
                .tones
                .iter()
                .zip(0..)
                .map(|(tone, step)| (tone.amplitude * libm::cos(tone.phase), 4.0 + 9.0 * f64::from(step)));
            moves.map(|(height, start)| height * smooth_step((t - start) / 3.0)[0]).sum()
        }));
        signals.push(Signal::new("ramps", move |t| {
            let moves = levels
                .tones
                .iter()
                .zip(0..)
                .map(|(tone, ramp)| (tone.amplitude * libm::sin(tone.phase), 2.0 + 9.5 * f64::from(ramp)));
            // A stretch of constant speed with rounded corners of half a second.
            moves.map(|(height, start)| height * ramp(t - start, 6.0, 0.5)).sum()
        }));
    }
    signals
}

/// 0 to 1 in `time` s at constant speed, its corners rounded by an average over `corner` s.
fn ramp(t: f64, time: f64, corner: f64) -> f64 {
    let integral = |t: f64| {
        if t <= 0.0 {
            0.0
        } else if t < time {
            t * t / (2.0 * time)
        } else {
            t - time / 2.0
        }
    };
    (integral(t) - integral(t - corner)) / corner
}

/// RMS errors of a module on each signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Scheme {
    /// What chooses the reference.
    pub name: String,
    /// RMS of y - y_d on each signal.
    pub errors: Vec<f64>,
    /// Largest |u| on any signal.
    pub largest_reference: f64,
    /// Σ |weight|.
    pub gain: f64,
}

/// Runs of S2 under references of the training's kind.
pub fn training_runs(seed: u64) -> Vec<Run<f64>> {
    let system = fixtures::non_minimum_phase();
    (0..40)
        .into_par_iter()
        .map(|index| {
            let signal = Multisine::random(8, BAND, 1.0, 2.0, seed.wrapping_mul(1_000).wrapping_add(index));
            // A sudden start would be a pulse of 450 in the output, and the loudest row of all.
            let module = move |moment: &Moment<'_, f64>| signal.risen(moment.sample as f64 * PERIOD, 10.0);
            simulate(&system, &module, &|_| 0.0, &Start::rest(), 15_000)
        })
        .collect()
}

/// A window of `seconds` of preview, learned.
pub fn learn(runs: &[Run<f64>], seconds: f64) -> Option<Window> {
    Window::learn(runs, &offsets((seconds / PERIOD).round() as i64, PERIOD), 20, PENALTY)
}

/// One run: the trajectory starts after `lead` s. Errors count while it lasts.
pub fn track(module: &dyn Module<f64>, signal: &Signal, lead: f64) -> (Run<f64>, usize) {
    let (before, during) = ((lead / PERIOD).round() as usize, (SECONDS / PERIOD).round() as usize);
    let desired = |sample: i64| signal.at((sample - before as i64) as f64 * PERIOD);
    (simulate(&fixtures::non_minimum_phase(), module, &desired, &Start::rest(), before + during), before)
}

/// A window on all signals.
pub fn fly(name: &str, window: &Window, signals: &[Signal], lead: f64) -> Scheme {
    let runs: Vec<(f64, f64)> = signals
        .par_iter()
        .map(|signal| {
            let (run, before) = track(window, signal, lead);
            (
                rms(run.errors().into_iter().skip(before)),
                run.reference.iter().fold(0.0f64, |largest, value| largest.max(value.abs())),
            )
        })
        .collect();
    Scheme {
        name: name.into(),
        errors: runs.iter().map(|run| run.0).collect(),
        largest_reference: runs.iter().map(|run| run.1).fold(0.0, f64::max),
        gain: window.gain(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learned_window_is_bounded_and_better_than_the_desired_output_as_reference_on_every_signal() {
        let signals = signals(2, 1);
        let plain = fly("plain", &Window { taps: vec![(0, 1.0)] }, &signals, 0.0);
        let window = learn(&training_runs(1), 30.0).unwrap();
        let learned = fly("learned", &window, &signals, 30.0);
        for ((signal, learned), plain) in signals.iter().zip(&learned.errors).zip(&plain.errors) {
            assert!(*learned < 0.2 * plain, "{}: {learned} beside {plain}", signal.kind);
        }
        assert!(learned.largest_reference < 50.0, "{}", learned.largest_reference);
    }
}
