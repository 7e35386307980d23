//! Description and network to the bytes of a model file.

use impromptu_firmware::{
    feedback,
    model::{
        self, Arithmetic, Authority, Channel, FeedbackAxis, FeedbackLayout, LargestCard as Card, LargestModel as Model,
        LayerLayout, MonitorAxis, MonitorLayout, NetworkLayout, Probes, Refusal, Section, SignalTable, file,
    },
    network::{self, Network, Scratch, kernel::Width},
};

use crate::{
    bounds::bounds,
    description::{ChannelDescription, Description},
    export_error::ExportError,
    float_network::{Activation, DenseLayer, FloatNetwork},
    packing,
    quantise::quantise,
    stored_network::StoredNetwork,
};

/// Number format of the dense layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32 weights and activations.
    Float,
    /// int8 weights, activations of up to 16 bits.
    Int8,
    /// int16 weights, activations of up to 16 bits.
    Int16,
}

/// Bulk numbers in file order, each section aligned.
#[derive(Default)]
struct BlobWriter(Vec<u8>);

impl BlobWriter {
    fn bytes(&mut self, bytes: impl IntoIterator<Item = u8>) -> Section {
        self.0.resize(self.0.len().next_multiple_of(file::ALIGNMENT), 0);
        let offset = self.0.len();
        self.0.extend(bytes);
        Section { offset: offset as u32, length: (self.0.len() - offset) as u32 }
    }

    fn floats(&mut self, values: impl IntoIterator<Item = f32>) -> Section {
        self.bytes(values.into_iter().flat_map(f32::to_le_bytes))
    }

    fn words(&mut self, words: Vec<u32>) -> Section {
        self.bytes(words.into_iter().flat_map(u32::to_le_bytes))
    }
}

fn bounded<T: Clone, const N: usize>(values: &[T], what: &'static str) -> Result<heapless::Vec<T, N>, ExportError> {
    heapless::Vec::from_slice(values).map_err(|_| ExportError::TooMany { what, found: values.len(), limit: N })
}

fn within(found: usize, what: &'static str, limit: usize) -> Result<(), ExportError> {
    if found <= limit { Ok(()) } else { Err(ExportError::TooMany { what, found, limit }) }
}

fn matching(what: &'static str, expected: usize, found: usize) -> Result<(), ExportError> {
    if found == expected { Ok(()) } else { Err(ExportError::Mismatch { what, expected, found }) }
}

fn activation(activation: Activation) -> network::Activation {
    match activation {
        Activation::Linear => network::Activation::Linear,
        Activation::Relu => network::Activation::Relu,
        Activation::Tanh => network::Activation::Tanh,
    }
}

