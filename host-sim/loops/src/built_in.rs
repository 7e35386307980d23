//! Loops that need no file: the quadrotor of the flight stack.
//!
//! *in* nothing; *out* a description with the columns of its flight logs, and the signals of the flight stack; *never* other
//! signals than the firmware's; *source* `impromptu-flight`.

use impromptu_flight::quadrotor;
use impromptu_model_export::description::Signals;

use crate::{
    description::{Accepts, AxisDescription, Fresh, FreshKind, LoopDescription},
    layout::{AxisChannels, Layout},
};

/// Name of the quadrotor.
pub const QUADROTOR: &str = "quadrotor";

/// Description and signals of the quadrotor's position loop. A log with attitude has a signal that is fresher than the position:
/// the tilt.
pub fn quadrotor(with_tilt: bool) -> (LoopDescription, Layout) {
    let axes = ["x", "y", "z"].into_iter().map(|axis| AxisDescription {
        name: axis.into(),
        unit: "m".into(),
        frame: "world ENU".into(),
        accepts: Accepts::PositionVelocity,
        reference: format!("reference_{axis}_m"),
        measured: format!("measured_{axis}_m"),
        desired: Some(format!("desired_{axis}_m")),
        velocity: Some(format!("measured_v{axis}_m_s")),
        reference_velocity: Some(format!("reference_v{axis}_m_s")),
        desired_velocity: Some(format!("desired_v{axis}_m_s")),
        fresh: (with_tilt && axis != "z").then(|| Fresh {
            column: if axis == "x" { "measured_pitch_rad" } else { "measured_roll_rad" }.into(),
            kind: FreshKind::Acceleration,
        }),
        wrap: None,
        cap: None,
        cap_rate: None,
    });
    let described =
        LoopDescription { name: QUADROTOR.into(), time: "time_s".into(), rate_hz: None, age_ms: None, axes: axes.collect() };
    let channels = (0..3u8).map(|axis| AxisChannels {
        desired: [Some(axis), Some(3 + axis), Some(6 + axis)],
        measured: [Some(axis), Some(3 + axis)],
        reference: [Some(axis), Some(3 + axis), None],
    });
    (described, Layout { signals: Signals::from(&quadrotor::signals()), axes: channels.collect() })
}
