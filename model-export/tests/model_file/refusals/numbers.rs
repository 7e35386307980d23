//! Numbers and probes.

use impromptu_firmware::{features::Source, model::Refusal};
use impromptu_model_export::Precision;

use super::{Case, check, nudge, put};

#[test]
fn numbers() {
    check(
        Precision::Float,
        &[
            case!(
                "weight",
                |c, b| put(b, c.network.as_ref().unwrap().layers[0].rows, 11, f32::NAN.to_le_bytes()),
                Refusal::NotFinite { .. },
                "layer rows holds"
            ),
            case!(
                "bias",
                |c, b| put(b, c.network.as_ref().unwrap().layers[1].rows, 0, f32::INFINITY.to_le_bytes()),
                Refusal::NotFinite { .. },
                "layer rows holds"
            ),
            case!(
                "skip",
                |c, b| put(b, c.network.as_ref().unwrap().skip, 0, f32::NAN.to_le_bytes()),
                Refusal::NotFinite { .. },
                "skip rows holds"
            ),
            case!(
                "normalisation",
                |c, b| put(b, c.network.as_ref().unwrap().input_normalisation, 4, f32::INFINITY.to_le_bytes()),
                Refusal::NotFinite { .. },
                "input normalisation holds"
            ),
            case!(
                "lane",
                |c, b| put(b, c.feedback.as_ref().unwrap().axes[0].coefficients, 0, f32::NAN.to_le_bytes()),
                Refusal::NotFinite { .. },
                "lane coefficients holds"
            ),
            case!(
                "margins",
                |c, _b| c.feedback.as_mut().unwrap().margins.gain = f32::NAN,
                Refusal::NotFinite { .. },
                "lane margins holds"
            ),
            case!("rate", |c, _b| c.timing.reference_rate_hz = 0.0, Refusal::Value { .. }, "reference rate"),
            case!("tiny rate", |c, _b| c.timing.reference_rate_hz = 1e-40, Refusal::Value { .. }, "reference rate"),
            case!("divisor", |c, _b| c.timing.divisor = 0, Refusal::Value { .. }, "sub-rate divisor"),
            case!("delay", |c, _b| c.timing.measurement_delay_ticks = f32::NAN, Refusal::Value { .. }, "measurement delay"),
            case!("limit", |c, _b| c.outputs[0].limit = -0.1, Refusal::Value { .. }, "output limit or slew"),
            case!("slew", |c, _b| c.outputs[1].slew = 0.0, Refusal::Value { .. }, "output limit or slew"),
            case!(
                "lane limit",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].fast_limit = -1.0,
                Refusal::Value { .. },
                "lane integral or limit"
            ),
            case!(
                "lane integral",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].integral = f32::NAN,
                Refusal::Value { .. },
                "lane integral or limit"
            ),
            case!(
                "steady state",
                |c, b| put(b, c.feedback.as_ref().unwrap().axes[0].coefficients, 4, 0.9f32.to_le_bytes()),
                Refusal::Value { .. },
                "past-output coefficients"
            ),
            case!("envelope", |c, b| put(b, c.envelope, 0, 99f32.to_le_bytes()), Refusal::Value { .. }, "envelope"),
            case!(
                "future of a measurement",
                |c, _b| c.features[0].source = Source::Measured,
                Refusal::Value { .. },
                "feature offset"
            ),
            case!("window", |c, _b| c.features[0].offset = 1001, Refusal::Value { .. }, "feature offset"),
            case!(
                "network probe",
                |c, b| nudge(b, c.probes.network, 4 * 3),
                Refusal::Probe { index: 0 },
                "probe 0 gives other bits"
            ),
            case!(
                "last network probe",
                |c, b| nudge(b, c.probes.network, 4 * 5 - 1),
                Refusal::Probe { index: 3 },
                "probe 3 gives other bits"
            ),
            case!(
                "lane probe",
                |c, b| nudge(b, c.probes.feedback, 0),
                Refusal::Probe { index: u8::MAX },
                "feedback lane's probe"
            ),
        ],
    );
    check(
        Precision::Int8,
        &[
            case!(
                "overflow",
                |c, b| put(b, c.network.as_ref().unwrap().layers[0].rows, 0, i32::MAX.to_le_bytes()),
                Refusal::Overflow { layer: 0 },
                "layer 0 could overflow"
            ),
            case!(
                "overflow below",
                |c, b| put(b, c.network.as_ref().unwrap().layers[1].rows, 1, i32::MIN.to_le_bytes()),
                Refusal::Overflow { layer: 1 },
                "layer 1 could overflow"
            ),
            case!(
                "row scale",
                |c, b| put(b, c.network.as_ref().unwrap().layers[1].rows, 8 + 16, f32::NAN.to_le_bytes()),
                Refusal::NotFinite { .. },
                "layer row scales holds"
            ),
            case!(
                "input code",
                |c, _b| c.network.as_mut().unwrap().input_code = f32::NAN,
                Refusal::NotFinite { .. },
                "input code holds"
            ),
            case!(
                "larger codes than the proof allows",
                |c, _b| c.network.as_mut().unwrap().layers[1].input_limit = 32_767,
                Refusal::Overflow { layer: 1 },
                "layer 1 could overflow"
            ),
            case!(
                "no codes",
                |c, _b| c.network.as_mut().unwrap().layers[0].input_limit = 0,
                Refusal::Value { .. },
                "largest input code"
            ),
            case!(
                "codes beyond 16 bits",
                |c, _b| c.network.as_mut().unwrap().layers[1].input_limit = 32_768,
                Refusal::Value { .. },
                "largest input code"
            ),
            case!("no input code", |c, _b| c.network.as_mut().unwrap().input_code = 0.0, Refusal::Value { .. }, "input code"),
        ],
    );
}