/// Lays a network out for the kernel.
fn layout(
    network: &FloatNetwork,
    precision: Precision,
    calibration: &[Vec<f32>],
    envelope: &[(f32, f32)],
    blob: &mut BlobWriter,
) -> Result<NetworkLayout, ExportError> {
    let reciprocal = network.input_scale.iter().map(|scale| 1.0 / scale);
    let mut layout = NetworkLayout {
        arithmetic: Arithmetic::Float,
        input_normalisation: blob.floats(network.input_mean.iter().copied().chain(reciprocal)),
        input_code: 0.0,
        layers: heapless::Vec::new(),
        skip: Section::default(),
        output_normalisation: blob.floats(network.output_scale.iter().chain(&network.output_mean).copied()),
    };
    if let Some(skip) = &network.skip {
        layout.skip = blob.words(packing::float(skip, &vec![0.0; network.outputs()], network.inputs()));
    }
    let mut layers = Vec::new();
    // Before any count is narrowed to the file's integers.
    within(network.layers.len(), "dense layers", model::MAX_LAYERS)?;
    network.layers.iter().try_for_each(|layer| within(layer.outputs(), "units in a layer", model::MAX_WIDTH))?;
    let mut inputs = network.inputs();
    let mut layer = |source: &DenseLayer, input_limit: u16, rows: Section| {
        let (from, outputs) = (inputs as u16, source.outputs() as u16);
        inputs = source.outputs();
        layers.push(LayerLayout { inputs: from, outputs, activation: activation(source.activation), input_limit, rows });
    };
    let width = match precision {
        Precision::Float => None,
        Precision::Int8 => Some((Width::Int8, Arithmetic::Int8)),
        Precision::Int16 => Some((Width::Int16, Arithmetic::Int16)),
    };
    match width {
        None => {
            for source in &network.layers {
                let count = source.weights.len() / source.outputs().max(1);
                layer(source, 0, blob.words(packing::float(&source.weights, &source.bias, count)));
            }
        }
        Some((width, arithmetic)) => {
            if calibration.is_empty() && !network.layers.is_empty() {
                return Err(ExportError::NoCalibration);
            }
            let integers = quantise(network, width, calibration.iter().map(Vec::as_slice), envelope);
            layout.arithmetic = arithmetic;
            layout.input_code = integers.input_code;
            for (index, (source, integer)) in network.layers.iter().zip(&integers.layers).enumerate() {
                if let Some(row) = integer.multipliers.iter().position(|multiplier| *multiplier == i32::MAX) {
                    return Err(ExportError::Steep { layer: index, row });
                }
                layer(source, integer.input_limit, blob.words(packing::integer(integer, width)));
            }
        }
    }
    layout.layers = bounded(&layers, "dense layers")?;
    Ok(layout)
}

fn channels<'a, const N: usize>(
    channels: &'a [ChannelDescription],
    what: &'static str,
) -> Result<heapless::Vec<Channel<'a>, N>, ExportError> {
    let borrowed: Vec<Channel<'a>> = channels
        .iter()
        .map(|channel| Channel { name: &channel.name, unit: &channel.unit, frame: &channel.frame, end: channel.end })
        .collect();
    bounded(&borrowed, what)
}

fn lane(description: &Description, blob: &mut BlobWriter) -> Result<Option<FeedbackLayout<{ model::MAX_AXES }>>, ExportError> {
    let Some(lane) = &description.feedback_lane else { return Ok(None) };
    let lags = lane.axes.first().map_or(0, |axis| axis.output_coefficients.len());
    within(lags, "lags of the feedback lane", model::MAX_LAGS)?;
    let mut axes = Vec::new();
    for axis in &lane.axes {
        matching(
            "lists of error coefficients of a lane axis (one for each error)",
            axis.errors.len(),
            axis.error_coefficients.len(),
        )?;
        for found in axis.error_coefficients.iter().chain([&axis.output_coefficients]).map(Vec::len) {
            matching("lags of the feedback lane (as many as the first axis' own)", lags, found)?;
        }
        let coefficients = axis.error_coefficients.iter().flatten().chain(&axis.output_coefficients).copied();
        axes.push(FeedbackAxis {
            output: axis.output,
            errors: bounded(&axis.errors, "errors of a lane axis")?,
            coefficients: blob.floats(coefficients),
            integral: axis.integral,
            fast_limit: axis.fast_limit,
            integral_limit: axis.integral_limit,
        });
    }
    let authority = Authority {
        channels: bounded(&lane.authority.channels, "lane authority channels")?,
        scale: lane.authority.scale,
        error_scale: lane.authority.error_scale,
        decay: lane.authority.decay,
    };
    Ok(Some(FeedbackLayout { lags: lags as u8, axes: bounded(&axes, "lane axes")?, authority, margins: lane.margins }))
}

