//! A description drafted from the header of a log: what the names of its columns say.
//!
//! *in* names of columns; *out* a [`LoopDescription`] to be read and completed by its owner; *never* a choice between two columns
//! that could both be meant; *source* names in use: this project's, a Crazyflie's, PX4's, ROS', those of motor controllers.
//!
//! A name is cut into words at everything but letters and digits. Words that say what a column is (`ROLES`), units, and
//! kinds are taken away; what is left is the name of the axis. `x_ref` and `x`, `desired_pitch_rad` and `measured_pitch_rad`,
//! `ctrltarget.x` and `stateEstimate.x` are an axis each.

use std::collections::BTreeMap;

use crate::description::{Accepts, AxisDescription, Fresh, FreshKind, LoopDescription, MOST_AXES};

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Desired,
    Reference,
    Measured,
}

/// What of an axis it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Position,
    Velocity,
    Acceleration,
}

/// Words that say what a column is.
const ROLES: [(Role, &[&str]); 3] = [
    (Role::Desired, &["desired", "des", "wanted", "plan", "planned"]),
    (Role::Reference, &["reference", "ref", "setpoint", "setpoints", "sp", "cmd", "command", "target", "goal", "ctrltarget"]),
    (
        Role::Measured,
        &["measured", "meas", "actual", "act", "fb", "feedback", "encoder", "enc", "stateestimate", "estimate", "est", "state"],
    ),
];
const VELOCITY: &[&str] = &["velocity", "vel", "speed", "rate"];
const ACCELERATION: &[&str] = &["acceleration", "accel", "acc"];
const POSITION: &[&str] = &["position", "pos", "angle"];
const TIMES: &[&str] = &["time_s", "t", "time", "timestamp", "t_s", "time_ms", "time_us", "time_ns", "timestamp_us"];
/// Units as words, and as they are written.
const UNITS: &[(&[&str], &str, Kind)] = &[
    (&["m", "s2"], "m", Kind::Acceleration),
    (&["rad", "s2"], "rad", Kind::Acceleration),
    (&["m", "s"], "m", Kind::Velocity),
    (&["rad", "s"], "rad", Kind::Velocity),
    (&["deg", "s"], "deg", Kind::Velocity),
    (&["mm"], "mm", Kind::Position),
    (&["cm"], "cm", Kind::Position),
    (&["m"], "m", Kind::Position),
    (&["rad"], "rad", Kind::Position),
    (&["deg"], "deg", Kind::Position),
];

/// Why no description is drafted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DraftError {
    /// Two columns for one thing.
    #[error(
        "`{first}` and `{second}` could each be the {what} of `{axis}`; say which with --columns \
         TIME,REFERENCE,MEASURED[,VELOCITY], once for each axis"
    )]
    Ambiguous {
        /// A column.
        first: String,
        /// Another one.
        second: String,
        /// What they could be.
        what: &'static str,
        /// Of which axis.
        axis: String,
    },
    /// Nothing that looks like an axis.
    #[error(
        "no axis is known by the names of its columns (there are: {found}); say which are one with \
         --columns TIME,REFERENCE,MEASURED[,VELOCITY], once for each axis"
    )]
    Nothing {
        /// The first columns that there are.
        found: String,
    },
    /// More axes than a loop has.
    #[error("{0} axes are more than {MOST_AXES}; choose with --columns TIME,REFERENCE,MEASURED[,VELOCITY]")]
    Many(usize),
}

/// What a name says.
#[derive(Debug, PartialEq, Eq)]
struct Read {
    axis: String,
    role: Option<Role>,
    kind: Kind,
    unit: Option<&'static str>,
}

fn read(column: &str) -> Read {
    let lower = column.to_lowercase();
    let mut words: Vec<&str> = lower.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let (mut unit, mut kind) = (None, Kind::Position);
    if let Some((suffix, name, of)) = UNITS.iter().find(|(suffix, ..)| words.len() > suffix.len() && words.ends_with(suffix)) {
        words.truncate(words.len() - suffix.len());
        (unit, kind) = (Some(*name), *of);
    }
    let role = ROLES.iter().find_map(|(role, names)| words.iter().any(|word| names.contains(word)).then_some(*role));
    let has = |names: &[&str]| words.iter().any(|word| names.contains(word));
    if has(VELOCITY) {
        kind = Kind::Velocity;
    } else if has(ACCELERATION) {
        kind = Kind::Acceleration;
    }
    let known = |word: &str| {
        ROLES.iter().any(|(_, names)| names.contains(&word))
            || [VELOCITY, ACCELERATION, POSITION].iter().any(|names| names.contains(&word))
    };
    let mut left: Vec<&str> = words.into_iter().filter(|word| !known(word)).collect();
    // vx and ax beside x.
    if let Some(last) = left.last_mut()
        && let Some(axis) = last.strip_prefix(['v', 'a']).filter(|axis| ["x", "y", "z"].contains(axis))
    {
        kind = if last.starts_with('v') { Kind::Velocity } else { Kind::Acceleration };
        *last = axis;
    }
    Read { axis: if left.is_empty() { "axis".into() } else { left.join("_") }, role, kind, unit }
}

