//! The windows of a loop's axes as a network, and what a model of it says of itself.
//!
//! *in* windows, a description, rates; *out* a network that is all skip, rows of its features, a [`Description`]; *never* limits
//! far above the corrections of the logs, or above the application's caps; *source* the field list of the model format.

use impromptu_firmware::{
    features::{Feature, Relative, Source},
    model::{Interpolation, Output},
};
use impromptu_model_export::{
    Description, FloatNetwork,
    description::{LaneDescription, MonitorDescription, Provenance, Timing},
};

use crate::{
    description::LoopDescription,
    layout::Layout,
    prepared::{PreparedAxis, Split},
    reading::AxisSignals,
    window::{Window, relative},
};

/// Limits above the largest correction of the logs.
const LIMIT_FACTOR: f64 = 1.5;
/// Ticks in which a correction crosses its range.
const SLEW_TICKS: f64 = 5.0;
/// Rows for probes.
const ROWS: usize = 64;

/// What a description is made of.
pub struct Maker<'a> {
    /// The loop.
    pub described: &'a LoopDescription,
    /// Its signals.
    pub layout: &'a Layout,
    /// Axes that are trained.
    pub axes: &'a [PreparedAxis],
    /// Their windows.
    pub windows: &'a [Window],
    /// Name of the model.
    pub name: &'a str,
    /// Seed of everything random.
    pub seed: u64,
    /// Age of what is measured, s.
    pub age_s: f64,
    /// Rate of the references, Hz.
    pub model_hz: f64,
    /// Reference ticks in a sub-rate tick.
    pub sub: u16,
    /// Time in which a lane fades in, s.
    pub fade_s: f64,
}
impl Maker<'_> {
    fn features(&self) -> Vec<Feature> {
        let sub = i32::from(self.sub);
        let of_axis = |(axis, window): (&PreparedAxis, &Window)| {
            let channel = self.layout.axes[axis.place].desired[0].unwrap_or(0);
            let feature = |(offset, _): &(i32, f64)| Feature {
                source: Source::Desired,
                channel,
                offset: (offset / sub) as i16,
                relative: Relative::Desired(channel),
            };
            window.weights.iter().map(feature).collect::<Vec<_>>()
        };
        self.axes.iter().zip(self.windows).flat_map(of_axis).collect()
    }

    /// The windows as a network that is all skip, and rows of its features.
    pub fn network(&self) -> (FloatNetwork, Vec<Vec<f32>>) {
        let input_scale: Vec<f32> = self.envelope().iter().map(|(low, high)| low.abs().max(high.abs()).max(1e-9)).collect();
        let output_scale: Vec<f32> = self.windows.iter().map(|window| (window.largest as f32).max(1e-9)).collect();
        let inputs = input_scale.len();
        let mut skip = vec![0.0f32; inputs * self.windows.len()];
        let mut input = 0;
        for (output, window) in self.windows.iter().enumerate() {
            for (_, weight) in &window.weights {
                skip[output * inputs + input] = *weight as f32 * input_scale[input] / output_scale[output];
                input += 1;
            }
        }
        let network = FloatNetwork {
            input_mean: vec![0.0; inputs],
            input_scale,
            layers: Vec::new(),
            skip: Some(skip),
            output_mean: self.windows.iter().map(|window| window.constant as f32).collect(),
            output_scale,
            notes: Default::default(),
        };
        let shortest = self.axes.iter().flat_map(|axis| &axis.split.training).map(AxisSignals::len).min().unwrap_or(1);
        let rows = (0..shortest).step_by((shortest / ROWS).max(1)).map(|tick| {
            let of_axis = |(split, window): (&Split, &Window)| {
                let offsets: Vec<i32> = window.weights.iter().map(|(offset, _)| *offset).collect();
                relative(&split.training[0].desired, &offsets, tick).into_iter().map(|value| value as f32).collect::<Vec<_>>()
            };
            self.axes.iter().map(|axis| &axis.split).zip(self.windows).flat_map(of_axis).collect()
        });
        (network, rows.collect())
    }

    fn envelope(&self) -> Vec<(f32, f32)> {
        self.windows.iter().flat_map(|window| &window.envelope).map(|(low, high)| (*low as f32, *high as f32)).collect()
    }

    fn outputs(&self, lane: Option<&LaneDescription>) -> Vec<Output> {
        let of_axis = |(output, (prepared, window)): (usize, (&PreparedAxis, &Window))| {
            let axis = &self.described.axes[prepared.place];
            let of_lane = lane.and_then(|lane| lane.axes.iter().find(|axis| usize::from(axis.output) == output));
            let feedback = of_lane.map_or(0.0, |axis| f64::from(axis.fast_limit + axis.integral_limit));
            let limit = (LIMIT_FACTOR * window.largest + feedback).min(axis.cap.unwrap_or(f64::INFINITY));
            let slew = (limit / SLEW_TICKS).min(axis.cap_rate.map_or(f64::INFINITY, |rate| rate / self.model_hz));
            Output { channel: self.layout.axes[prepared.place].reference[0].unwrap_or(0), limit: limit as f32, slew: slew as f32 }
        };
        self.axes.iter().zip(self.windows).enumerate().map(of_axis).collect()
    }

    /// A description with a lane and a monitor.
    pub fn description(&self, lane: Option<&LaneDescription>, monitor: Option<MonitorDescription>, remarks: &str) -> Description {
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        for (_, weight) in self.windows.iter().flat_map(|window| &window.weights) {
            digest.update(&weight.to_le_bytes());
        }
        Description {
            name: self.name.into(),
            provenance: Provenance {
                vehicle: self.described.name.clone(),
                gains: "its own".into(),
                condition: "its logs".into(),
                software: format!("host-sim {}", env!("CARGO_PKG_VERSION")),
                seed: self.seed,
                data_crc: digest.finalize(),
                remarks: remarks.into(),
            },
            signals: self.layout.signals.clone(),
            timing: Timing {
                reference_rate_hz: self.model_hz as f32,
                divisor: self.sub,
                interpolation: Interpolation::Linear,
                measurement_delay_s: self.age_s as f32,
                fade_s: self.fade_s as f32,
            },
            features: self.features(),
            outputs: self.outputs(lane),
            envelope: self.envelope(),
            feedback_lane: lane.cloned(),
            monitor,
            tie: None,
        }
    }
}
