//! A nonlinear loop with a known law: the network against that law, ridge on the same features, and no add-on.
//!
//! *in* a seed; *out* tracking errors on the paper's test trajectory and on random ones; *never* a test trajectory in training;
//! *source* Zhou 2017, equations (6) and (7) and Insight 1a.

use rayon::prelude::*;

use super::PERIOD;
use crate::siso::{
    FeatureSet, LinearMap, Module, Moment, Multisine, NetworkModule, Rows, Start, fixtures,
    levenberg_marquardt::{self, train},
    nonlinear::InputAffine,
    samples::{Reference, sample},
    simulate,
    simulation::rms,
};

/// RMS errors on a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is tracked.
    pub signal: String,
    /// u of the network less u of the exact law, in the states of the network's own run.
    pub model: f64,
    /// y - y_d with the network.
    pub network: f64,
    /// With ridge.
    pub ridge: f64,
    /// With the exact law.
    pub exact: f64,
    /// With y_d as reference.
    pub plain: f64,
}

/// Random references that excite the loop from slow to fast.
pub(super) fn references(count: u64, amplitude: f64, offset: f64, seed: u64) -> Vec<(Reference, usize)> {
    (0..count)
        .map(|index| {
            let signal = Multisine::random(6, [0.05, 20.0], amplitude, offset, seed.wrapping_mul(1_000).wrapping_add(index));
            let reference: Reference = Box::new(move |sample| signal.at(sample as f64 * PERIOD));
            (reference, 1_200)
        })
        .collect()
}

/// Rows of the loop under random references.
pub fn rows(seed: u64) -> Rows {
    sample(&InputAffine, &FeatureSet::state_space(2, 1), &references(50, 2.0, 4.0, seed), 20, seed)
}

/// Trains on random references and flies the paper's test trajectory and `others` random ones.
pub fn run(settings: &levenberg_marquardt::Settings, others: u64, seed: u64) -> Vec<Trial> {
    let set = FeatureSet::state_space(2, 1);
    let rows = rows(seed);
    let fit = train(&rows, settings, seed);
    let Some(map) = LinearMap::fit(&rows, 1e-9) else { return Vec::new() };
    let mut signals: Vec<(String, Multisine)> = vec![("the paper's test".into(), Multisine { tones: Vec::new(), offset: 0.0 })];
    signals.extend((0..others).map(|index| {
        (format!("random {}", index + 1), Multisine::random(4, [0.03, 0.8], 0.8, 1.0, 77_000 + seed.wrapping_mul(100) + index))
    }));
    signals
        .into_par_iter()
        .map(|(signal, random)| {
            let desired = |sample: i64| {
                let seconds = sample as f64 * PERIOD;
                if random.tones.is_empty() { fixtures::test_trajectory(seconds) } else { random.risen(seconds, 2.0) }
            };
            let track = |module: &dyn Module<f64>| simulate(&InputAffine, module, &desired, &Start::rest(), 6_000);
            let network = track(&NetworkModule { set: &set, network: &fit.network });
            let model = rms((0..network.output.len())
                .map(|sample| network.reference[sample] - InputAffine.reference(&network.moment(sample, &desired))));
            Trial {
                signal,
                model,
                network: network.tracking_rms(0),
                ridge: track(&map.module(&set)).tracking_rms(0),
                exact: track(&InputAffine).tracking_rms(0),
                plain: track(&|moment: &Moment<'_, f64>| moment.desired(0)).tracking_rms(0),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_finds_the_nonlinear_law_that_a_linear_map_cannot() {
        let settings = levenberg_marquardt::Settings { units: 12, iterations: 80, ..Default::default() };
        for trial in run(&settings, 4, 1) {
            assert!(trial.exact < 1e-13, "{trial:?}");
            assert!(trial.network < 0.02 * trial.ridge.min(trial.plain), "{trial:?}");
        }
    }
}
