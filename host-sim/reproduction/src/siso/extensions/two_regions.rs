//! A loop whose relative degree and gain depend on the region: one module for all of it, two that switch hard, and two with the firmware's
//! selector.
//!
//! *in* a seed; *out* tracking errors, changes of region and the largest jump of the reference; *never* another selector than the firmware's;
//! *source* Zhou 2017, section III-A (several modules for several operating regions).

use std::cell::RefCell;

use impromptu_firmware::region::Selector;
use impromptu_sim::trajectory::tones::Tone;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::{PERIOD, input_affine::references};
use crate::siso::{
    FeatureSet, Module, Moment, Multisine, Network, NetworkModule, Rows, Start,
    levenberg_marquardt::{self, train},
    nonlinear::TwoRegions,
    samples::sample,
    simulate,
    simulation::rms,
};

/// Standard deviation of the measured output's noise.
pub const NOISE: f64 = 0.01;
/// Half of the width of the selector's hysteresis: six standard deviations of the noise.
pub const HYSTERESIS: f32 = 0.06;
/// Change-over of two modules, samples.
pub const FADE: u16 = 30;

/// What is compared.
pub const SCHEMES: [&str; 6] = [
    "y_d as reference",
    "one module, r = 1",
    "one module, r = 2",
    "one module, both previews",
    "two, switched hard",
    "two, hysteresis and fade",
];

/// A run of each scheme on a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is tracked.
    pub signal: String,
    /// RMS of y - y_d.
    pub error: [f64; 6],
    /// Largest change of the reference from one sample to the next.
    pub jump: [f64; 6],
    /// Changes of region of the last two.
    pub switches: [u32; 2],
}

/// Two modules and their selector as one.
struct Pair<'a> {
    modules: [NetworkModule<'a>; 2],
    selector: RefCell<Selector<2>>,
}

impl Module<f64> for Pair<'_> {
    fn reference(&self, moment: &Moment<'_, f64>) -> f64 {
        let wanted = self.modules.each_ref().map(|module| [module.reference(moment) as f32]);
        f64::from(self.selector.borrow_mut().step(moment.state(0) as f32, &wanted)[0])
    }
}

/// A module that sees the output with noise.
struct Noisy<'a> {
    module: &'a dyn Module<f64>,
    noise: &'a [f64],
}

impl Module<f64> for Noisy<'_> {
    fn reference(&self, moment: &Moment<'_, f64>) -> f64 {
        let noise = usize::try_from(moment.sample).ok().and_then(|sample| self.noise.get(sample)).copied().unwrap_or(0.0);
        let state = [moment.state(0) + noise, moment.state(1)];
        self.module.reference(&Moment { state: &state, ..*moment })
    }
}

/// The networks.
struct Modules {
    sets: [FeatureSet; 3],
    /// One for all with each set, then the lower and the upper region's.
    networks: [Network; 5],
}

fn learn(settings: &levenberg_marquardt::Settings, seed: u64) -> Modules {
    let mut both = FeatureSet::state_space(2, 2);
    both.features.extend(FeatureSet::state_space(2, 1).features.into_iter().skip(2));
    let sets = [FeatureSet::state_space(2, 1), FeatureSet::state_space(2, 2), both];
    let all = sets.each_ref().map(|set| sample(&TwoRegions, set, &references(60, 1.0, 2.5, seed), 40, seed));
    // Each region's module is also taught the half of the border's width that it serves.
    let within = |rows: &Rows, upper: bool| {
        let kept = (0..rows.targets.len()).filter(|&row| (rows.inputs[(row, 0)] > TwoRegions::BORDER) == upper);
        Rows::new(&kept.map(|row| (rows.inputs.row(row).iter().copied().collect(), rows.targets[row])).collect::<Vec<_>>())
    };
    let rows = vec![all[0].clone(), all[1].clone(), all[2].clone(), within(&all[0], false), within(&all[1], true)];
    let networks: Vec<Network> = rows.par_iter().map(|rows| train(rows, settings, seed).network).collect();
    let Ok(networks) = networks.try_into() else { unreachable!("as many networks as row sets") };
    Modules { sets, networks }
}

