//! What an evaluation hands over: the table's rows, the flights behind them, the models and how they were made.

use crate::method::Method;
use anyhow::Context as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::Range;

/// One cell of the table: a method under a condition, over all flights of the test set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the vehicle, such as `crazyflie`.
    pub vehicle: String,
    /// Name of the baseline's gains, such as `stock`.
    pub gains: String,
    /// Name of the condition, such as `lab`, or `lab+20ms` with 20 ms more delay at test time only.
    pub condition: String,
    /// Factor on the speed of the trajectories (1 = as drawn).
    pub speed: f64,
    /// What flew.
    pub method: Method,
    /// Mean over the flights of the RMS position error, in centimetres.
    #[serde(deserialize_with = "number_or_null")]
    pub rms_cm_mean: f64,
    /// Mean over the flights of the reduction of the RMS error against the baseline's flight of the same trajectory, in per cent.
    #[serde(deserialize_with = "number_or_null")]
    pub reduction_mean: f64,
    /// The smallest of these reductions, in per cent; negative where the flight was worse than the baseline's.
    #[serde(deserialize_with = "number_or_null")]
    pub reduction_worst: f64,
    /// Seed of everything random behind this row.
    pub seed: u64,
}

/// One flight's result: what the rows are averages of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PerFlight {
    /// As in [`Row::vehicle`].
    pub vehicle: String,
    /// As in [`Row::gains`].
    pub gains: String,
    /// As in [`Row::condition`].
    pub condition: String,
    /// As in [`Row::speed`].
    pub speed: f64,
    /// What flew.
    pub method: Method,
    /// Name of the trajectory.
    pub trajectory: String,
    /// `sqrt(mean |p_d - p|²)` over the scored part, in centimetres.
    #[serde(deserialize_with = "number_or_null")]
    pub rms_cm: f64,
    /// `100 (1 - rms / rms of the baseline's flight)`, in per cent.
    #[serde(deserialize_with = "number_or_null")]
    pub reduction: f64,
    /// As in [`Row::seed`].
    pub seed: u64,
}

/// Time series of one flight, for the plots. All positions in metres, world frame ENU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightTrace {
    /// Name of the trajectory; the traces of several methods over the same one are plotted together.
    pub trajectory: String,
    /// As in [`Row::vehicle`].
    pub vehicle: String,
    /// As in [`Row::gains`].
    pub gains: String,
    /// As in [`Row::condition`].
    pub condition: String,
    /// As in [`Row::speed`].
    pub speed: f64,
    /// What flew.
    pub method: Method,
    /// Samples a second of the three series below, in hertz; sample `i` is at `i / rate_hz` seconds.
    pub rate_hz: f64,
    /// Desired position at each sample, in metres.
    pub desired: Vec<[f64; 3]>,
    /// True position at each sample, in metres.
    pub flown: Vec<[f64; 3]>,
    /// Position reference that the baseline loop was given at each sample, in metres.
    pub reference: Vec<[f64; 3]>,
    /// The samples that the RMS error counts; without the take-off and hover before and after the stroke.
    pub scored: Range<usize>,
}

/// How far the add-on's own loop is from instability, on a model of longer memory than the one it was designed on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// Additional delay at the stability limit, in milliseconds.
    #[serde(deserialize_with = "number_or_null")]
    pub delay_ms: f64,
    /// Factor on the loop gain at the stability limit (1 = none left).
    #[serde(deserialize_with = "number_or_null")]
    pub gain: f64,
    /// Smallest distance of the open loop's Nyquist curve from -1 (1 = ideal, 0 = unstable).
    #[serde(deserialize_with = "number_or_null")]
    pub modulus: f64,
}

/// What became of the design of the feedback lane.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LaneOutcome {
    /// The lane is in the model: its design in words, such as `control weight 3e-3, e_v 0.05`.
    Chosen(String),
    /// The model was written without the lane: why.
    Refused(String),
}

