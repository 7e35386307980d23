//! Settings that describe no weather.

/// A setting that describes no weather.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("weather: `{field}` must be {rule}")]
pub struct WeatherError {
    /// The offending field.
    pub field: &'static str,
    /// What its value has to satisfy.
    pub rule: &'static str,
}

/// `Err` naming the field unless `holds`.
pub(super) fn require(holds: bool, field: &'static str, rule: &'static str) -> Result<(), WeatherError> {
    holds.then_some(()).ok_or(WeatherError { field, rule })
}