fn monitor(description: &Description, blob: &mut BlobWriter) -> Result<Option<MonitorLayout<{ model::MAX_AXES }>>, ExportError> {
    let Some(monitor) = &description.monitor else { return Ok(None) };
    let taps = monitor.axes.iter().flat_map(|axis| &axis.taps).map(Vec::len).next().unwrap_or(1);
    within(taps, "taps of the monitor", model::MAX_TAPS)?;
    let mut axes = Vec::new();
    for axis in &monitor.axes {
        matching("lists of taps of a monitor axis (one for each input)", axis.inputs.len(), axis.taps.len())?;
        for found in axis.taps.iter().map(Vec::len) {
            matching("taps of the monitor (as many as the first input's)", taps, found)?;
        }
        axes.push(MonitorAxis {
            error: axis.error,
            inputs: bounded(&axis.inputs, "inputs of a monitor axis")?,
            taps: blob.floats(axis.taps.iter().flatten().copied()),
        });
    }
    let axes = bounded(&axes, "monitor axes")?;
    Ok(Some(MonitorLayout { divisor: monitor.divisor, taps: taps as u8, validated_rms: monitor.validated_rms, axes }))
}

/// The bytes of a model file. `calibration` are rows of features in physical units: ranges of the integer network and probes come
/// from them. A description without a network (`None`) makes a file with the feedback lane alone.
///
/// # Errors
/// If parts do not fit together, or the firmware would refuse the file.
pub fn encode(
    description: &Description,
    network: Option<&FloatNetwork>,
    precision: Precision,
    calibration: &[Vec<f32>],
) -> Result<Vec<u8>, ExportError> {
    let features = description.features.len();
    if let Some(network) = network {
        network.check()?;
        matching("inputs of the network (one for each feature)", features, network.inputs())?;
        matching("outputs of the network (one for each of the description)", description.outputs.len(), network.outputs())?;
    }
    matching("ranges of the envelope (one for each feature)", features, description.envelope.len())?;
    for (index, row) in calibration.iter().enumerate() {
        matching("columns of the calibration rows (one for each feature)", features, row.len())?;
        if let Some(column) = row.iter().position(|value| !value.is_finite()) {
            return Err(ExportError::CalibrationNotFinite { row: index + 1, column: column + 1 });
        }
    }
    let mut blob = BlobWriter::default();
    let float = network;
    let network = network.map(|network| layout(network, precision, calibration, &description.envelope, &mut blob)).transpose()?;
    let lane = lane(description, &mut blob)?;
    let monitor = monitor(description, &mut blob)?;
    let minima = description.envelope.iter().map(|(low, _)| *low);
    let maxima = description.envelope.iter().map(|(_, high)| *high);
    let provenance = &description.provenance;
    let timing = &description.timing;
    let mut card = Card {
        name: &description.name,
        provenance: model::Provenance {
            vehicle: &provenance.vehicle,
            gains: &provenance.gains,
            condition: &provenance.condition,
            software: &provenance.software,
            seed: provenance.seed,
            data_crc: provenance.data_crc,
            remarks: &provenance.remarks,
        },
        signals: SignalTable {
            desired: channels(&description.signals.desired, "desired channels")?,
            measured: channels(&description.signals.measured, "measured channels")?,
            reference: channels(&description.signals.reference, "reference channels")?,
        },
        timing: model::Timing {
            reference_rate_hz: timing.reference_rate_hz,
            divisor: timing.divisor,
            interpolation: timing.interpolation,
            measurement_delay_ticks: timing.measurement_delay_s * timing.reference_rate_hz,
            fade_ticks: ticks("fade_s", timing.fade_s, timing.reference_rate_hz)?,
        },
        features: bounded(&description.features, "features")?,
        outputs: bounded(&description.outputs, "outputs")?,
        network,
        feedback: lane,
        monitor,
        envelope: blob.floats(minima.chain(maxima)),
        bounds: Section::default(),
        probes: Probes::default(),
    };
    if let Some(float) = float {
        card.bounds = blob.floats(output_bounds(&card, &blob, float, &description.envelope)?);
    }
    let lane_outputs = card.feedback.as_ref().map_or(0, |lane| lane.axes.len());
    // The probes' expected outputs come from the firmware itself.
    let probe_rows = if card.network.is_some() { probe_rows(description, calibration) } else { Vec::new() };
    let (outputs, lane_probe) = expected(&card, &blob, &probe_rows)?;
    card.probes = Probes {
        count: probe_rows.len() as u8,
        network: blob.floats(probe_rows.into_iter().flatten().chain(outputs)),
        feedback: blob.floats(lane_probe.into_iter().take(lane_outputs)),
    };
    let bytes = assemble(&card, &blob.0)?;
    Model::sized(&bytes).map_err(ExportError::Refused)?;
    Ok(bytes)
}

