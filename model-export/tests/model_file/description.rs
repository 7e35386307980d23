//! The description's JSON.

use impromptu_firmware::features::{Feature, Relative, Source};
use impromptu_model_export::{
    Description,
    description::{MonitorAxisDescription, MonitorDescription},
};
use proptest::prelude::*;

use crate::fixture::{description, lane};

fn complete() -> Description {
    let mut description = description(3);
    description.feedback_lane = Some(lane([vec![-1.0, 0.25], vec![-0.4, 0.0]], vec![0.3, 0.1], -0.5));
    description
}

#[test]
fn unknown_and_missing_keys_are_refused_by_name_and_place() {
    let text = complete().to_json();
    let refusal = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        Description::from_json(&text.replacen(from, to, 1)).unwrap_err().to_string()
    };
    for (from, to, key) in [
        ("\"name\": \"small\"", "\"nam\": \"small\"", "nam"),
        ("\"fade_s\"", "\"fade_ms\"", "fade_ms"),
        ("\"vehicle\"", "\"plane\"", "plane"),
        ("\"unit\"", "\"units\"", "units"),
        ("\"integral_limit\"", "\"integral_clamp\"", "integral_clamp"),
        ("\"offset\"", "\"ofset\"", "ofset"),
        ("\"slew\"", "\"slow\"", "slow"),
        ("\"delay_ms\"", "\"delay_s\"", "delay_s"),
    ] {
        let message = refusal(from, to);
        assert!(message.contains(&format!("unknown field `{key}`")) && message.contains("line"), "{message}");
    }
    let message = refusal("\"divisor\": 10,", "");
    assert!(message.contains("missing field `divisor`"), "{message}");
    assert!(refusal("\"Hold\"", "\"Holt\"").contains("unknown variant `Holt`"));
    assert!(refusal("\"divisor\": 10", "\"divisor\": -1").contains("line"));
}

#[test]
fn the_keys_of_older_files_are_read() {
    let mut complete = complete();
    let axis = MonitorAxisDescription { error: (0, 0), inputs: vec![0], taps: vec![vec![1.0]] };
    complete.monitor = Some(MonitorDescription { divisor: 10, validated_rms: 0.01, axes: vec![axis] });
    let text = complete.to_json();
    let older = text.replacen("\"feedback_lane\"", "\"lane\"", 1).replacen("\"validated_rms\"", "\"promise\"", 1);
    assert_ne!(text, older);
    assert_eq!(Description::from_json(&older).unwrap(), complete);
}

proptest! {
    #[test]
    fn json_and_back_is_the_same(
        name in ".*",
        seed in any::<u64>(),
        numbers in proptest::collection::vec(prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO, 12),
        channel in any::<u8>(),
        offset in any::<i16>(),
        lane in any::<bool>(),
    ) {
        let mut description = complete();
        description.name = name.clone();
        description.provenance.remarks = name;
        description.provenance.seed = seed;
        description.timing.measurement_delay_s = numbers[0];
        description.outputs[0].limit = numbers[1];
        description.envelope[0] = (numbers[2], numbers[3]);
        description.features[0] = Feature { source: Source::Reference, channel, offset, relative: Relative::Measured(channel) };
        description.feedback_lane.as_mut().unwrap().axes[0].error_coefficients = vec![numbers[4..].to_vec(), vec![]];
        if !lane {
            description.feedback_lane = None;
        }
        prop_assert_eq!(Description::from_json(&description.to_json()).unwrap(), description);
    }
}
