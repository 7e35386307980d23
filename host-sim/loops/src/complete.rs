//! Feedback lane and monitor beside a network lane, whatever that was trained by, and what all of it will do.
//!
//! *in* logs that are ready and a way to make model files; *out* lane, monitor, predictions; *never* a lane that the logs kept
//! apart have not judged; *source* `impromptu-training`, which does this for a simulated vehicle.

use impromptu_diagnosis::prediction::root_mean_square;
use impromptu_firmware::Lanes;
use impromptu_model_export::{
    ExportError,
    description::{LaneDescription, MonitorAxisDescription, MonitorDescription},
};
use impromptu_training::feedback_design::response::box_responses;
use serde::Serialize;

use crate::{
    candidates::{DesignAxis, authority, lane_of},
    description::LoopDescription,
    design::{Chosen, Judge},
    layout::Layout,
    prepared::Prepared,
    reading::AxisSignals,
};

/// Makes a model file with a lane and a monitor.
pub type Encode<'a> = dyn Fn(Option<&LaneDescription>, Option<&MonitorDescription>) -> Result<Vec<u8>, ExportError> + Sync + 'a;

/// What a lane and a monitor are made for.
pub struct Request<'a> {
    /// The loop.
    pub described: &'a LoopDescription,
    /// Its signals.
    pub layout: &'a Layout,
    /// Its logs.
    pub prepared: &'a Prepared,
    /// Age of what is measured, s.
    pub age_s: f64,
    /// Time in which a lane fades in, s.
    pub fade_s: f64,
    /// Models of which lanes are judged beside the likeliest.
    pub draws: usize,
    /// Of each axis the output of its velocity's correction, if the network has one. Positions are the first outputs.
    pub velocity_outputs: Vec<Option<u8>>,
    /// Makes a model file.
    pub encode: &'a Encode<'a>,
}

/// What was found of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct AxisFit {
    /// Name.
    pub axis: String,
    /// Unit.
    pub unit: String,
    /// Time in which a step of the position reference has been followed to 63 %, s.
    pub time_constant_s: f64,
    /// RMS error of the logs kept apart without the add-on, as measured.
    pub error: f64,
    /// The same with the network lane.
    pub with_network: f64,
    /// The same with both.
    pub with_both: f64,
    /// Reduction by all lanes that there are, guard on: of the logs on all models, and 95 % limits of the mean of five flights of
    /// the logs' kind, %.
    pub reduction_percent: [f64; 3],
    /// Design of the feedback lane.
    pub lane: Option<String>,
    /// Why there is none.
    pub refusal: Option<String>,
}

/// Lane and monitor, and what they will do.
#[derive(Clone, Debug)]
pub struct Completed {
    /// Feedback lane of those axes that have one.
    pub lane: Option<LaneDescription>,
    /// Monitor of those axes whose logs show what a correction does.
    pub monitor: Option<MonitorDescription>,
    /// Of each axis what was found.
    pub axes: Vec<AxisFit>,
}

impl Completed {
    /// The lanes in words, axis by axis.
    pub fn words(&self) -> String {
        let of_axis = |fit: &AxisFit| match (&fit.lane, &fit.refusal) {
            (Some(design), _) => format!("{}: feedback lane: {design}", fit.axis),
            (None, reason) => format!("{}: no feedback lane: {}", fit.axis, reason.as_deref().unwrap_or_default()),
        };
        self.axes.iter().map(of_axis).collect::<Vec<_>>().join("; ")
    }
}

/// What a monitor's response lasts, time constants.
const MONITORED: f64 = 3.2;
/// Taps of the monitor.
const TAPS: usize = 32;
/// Logs kept apart by which lanes are judged.
const PIECES: usize = 8;

/// Lane and monitor.
///
/// # Errors
/// If a model cannot be made.
pub fn complete(request: &Request<'_>) -> Result<Completed, ExportError> {
    let Request { described, layout, prepared, draws, encode, .. } = request;
    let axes: Vec<DesignAxis<'_>> = prepared
        .axes
        .iter()
        .enumerate()
        .map(|(place, axis)| DesignAxis { models: &axis.models, scale: axis.scale, settings: axis.design.clone(), place })
        .collect();
    // Where only some axes are trained, what is judged are these.
    let judged =
        Layout { signals: layout.signals.clone(), axes: prepared.axes.iter().map(|axis| layout.axes[axis.place]).collect() };
    let pieces: Vec<Vec<&AxisSignals>> = {
        let count = prepared.axes.iter().map(|axis| axis.split.apart.len()).min().unwrap_or(0).min(PIECES);
        (0..count).map(|index| prepared.axes.iter().map(|axis| &axis.split.apart[index]).collect()).collect()
    };
    let count = pieces.len();
    let without_monitor = |lane: Option<&LaneDescription>| encode(lane, None);
    let judge_of = |pieces| Judge {
        layout: &judged,
        rate_hz: prepared.model_hz,
        age_ticks: request.age_s * prepared.model_hz,
        settled: (request.fade_s * prepared.model_hz).ceil() as usize,
        pieces,
        encode: &without_monitor,
    };
    // How flights differ from each other the logs that were fitted tell as well as the others.
    let fitted = prepared.axes.iter().map(|axis| axis.split.training.len()).min().unwrap_or(0).min(PIECES);
    let fitted = (0..fitted).map(|index| prepared.axes.iter().map(|axis| &axis.split.training[index]).collect::<Vec<_>>());
    let everything = judge_of(pieces.iter().cloned().chain(fitted).collect());
    let judge = judge_of(pieces);
    let benches = judge.benches(&axes, *draws);
    let lanes = judge.choose(&axes, &benches)?;
    let found: Vec<&Chosen> = lanes.iter().filter_map(|lane| lane.as_ref().ok()).collect();
    let lane = (!found.is_empty()).then(|| {
        let parts: Vec<_> = found.iter().map(|chosen| (&chosen.lane, chosen.margins)).collect();
        lane_of(&parts, authority(&judged, &axes, prepared.model_hz))
    });
    let model = encode(lane.as_ref(), None)?;
    let both = judge.predicted(&benches, (&model, Lanes::BOTH), false)?;
    let network = judge.predicted(&benches[..1], (&model, Lanes { network: true, feedback: false }), false)?;
    let monitor = monitor(request, validated_rms(&both, count) as f32);
    let guarded = encode(lane.as_ref(), monitor.as_ref())?;
    let foreseen = everything.predicted(&everything.benches(&axes, *draws), (&guarded, Lanes::BOTH), true)?;
    let pieces = everything.pieces.len();
    let fits = prepared.axes.iter().zip(lanes).enumerate().map(|(index, (axis, lane))| {
        let (flights, described) = (&both[index], &described.axes[axis.place]);
        let (lane, refusal) = match lane {
            Ok(chosen) => (Some(chosen.design), None),
            Err(reason) => (None, Some(reason.to_string())),
        };
        AxisFit {
            axis: described.name.clone(),
            unit: described.unit.clone(),
            time_constant_s: axis.time_constant_s,
            error: root_mean_square(flights.iter().map(|[baseline, _]| *baseline)),
            with_network: root_mean_square(network[index].iter().map(|[_, with]| *with)),
            with_both: root_mean_square(flights.iter().map(|[_, with]| *with)),
            reduction_percent: interval(&foreseen[index], pieces),
            lane,
            refusal,
        }
    });
    Ok(Completed { axes: fits.collect(), lane, monitor })
}