/// Columns of an axis by what they are, each with its unit.
type Found = BTreeMap<(Option<Role>, Kind), (String, Option<&'static str>)>;

/// A description of the loop whose log has these columns.
///
/// # Errors
/// If no axis is found, or a column is not the only one that could be meant.
pub fn drafted(name: &str, header: &[String]) -> Result<LoopDescription, DraftError> {
    let time = TIMES.iter().find(|time| header.iter().any(|column| column == *time)).map_or("time_s", |time| time);
    let mut axes: BTreeMap<String, Found> = BTreeMap::new();
    let mut order = Vec::new();
    for column in header.iter().filter(|column| !TIMES.contains(&column.as_str())) {
        let Read { axis, role, kind, unit } = read(column);
        if !order.contains(&axis) {
            order.push(axis.clone());
        }
        let of_axis = axes.entry(axis.clone()).or_default();
        if let Some((first, _)) = of_axis.insert((role, kind), (column.clone(), unit))
            && role.is_some()
        {
            let what = match kind {
                Kind::Position => "position",
                Kind::Velocity => "velocity",
                Kind::Acceleration => "acceleration",
            };
            return Err(DraftError::Ambiguous { first, second: column.clone(), what, axis });
        }
    }
    let found: Vec<AxisDescription> = order.iter().filter_map(|axis| described(axis, &axes[axis])).collect();
    match found.len() {
        0 => {
            let first: Vec<&str> = header.iter().take(12).map(String::as_str).collect();
            Err(DraftError::Nothing { found: first.join(", ") + if header.len() > 12 { ", …" } else { "" } })
        }
        1..=MOST_AXES => Ok(LoopDescription { name: name.into(), time: time.into(), rate_hz: None, age_ms: None, axes: found }),
        many => Err(DraftError::Many(many)),
    }
}

fn described(axis: &str, columns: &Found) -> Option<AxisDescription> {
    let column = |role, kind| columns.get(&(role, kind)).map(|(column, _)| column.clone());
    // A column without a word for what it is was measured, unless another one says so.
    let measured = |kind| column(Some(Role::Measured), kind).or_else(|| column(None, kind));
    let (reference, desired) = match (column(Some(Role::Reference), Kind::Position), column(Some(Role::Desired), Kind::Position))
    {
        (Some(reference), desired) => (reference, desired),
        (None, Some(desired)) => (desired, None),
        (None, None) => return None,
    };
    let reference_velocity =
        column(Some(Role::Reference), Kind::Velocity).or_else(|| column(Some(Role::Desired), Kind::Velocity));
    let unit = columns.iter().filter(|((_, kind), _)| *kind == Kind::Position).find_map(|(_, (_, unit))| *unit);
    Some(AxisDescription {
        accepts: if reference_velocity.is_some() { Accepts::PositionVelocity } else { Accepts::Position },
        desired_velocity: desired.as_ref().and_then(|_| column(Some(Role::Desired), Kind::Velocity)),
        desired,
        velocity: measured(Kind::Velocity),
        reference_velocity,
        fresh: measured(Kind::Acceleration).map(|column| Fresh { column, kind: FreshKind::Acceleration }),
        ..AxisDescription::new(axis, unit.unwrap_or("units"), reference, measured(Kind::Position)?)
    })
}

/// An axis of stated columns: reference, measured position and, where there is one, its velocity.
pub fn stated(columns: &[String]) -> Option<AxisDescription> {
    let (reference, measured, velocity) = match columns {
        [reference, measured] => (reference, measured, None),
        [reference, measured, velocity] => (reference, measured, Some(velocity.clone())),
        _ => return None,
    };
    let Read { axis, unit, .. } = read(measured);
    Some(AxisDescription {
        velocity,
        ..AxisDescription::new(&axis, unit.unwrap_or("units"), reference.clone(), measured.clone())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(header: &str) -> Result<LoopDescription, DraftError> {
        drafted("machine", &header.split(',').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn names_in_use_are_axes() {
        for (header, axes) in [
            ("t,x_ref,x,vx", vec![("x", "x_ref", "x", Some("vx"), None)]),
            ("time_s,reference,measured", vec![("axis", "reference", "measured", None, None)]),
            (
                "time_s,pan_setpoint_deg,pan_deg,tilt_setpoint_deg,tilt_deg,pan_rate_deg_s",
                vec![
                    ("pan", "pan_setpoint_deg", "pan_deg", Some("pan_rate_deg_s"), None),
                    ("tilt", "tilt_setpoint_deg", "tilt_deg", None, None),
                ],
            ),
            (
                "time_s,desired_x_m,desired_vx_m_s,reference_x_m,reference_vx_m_s,measured_x_m,measured_vx_m_s",
                vec![("x", "reference_x_m", "measured_x_m", Some("measured_vx_m_s"), Some("desired_x_m"))],
            ),
            (
                "time,ctrltarget.x,stateEstimate.x,stateEstimate.vx",
                vec![("x", "ctrltarget.x", "stateEstimate.x", Some("stateEstimate.vx"), None)],
            ),
        ] {
            let found = of(header).expect(header);
            let found: Vec<_> = found
                .axes
                .iter()
                .map(|axis| {
                    let AxisDescription { name, reference, measured, velocity, desired, .. } = axis;
                    (name.as_str(), reference.as_str(), measured.as_str(), velocity.as_deref(), desired.as_deref())
                })
                .collect();
            assert_eq!(found, axes, "{header}");
        }
        assert_eq!(of("t,x_ref_mm,x_mm").unwrap().axes[0].unit, "mm");
    }

    #[test]
    fn what_could_be_meant_in_two_ways_is_refused() {
        let refusal = of("t,x_ref,x_setpoint,x").unwrap_err();
        assert!(refusal.to_string().contains("`x_ref` and `x_setpoint` could each be the position of `x`"), "{refusal}");
        assert!(of("a,b,c").unwrap_err().to_string().contains("there are: a, b, c"));
    }
}
