//! Shapes and sections.

use impromptu_firmware::model::{MAX_LAGS, Refusal, Section};
use impromptu_model_export::Precision;

use super::{Case, check};

#[test]
fn shapes_and_sections() {
    check(
        Precision::Int8,
        &[
            case!(
                "chain",
                |c, _b| c.network.as_mut().unwrap().layers[1].inputs = 6,
                Refusal::Shape { what: "layer inputs", found: 6, limit: 5 },
                "layer inputs is 6"
            ),
            case!(
                "first layer",
                |c, _b| c.network.as_mut().unwrap().layers[0].inputs = 4,
                Refusal::Shape { what: "layer inputs", .. },
                "layer inputs is 4"
            ),
            case!(
                "last layer",
                |c, _b| c.network.as_mut().unwrap().layers[1].outputs = 3,
                Refusal::Shape { .. },
                "outputs of the last (linear) layer is 3"
            ),
            case!(
                "no units",
                |c, _b| c.network.as_mut().unwrap().layers[0].outputs = 0,
                Refusal::Shape { found: 0, .. },
                "layer outputs is 0"
            ),
            case!(
                "wide",
                |c, _b| c.network.as_mut().unwrap().layers[0].outputs = 257,
                Refusal::Shape { found: 257, limit: 256, .. },
                "layer outputs is 257"
            ),
            case!(
                "no map",
                |c, _b| {
                    let n = c.network.as_mut().unwrap();
                    n.layers.clear();
                    n.skip = Section::default()
                },
                Refusal::Shape { .. },
                "number of layers without a skip is 0"
            ),
            case!("no inputs", |c, _b| c.features.clear(), Refusal::Shape { .. }, "number of features is 0"),
            case!(
                "no outputs",
                |c, _b| {
                    c.feedback = None;
                    c.monitor = None;
                    c.outputs.clear()
                },
                Refusal::Shape { .. },
                "number of outputs is 0"
            ),
            case!(
                "taps",
                |c, _b| c.monitor.as_mut().unwrap().taps = 33,
                Refusal::Shape { found: 33, limit: 32, .. },
                "monitor taps is 33"
            ),
            case!(
                "fewer taps",
                |c, _b| c.monitor.as_mut().unwrap().taps = 2,
                Refusal::SectionLength { what: "monitor taps", expected: 16, found: 24 },
                "section monitor taps has 24 bytes"
            ),
            case!(
                "monitor input",
                |c, _b| c.monitor.as_mut().unwrap().axes[0].inputs[1] = 2,
                Refusal::Index { what: "monitor input", found: 2 },
                "monitor input names index 2"
            ),
            case!(
                "monitor input twice",
                |c, _b| c.monitor.as_mut().unwrap().axes[0].inputs[1] = 0,
                Refusal::Duplicate { what: "monitor input", found: 0 },
                "monitor input names index 0 twice"
            ),
            case!(
                "monitor channel",
                |c, _b| c.monitor.as_mut().unwrap().axes[0].error = (2, 0),
                Refusal::Index { what: "monitor measured channel", found: 2 },
                "monitor measured channel names index 2"
            ),
            case!(
                "promise",
                |c, _b| c.monitor.as_mut().unwrap().validated_rms = f32::NAN,
                Refusal::Value { what: "validated RMS of the monitor" },
                "validated RMS of the monitor is out of"
            ),
            case!(
                "lags",
                |c, _b| c.feedback.as_mut().unwrap().lags = MAX_LAGS as u8 + 1,
                Refusal::Shape { .. },
                "lane lags is 33"
            ),
            case!("no lags", |c, _b| c.feedback.as_mut().unwrap().lags = 0, Refusal::Shape { .. }, "lane lags is 0"),
            case!(
                "no errors",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].errors.clear(),
                Refusal::Shape { .. },
                "lane errors is 0"
            ),
            case!(
                "length",
                |c, _b| c.network.as_mut().unwrap().layers[0].rows.length -= 8,
                Refusal::SectionLength { expected: 96, found: 88, .. },
                "section layer rows has 88 bytes"
            ),
            case!(
                "skip length",
                |c, _b| c.network.as_mut().unwrap().skip.length -= 4,
                Refusal::SectionLength { .. },
                "section skip rows"
            ),
            case!(
                "lane length",
                |c, _b| c.feedback.as_mut().unwrap().axes[0].coefficients.length += 4,
                Refusal::SectionLength { .. },
                "section lane coefficients"
            ),
            case!("envelope length", |c, _b| c.envelope.length = 0, Refusal::SectionLength { .. }, "section envelope"),
            case!("probe count", |c, _b| c.probes.count = 5, Refusal::SectionLength { .. }, "section network probes"),
            case!(
                "alignment",
                |c, _b| c.network.as_mut().unwrap().layers[0].rows.offset += 4,
                Refusal::SectionAlignment { .. },
                "section layer rows is not aligned"
            ),
            case!(
                "range",
                |c, _b| c.network.as_mut().unwrap().skip.offset = 16 << 16,
                Refusal::SectionRange { .. },
                "section skip rows lies outside"
            ),
            case!(
                "end of the address space",
                |c, _b| c.envelope.offset = u32::MAX - 15,
                Refusal::SectionRange { .. },
                "section envelope lies outside"
            ),
        ],
    );
}