/// Standard deviation of the natural logarithm of what is left, as flown over as predicted, that neither models nor logs show:
/// friction that few logs hold, a flight that the guard ends. So large that 54 of 56 generated loops were within the limits.
const BEYOND_MODELS: f64 = 0.9;
/// Flights whose mean is predicted.
const FLIGHTS: f64 = 5.0;

/// Mean reduction, %, and 95 % limits of that of some flights; flights of each model, one after another, of so many pieces each.
fn interval(flights: &[[f64; 2]], pieces: usize) -> [f64; 3] {
    let left: Vec<f64> = flights.iter().map(|[baseline, with]| (with.max(1e-12) / baseline.max(1e-12)).ln()).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let variance = |values: &[f64]| {
        let middle = mean(values);
        values.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / (values.len().max(2) - 1) as f64
    };
    let pieces = pieces.max(1);
    let models: Vec<f64> = left.chunks(pieces).map(mean).collect();
    let flown: Vec<f64> =
        (0..pieces).map(|piece| mean(&left.iter().skip(piece).step_by(pieces).copied().collect::<Vec<_>>())).collect();
    let (middle, count) = (mean(&left), pieces as f64);
    let spread = (variance(&flown) * (1.0 / count + 1.0 / FLIGHTS) + variance(&models) + BEYOND_MODELS.powi(2)).sqrt();
    let reduction = |left: f64| 100.0 * (1.0 - left.exp());
    [reduction(middle), reduction(middle + 1.96 * spread), reduction(middle - 1.96 * spread)]
}

/// Median over the logs kept apart of the RMS error of all axes together, on the likeliest models.
fn validated_rms(flights: &[Vec<[f64; 2]>], pieces: usize) -> f64 {
    let of_piece =
        |index: usize| flights.iter().filter_map(|axis| axis.get(index)).map(|[_, with]| with * with).sum::<f64>().sqrt();
    let mut all: Vec<f64> = (0..pieces).map(of_piece).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// The response to its corrections of each axis whose logs show it; errors of one unit only can be added up.
fn monitor(request: &Request<'_>, validated_rms: f32) -> Option<MonitorDescription> {
    let Request { described, layout, prepared, .. } = request;
    let ticks = MONITORED * prepared.time_constants_s[1] * prepared.model_hz;
    let divisor = ((ticks / TAPS as f64).ceil() as usize).max(1);
    let unit = |place: usize| &described.axes[place].unit;
    let first = prepared.axes.first().map_or(0, |axis| axis.place);
    let narrow = |taps: &[f64], factor: f64| taps.iter().map(|tap| (tap * factor) as f32).collect::<Vec<f32>>();
    let axes =
        prepared.axes.iter().zip(0u8..).filter(|(axis, _)| unit(axis.place) == unit(first)).filter_map(|(axis, output)| {
            axis.models.data.excitation().require(axis.design.least_excitation).ok()?;
            let [of_position, of_velocity] = box_responses(&axis.models.whole, divisor, TAPS);
            let channels = &layout.axes[axis.place];
            let (mut inputs, mut taps) = (vec![output], vec![narrow(&of_position, 1.0)]);
            if let Some(velocity) = request.velocity_outputs.get(usize::from(output)).copied().flatten() {
                inputs.push(velocity);
                // One reference was made of two: what the velocity does is what the position does, times what it weighs.
                taps.push(if axis.ratio > 0.0 { narrow(&of_position, axis.ratio) } else { narrow(&of_velocity, 1.0) });
            }
            Some(MonitorAxisDescription { error: (channels.measured[0]?, channels.desired[0]?), inputs, taps })
        });
    let axes: Vec<MonitorAxisDescription> = axes.collect();
    (!axes.is_empty()).then_some(MonitorDescription { divisor: divisor as u16, validated_rms, axes })
}