/// Trajectories: across the border and back, along the border within the noise, and random ones.
fn signals(others: u64, seed: u64) -> Vec<(String, Multisine)> {
    let tone = |amplitude, frequency, offset| {
        let tone = Tone { amplitude, rate: std::f64::consts::TAU * frequency, phase: 0.0 };
        Multisine { tones: vec![tone], offset }
    };
    let mut signals = vec![
        ("across the border".to_owned(), tone(0.8, 0.15, TwoRegions::BORDER)),
        ("along the border".to_owned(), tone(0.02, 0.1, TwoRegions::BORDER)),
    ];
    signals.extend((0..others).map(|index| {
        let mut signal = Multisine::random(3, [0.05, 0.6], 0.5, 0.4, 91_000 + seed.wrapping_mul(100) + index);
        signal.offset += TwoRegions::BORDER;
        (format!("random {}", index + 1), signal)
    }));
    signals
}

/// Trains all modules and flies each scheme.
pub fn run(settings: &levenberg_marquardt::Settings, others: u64, seed: u64) -> Vec<Trial> {
    let modules = learn(settings, seed);
    let pair = |hysteresis: f32, fade: u16| -> Pair<'_> {
        let Ok(selector) = Selector::new([f32::NEG_INFINITY, TwoRegions::BORDER as f32], hysteresis, fade) else {
            unreachable!("two regions with a finite border")
        };
        Pair {
            modules: [(0, 3), (1, 4)]
                .map(|(set, network)| NetworkModule { set: &modules.sets[set], network: &modules.networks[network] }),
            selector: RefCell::new(selector),
        }
    };
    let fly = |(index, (signal, random)): (usize, (String, Multisine))| {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(31).wrapping_add(index as u64));
        let noise: Vec<f64> = (0..4_000).map(|_| NOISE * generator.sample::<f64, _>(StandardNormal)).collect();
        let desired = |sample: i64| random.risen(sample as f64 * PERIOD, 2.0);
        let (hard, soft) = (pair(0.0, 0), pair(HYSTERESIS, FADE));
        let plain = |moment: &Moment<'_, f64>| moment.desired(0);
        let single = [0, 1, 2].map(|index| NetworkModule { set: &modules.sets[index], network: &modules.networks[index] });
        let schemes: [&dyn Module<f64>; 6] = [&plain, &single[0], &single[1], &single[2], &hard, &soft];
        let runs = schemes.map(|module| {
            let run = simulate(&TwoRegions, &Noisy { module, noise: &noise }, &desired, &Start::rest(), 4_000);
            let jump = run.reference.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            (rms(run.errors()), jump)
        });
        let switches = [hard.selector.borrow().switches(), soft.selector.borrow().switches()];
        Trial { signal, error: runs.map(|run| run.0), jump: runs.map(|run| run.1), switches }
    };
    signals(others, seed).into_iter().enumerate().collect::<Vec<_>>().into_par_iter().map(fly).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::siso::extensions::mean_and_worst;

    #[test]
    fn two_modules_serve_two_regions_better_than_one_and_the_selector_takes_the_bumps_away() {
        let settings = levenberg_marquardt::Settings { units: 12, iterations: 60, ..Default::default() };
        let trials = run(&settings, 2, 5);
        let of = |scheme: usize| mean_and_worst(trials.iter().map(|trial| trial.error[scheme]));
        let faded = of(5);
        for (single, name) in SCHEMES.iter().enumerate().take(4) {
            assert!(faded.0 < of(single).0, "{name}: {trials:#?}");
        }
        // Along the border a fade costs less than hard switching, which chatters.
        assert!(faded.1 < of(4).1, "{trials:#?}");
        for trial in &trials {
            // Without noise a module's own reference moves too.
            assert!(trial.jump[5] < 0.5 * trial.jump[4], "{trial:#?}");
            assert!(2 * trial.switches[1] < trial.switches[0], "{trial:#?}");
        }
    }
}