/// Up to four rows, spread over the calibration rows; without any the envelope's low end, middle and high end.
fn probe_rows(description: &Description, calibration: &[Vec<f32>]) -> Vec<Vec<f32>> {
    if calibration.is_empty() {
        let at = |share: f32| description.envelope.iter().map(|(low, high)| low * (1.0 - share) + high * share).collect();
        return [0.0, 0.5, 1.0].into_iter().map(at).collect();
    }
    let step = (calibration.len() / 4).max(1);
    calibration.iter().step_by(step).take(4).cloned().collect()
}

/// A time as whole reference ticks.
fn ticks(field: &'static str, seconds: f32, rate_hz: f32) -> Result<u16, ExportError> {
    let ticks = (seconds * rate_hz).round();
    if (0.0..=f32::from(u16::MAX)).contains(&ticks) { Ok(ticks as u16) } else { Err(ExportError::Time { field, seconds }) }
}

/// Bounds of the network that the blob holds, output by output.
fn output_bounds(
    card: &Card<'_>,
    blob: &BlobWriter,
    float: &FloatNetwork,
    envelope: &[(f32, f32)],
) -> Result<Vec<f32>, ExportError> {
    let stored = StoredNetwork::of_card(card, &model::Blob::new(&blob.0)).ok_or(ExportError::Refused(Refusal::Card))?;
    Ok(bounds(&stored, float, envelope).iter().flat_map(model::OutputBounds::numbers).collect())
}

/// What the firmware computes for the probes.
fn expected(card: &Card<'_>, blob: &BlobWriter, rows: &[Vec<f32>]) -> Result<(Vec<f32>, [f32; model::MAX_AXES]), ExportError> {
    // What has no probe is checked first, in a file without lanes; the lanes need no file.
    let bare = Card { network: None, feedback: None, bounds: Section::default(), ..card.clone() };
    Model::sized(&assemble(&bare, &blob.0)?).map_err(ExportError::Refused)?;
    let mut outputs = Vec::new();
    if let Some(layout) = &card.network {
        let network = Network::new(layout, &model::Blob::new(&blob.0), card.features.len(), card.outputs.len());
        let network = network.map_err(ExportError::Refused)?;
        let mut scratch = Scratch::new();
        for row in rows {
            let mut output = [0.0; model::MAX_OUTPUTS];
            network.evaluate(row, &mut output, &mut scratch);
            outputs.extend_from_slice(&output[..card.outputs.len()]);
        }
    }
    let lane = match &card.feedback {
        Some(layout) => {
            let lane = feedback::Lane::new(layout, &model::Blob::new(&blob.0)).map_err(ExportError::Refused)?;
            feedback::probe(&lane, 1.0 / card.timing.reference_rate_hz)
        }
        None => [0.0; model::MAX_AXES],
    };
    Ok((outputs, lane))
}

/// Header, card, padding, blob, check sum.
fn assemble(card: &Card<'_>, blob: &[u8]) -> Result<Vec<u8>, ExportError> {
    let version = card.version();
    let card = postcard::to_allocvec(card).map_err(|_| ExportError::Refused(Refusal::Card))?;
    let mut bytes = file::header(version, card.len() as u32, blob.len() as u32).to_vec();
    bytes.extend(&card);
    bytes.resize(bytes.len().next_multiple_of(file::ALIGNMENT), 0);
    bytes.extend(blob);
    let checksum = file::checksum(&bytes);
    bytes[20..24].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}