/// One model file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelCard {
    /// Name of the model or its file.
    pub name: String,
    /// Vehicle whose flights it was trained on.
    pub vehicle: String,
    /// Gains of the baseline in these flights.
    pub gains: String,
    /// Condition of these flights.
    pub condition: String,
    /// Size of the file, in bytes.
    pub bytes: u64,
    /// CRC-32 stored in the file.
    pub crc32: u32,
    /// Number of stored weights, biases and lane coefficients.
    pub parameters: u64,
    /// Multiply-adds for one evaluation of both lanes.
    pub multiply_adds: u64,
    /// Margins of the add-on's loop; `None` without a feedback lane.
    pub margins: Option<Margins>,
    /// The feedback lane's design, or why there is none.
    pub lane: LaneOutcome,
    /// Flight that it was trained on, minutes; `None` where nobody counted.
    #[serde(default)]
    pub minutes: Option<f64>,
    /// RMS difference between the quantised and the float network's corrections over a data set, in millimetres.
    pub quantisation_rms_mm: Option<f64>,
}

/// Everything that a report shows. The table, the JSON document and the HTML page are three views of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Heading of the report.
    pub title: String,
    /// The command that repeats the run.
    pub command: String,
    /// Seed of the run.
    pub seed: u64,
    /// Version of the program, such as `CARGO_PKG_VERSION` with a commit.
    pub software_version: String,
    /// One row for each vehicle, gains, condition, speed, seed and method; see [`super::summarise`].
    pub table: Vec<Row>,
    /// A few flights in full, for the plots: the baseline and one or more methods over each trajectory.
    pub flights: Vec<FlightTrace>,
    /// Every flight's score.
    pub per_flight: Vec<PerFlight>,
    /// The models that flew.
    pub models: Vec<ModelCard>,
    /// Name and duration, in seconds, of each stage of the run.
    pub timings: Vec<(String, f64)>,
    /// Name and definition of conditions; the usual ones are explained without an entry here.
    #[serde(default)]
    pub conditions: Vec<(String, String)>,
    /// Remarks for the reader, one paragraph each.
    pub notes: Vec<String>,
}

impl Results {
    /// The JSON document: one object with the list of rows under `table`. Numbers that are not finite become `null`.
    ///
    /// # Errors
    /// When serde_json fails, which no value of this type makes it do.
    pub fn to_json(&self) -> anyhow::Result<String> {
        serde_json::to_string_pretty(self).context("the results cannot be written as JSON")
    }

    /// Reads what [`Results::to_json`] wrote.
    ///
    /// # Errors
    /// When the text is not such a document; the message has the line, the column and the field.
    pub fn from_json(text: &str) -> anyhow::Result<Self> {
        serde_json::from_str(text).context("this is not a JSON document of results")
    }
}

/// JSON has no NaN: it is written as `null`, and read back as NaN.
fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn a_row_has_exactly_the_documented_keys() {
        let document: serde_json::Value = serde_json::from_str(&fixture::small().to_json().unwrap()).unwrap();
        let mut keys: Vec<&str> = document["table"][0].as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        assert_eq!(
            keys,
            ["condition", "gains", "method", "reduction_mean", "reduction_worst", "rms_cm_mean", "seed", "speed", "vehicle"]
        );
    }

    #[test]
    fn json_survives_a_round_trip_and_numbers_that_are_not_finite() {
        let mut results = fixture::small();
        assert_eq!(Results::from_json(&results.to_json().unwrap()).unwrap(), results);
        results.table[0].reduction_worst = f64::NEG_INFINITY;
        let text = results.to_json().unwrap();
        assert!(text.contains("\"reduction_worst\": null"));
        assert!(Results::from_json(&text).unwrap().table[0].reduction_worst.is_nan());
    }

    #[test]
    fn an_unknown_method_is_refused_by_name() {
        let text = fixture::small().to_json().unwrap().replace("\"full_int8\"", "\"full_int7\"");
        let message = format!("{:#}", Results::from_json(&text).unwrap_err());
        assert!(message.contains("full_int7") && message.contains("line"), "{message}");
    }
}
