//! A loop in words: its axes, where they stand in a log, what its reference accepts, and how far it may be corrected.
//!
//! *in* TOML; *out* a [`LoopDescription`] whose every value can be; *never* an unknown key, or a column that is two things;
//! *source* Zhou 2017, Fig. 1: desired, reference and measured output of a loop.
//!
//! ```toml
//! name = "gantry"
//! time = "time_s"
//! rate_hz = 200.0                 # of the reference; that of the logs if it is not given
//! age_ms = 5.0                    # of what is measured when the loop receives it, if it is known
//!
//! [[axes]]
//! name = "x"
//! unit = "m"
//! frame = "rail"
//! reference = "x_reference"       # columns
//! desired = "x_desired"           # the reference if it is not given: logs without dither
//! measured = "x"
//! velocity = "vx"                 # optional, as are the following
//! accepts = "position_velocity"   # or position (the default), or position_velocity_feed_forward
//! reference_velocity = "vx_reference"
//! desired_velocity = "vx_desired"
//! fresh = { column = "ax", kind = "acceleration" }
//! wrap = 360.0
//! cap = 0.05                      # m: no correction is larger,
//! cap_rate = 2.0                  # m/s: or changes faster
//! ```

use garde::Validate;
use serde::{Deserialize, Serialize};

/// Most axes of a loop.
pub const MOST_AXES: usize = 8;
const _: () = assert!(MOST_AXES <= impromptu_firmware::model::MAX_AXES);
/// Slowest and fastest reference, Hz.
pub const RATES: [f64; 2] = [10.0, 2000.0];

/// What the reference of an axis consists of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Accepts {
    /// A position.
    #[default]
    Position,
    /// A position and its rate of change.
    PositionVelocity,
    /// These and an acceleration, which is fed forward.
    PositionVelocityFeedForward,
}

impl Accepts {
    /// Whether a velocity is part of the reference.
    pub fn velocity(self) -> bool {
        self != Self::Position
    }

    /// Whether an acceleration is.
    pub fn feed_forward(self) -> bool {
        self == Self::PositionVelocityFeedForward
    }
}

/// How a fresher signal goes with the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FreshKind {
    /// Proportional to the position's rate of change: a rate gyroscope, the speed of a motor.
    Velocity,
    /// Proportional to its acceleration, but for a constant: an accelerometer, the tilt of a vehicle that hovers, the current
    /// of a motor with little friction.
    Acceleration,
}

/// A column that is fresher than the measured position, which follows from it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Fresh {
    /// Column.
    #[garde(custom(column_name))]
    pub column: String,
    /// How it goes with the position.
    #[garde(skip)]
    pub kind: FreshKind,
}

/// An axis of a loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct AxisDescription {
    /// Name, also of the axis' channels in the model.
    #[garde(custom(word))]
    pub name: String,
    /// Unit of its position.
    #[garde(custom(word))]
    pub unit: String,
    /// Frame.
    #[serde(default = "own_frame")]
    #[garde(custom(word))]
    pub frame: String,
    /// What the reference consists of.
    #[serde(default)]
    #[garde(skip)]
    pub accepts: Accepts,
    /// Column of the position reference that the loop received.
    #[garde(custom(column_name))]
    pub reference: String,
    /// Column of the measured position, as late as the loop received it.
    #[garde(custom(column_name))]
    pub measured: String,
    /// Column of the desired position; without it the reference is what was desired.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(column_name)))]
    pub desired: Option<String>,
    /// Column of the measured velocity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(column_name)))]
    pub velocity: Option<String>,
    /// Column of the velocity reference that the loop received; without it that of the desired position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(column_name)))]
    pub reference_velocity: Option<String>,
    /// Column of the desired velocity; without it the rate of change of the desired position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(column_name)))]
    pub desired_velocity: Option<String>,
    /// A fresher signal, which tells the age of what is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub fresh: Option<Fresh>,
    /// A whole turn, where position and reference wrap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(positive)))]
    pub wrap: Option<f64>,
    /// Largest correction that the application lets through, in the axis' unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(positive)))]
    pub cap: Option<f64>,
    /// Fastest change of a correction that it lets through, in the axis' unit a second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(positive)))]
    pub cap_rate: Option<f64>,
}

fn own_frame() -> String {
    "its own".into()
}

impl AxisDescription {
    /// An axis of these columns that is told positions and of which nothing else is known.
    pub fn new(name: &str, unit: &str, reference: String, measured: String) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            frame: own_frame(),
            accepts: Accepts::Position,
            reference,
            measured,
            desired: None,
            velocity: None,
            reference_velocity: None,
            desired_velocity: None,
            fresh: None,
            wrap: None,
            cap: None,
            cap_rate: None,
        }
    }
}

/// A loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct LoopDescription {
    /// Name of the machine.
    #[garde(custom(word))]
    pub name: String,
    /// Column of the time.
    #[serde(default = "time")]
    #[garde(custom(column_name))]
    pub time: String,
    /// Rate at which the loop takes references, Hz; that of the logs if it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(rate)))]
    pub rate_hz: Option<f64>,
    /// Age of what is measured when the loop receives it, ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(age)))]
    pub age_ms: Option<f64>,
    /// Axes.
    #[garde(custom(count), dive)]
    pub axes: Vec<AxisDescription>,
}

fn time() -> String {
    "time_s".into()
}

/// Why a text describes no loop.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// No TOML, or other keys.
    #[error("line {line}: {message}")]
    Toml {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A value that cannot be.
    #[error("{0}")]
    Value(String),
}

