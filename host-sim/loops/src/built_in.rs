//! Loops that need no file: the quadrotor of the flight stack.
//!
//! *in* nothing; *out* a description with the columns of its flight logs, and the signals of the flight stack; *never* other
//! signals than the firmware's; *source* `impromptu-flight`.

use impromptu_flight::quadrotor;
use impromptu_model_export::description::Signals;
use impromptu_sim::flight_log::{FlightLog, LogRow};

use crate::{
    description::{Accepts, AxisDescription, Fresh, FreshKind, LoopDescription},
    layout::{AxisChannels, Layout},
    reading::{AxisLog, AxisSignals},
};

/// Name of the quadrotor.
pub const QUADROTOR: &str = "quadrotor";

/// Description and signals of the quadrotor's position loop. A log with attitude has a signal that is fresher than the position:
/// the tilt.
pub fn quadrotor(with_tilt: bool) -> (LoopDescription, Layout) {
    let axes = ["x", "y", "z"].into_iter().map(|axis| AxisDescription {
        frame: "world ENU".into(),
        accepts: Accepts::PositionVelocity,
        desired: Some(format!("desired_{axis}_m")),
        velocity: Some(format!("measured_v{axis}_m_s")),
        reference_velocity: Some(format!("reference_v{axis}_m_s")),
        desired_velocity: Some(format!("desired_v{axis}_m_s")),
        fresh: fresh(axis).filter(|_| with_tilt).map(|column| Fresh { column: column.into(), kind: FreshKind::Acceleration }),
        ..AxisDescription::new(axis, "m", format!("reference_{axis}_m"), format!("measured_{axis}_m"))
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

/// Column of a flight log that goes with the acceleration of an axis; the vertical one is made of what is measured late.
fn fresh(axis: &str) -> Option<&'static str> {
    match axis {
        "x" => Some("measured_pitch_rad"),
        "y" => Some("measured_roll_rad"),
        _ => None,
    }
}

/// Of each axis what of the body's channels goes with its acceleration: pitch and roll.
const FRESH: [usize; 2] = [1, 0];

/// A flight log axis by axis.
pub fn axis_logs(log: &FlightLog) -> Vec<AxisLog> {
    let column = |of: &dyn Fn(&LogRow) -> f64| log.rows.iter().map(of).collect::<Vec<f64>>();
    let of_axis = |axis: usize| {
        let desired = column(&|row| row.desired.position[axis]);
        let told = log.rows.iter().all(|row| row.measured_body.is_some());
        AxisSignals {
            base: desired.clone(),
            desired,
            desired_velocity: column(&|row| row.desired.velocity[axis]),
            reference: column(&|row| row.reference_position[axis]),
            reference_velocity: column(&|row| row.reference_velocity[axis]),
            measured: column(&|row| row.measured_position[axis]),
            velocity: column(&|row| row.measured_velocity[axis]),
            ratio: 0.0,
            fresh: FRESH
                .get(axis)
                .filter(|_| told)
                .map(|&channel| column(&|row| row.measured_body.map_or(0.0, |body| body[channel]))),
        }
    };
    (0..3)
        .map(|axis| AxisLog { file: log.name.clone(), rate_hz: log.rate_hz, signals: of_axis(axis), notes: Vec::new() })
        .collect()
}