impl LoopDescription {
    /// A loop from its TOML.
    ///
    /// # Errors
    /// Names the line, or the key, of what is wrong.
    pub fn parse(text: &str) -> Result<Self, DescriptionError> {
        let described: Self = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            DescriptionError::Toml { line: 1 + before.matches('\n').count(), message: error.message().into() }
        })?;
        described.check()?;
        Ok(described)
    }

    /// Whether every value can be.
    ///
    /// # Errors
    /// Names the key of the first one that cannot.
    pub fn check(&self) -> Result<(), DescriptionError> {
        self.validate().map_err(|report| DescriptionError::Value(report.to_string().trim().replace('\n', "; ")))?;
        let value = |text: String| Err(DescriptionError::Value(text));
        for (index, axis) in self.axes.iter().enumerate() {
            if self.axes.iter().take(index).any(|other| other.name == axis.name) {
                return value(format!("axes[{index}].name: two axes are called `{}`", axis.name));
            }
            if axis.measured == axis.reference || Some(&axis.measured) == axis.desired.as_ref() {
                return value(format!(
                    "axes[{index}].measured: column `{}` is the axis' reference as well; name the one that was measured",
                    axis.measured
                ));
            }
            let velocities = axis.reference_velocity.is_some() && !axis.accepts.velocity();
            if velocities {
                return value(format!(
                    "axes[{index}].reference_velocity: the reference accepts a position only; say accepts = \"position_velocity\""
                ));
            }
        }
        Ok(())
    }

    /// The description as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }
}

fn word(text: &str, _: &()) -> garde::Result {
    let printable = !text.trim().is_empty() && text.chars().all(|letter| !letter.is_control());
    if printable && text.len() <= 48 { Ok(()) } else { Err(garde::Error::new("expected 1 to 48 bytes of text")) }
}

fn column_name(text: &str, _: &()) -> garde::Result {
    if !text.trim().is_empty() && text.len() <= 256 { Ok(()) } else { Err(garde::Error::new("expected the name of a column")) }
}

fn within(value: f64, [low, high]: [f64; 2]) -> garde::Result {
    if (low..=high).contains(&value) { Ok(()) } else { Err(garde::Error::new(format!("{value} is not from {low} to {high}"))) }
}

fn positive(value: &f64, _: &()) -> garde::Result {
    within(*value, [1e-9, 1e7])
}

fn rate(value: &f64, _: &()) -> garde::Result {
    within(*value, RATES)
}

fn age(value: &f64, _: &()) -> garde::Result {
    within(*value, [0.0, 1000.0])
}

fn count(axes: &[AxisDescription], _: &()) -> garde::Result {
    if (1..=MOST_AXES).contains(&axes.len()) {
        Ok(())
    } else {
        Err(garde::Error::new(format!("{} axes; a loop has 1 to {MOST_AXES}", axes.len())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GANTRY: &str = "name = \"gantry\"\n[[axes]]\nname = \"x\"\nunit = \"m\"\nreference = \"xr\"\nmeasured = \"x\"\n";

    #[test]
    fn what_is_written_is_read_again() {
        let described = LoopDescription::parse(GANTRY).unwrap();
        assert_eq!((described.time.as_str(), described.axes[0].accepts), ("time_s", Accepts::Position));
        assert_eq!(LoopDescription::parse(&described.to_toml()).unwrap(), described);
    }

    #[test]
    fn the_example_is_one() {
        let lines =
            include_str!("description.rs").lines().filter_map(|line| line.strip_prefix("//! ").or(line.strip_prefix("//!")));
        let example: Vec<&str> = lines.skip_while(|line| *line != "```toml").skip(1).take_while(|line| *line != "```").collect();
        let described = LoopDescription::parse(&example.join("\n")).unwrap();
        let axis = &described.axes[0];
        assert_eq!((described.name.as_str(), described.rate_hz, described.age_ms), ("gantry", Some(200.0), Some(5.0)));
        assert_eq!((axis.accepts, axis.wrap, axis.cap), (Accepts::PositionVelocity, Some(360.0), Some(0.05)));
        assert!(axis.fresh.as_ref().is_some_and(|fresh| fresh.kind == FreshKind::Acceleration));
    }

    #[test]
    fn what_no_loop_has_is_refused_by_its_key() {
        for (change, named) in [
            ("name = \"gantry\"\nrate_hz = 5000.0\n", "rate_hz: 5000 is not from 10 to 2000"),
            ("name = \"gantry\"\nage_ms = -1.0\n", "age_ms: -1 is not from 0 to 1000"),
            ("name = \"\"\n", "name: expected"),
            ("name = \"gantry\"\nspeed = 3\n", "line 2: unknown field `speed`"),
        ] {
            let text = GANTRY.replace("name = \"gantry\"\n", change);
            let refusal = LoopDescription::parse(&text).expect_err(change).to_string();
            assert!(refusal.contains(named), "{refusal}");
        }
        for (from, to, named) in [
            ("measured = \"x\"", "measured = \"xr\"", "axes[0].measured: column `xr` is the axis' reference as well"),
            ("unit = \"m\"", "unit = \"m\"\ncap = 0.0", "axes[0].cap: 0 is not from"),
            ("unit = \"m\"", "unit = \"m\"\nreference_velocity = \"v\"", "say accepts = \"position_velocity\""),
        ] {
            let refusal = LoopDescription::parse(&GANTRY.replace(from, to)).expect_err(to).to_string();
            assert!(refusal.contains(named), "{refusal}");
        }
        let twice = format!("{GANTRY}{}", GANTRY.split_once('\n').unwrap().1);
        assert!(LoopDescription::parse(&twice).unwrap_err().to_string().contains("two axes are called `x`"));
        assert!(LoopDescription::parse("name = \"none\"\naxes = []\n").unwrap_err().to_string().contains("0 axes"));
    }
}
