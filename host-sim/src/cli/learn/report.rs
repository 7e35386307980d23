//! A replay as text, as JSON, and as a page with a figure.

use impromptu_experiment::replay::{Flight, Predicted, Replay, mean};
use impromptu_files::text::line;
use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};
use serde::Serialize;

use crate::cli::output::{number, table};

const SECTION: &str = "Predicted by replay";
/// The flights of a summary, from 1.
const EARLY: std::ops::RangeInclusive<usize> = 2..=5;

/// What is printed as JSON.
#[derive(Debug, Serialize)]
pub(super) struct Replayed {
    /// What the numbers are.
    kind: &'static str,
    /// Axes, and the unit of all errors.
    axes: Vec<String>,
    unit: &'static str,
    #[serde(flatten)]
    replay: Replay,
    /// Flights 2 to 5, and those behind.
    summaries: Vec<Summary>,
}

/// Several flights.
#[derive(Debug, Serialize)]
struct Summary {
    flights: String,
    /// Means of the errors.
    recorded: f64,
    predicted: f64,
    /// Of the means, and of the worst flight.
    reduction_percent: f64,
    worst_percent: f64,
}

impl Summary {
    fn of(first: usize, flights: &[Predicted]) -> Option<Self> {
        let last = first + flights.len().checked_sub(1)?;
        let (recorded, predicted) =
            (mean(flights.iter().map(|flight| flight.recorded)), mean(flights.iter().map(|flight| flight.predicted)));
        Some(Self {
            flights: if first == last { format!("flight {first}") } else { format!("flights {first} to {last}") },
            recorded,
            predicted,
            reduction_percent: 100.0 * (1.0 - predicted / recorded),
            worst_percent: flights.iter().map(|flight| flight.reduction_percent).fold(f64::INFINITY, f64::min),
        })
    }
}

impl Replayed {
    /// Metres become centimetres, as everywhere in reports.
    pub(super) fn new(mut replay: Replay, flights: &[Flight]) -> Self {
        let tracks = || flights.iter().take(1).flat_map(|flight| &flight.tracks);
        let metres = tracks().all(|track| track.unit == "m");
        let factor = if metres { 100.0 } else { 1.0 };
        for flight in &mut replay.flights {
            for value in [&mut flight.recorded, &mut flight.predicted, &mut flight.learning_on] {
                *value *= factor;
            }
        }
        replay.misfit = replay.misfit.map(|misfit| factor * misfit);
        replay.otherwise = replay.otherwise.map(|error| factor * error);
        let all = replay.flights.as_slice();
        let (early, late) = (all.get(1..all.len().min(*EARLY.end())), all.get(*EARLY.end()..));
        let summaries = [(*EARLY.start(), early), (EARLY.end() + 1, late)];
        let summaries = summaries.into_iter().filter_map(|(first, flights)| Summary::of(first, flights?)).collect();
        Self {
            kind: "prediction by replay, nothing was flown",
            axes: tracks().map(|track| track.name.clone()).collect(),
            unit: if metres { "cm" } else { "units" },
            replay,
            summaries,
        }
    }

    /// The response in words.
    fn response(&self) -> String {
        let Replay { response, identified_from, misfit, rate_hz, log_hz, measured_rate, .. } = &self.replay;
        let from = if identified_from.is_empty() {
            "as given".into()
        } else {
            let missed = misfit.map_or_else(String::new, |misfit| format!(", which it misses by {misfit:.2} {} RMS", self.unit));
            format!("what was not given found from {}{missed}", line(&identified_from.join(" and ")))
        };
        let rate = if *measured_rate { "from the logs" } else { "the difference of the measured value, low-passed over a tick" };
        format!(
            "Response: second order, gain {:.2}, {:.2} rad/s, damping {:.2}, delay {:.0} ms;\n{from}.\n\
             Learner: {rate_hz:.1} ticks a second, the log has {log_hz:.1} rows; rate of change {rate}.\n",
            response.gain,
            response.frequency,
            response.damping,
            1e3 * response.delay_s
        )
    }

    /// What comes behind the numbers.
    fn caution(&self) -> String {
        let Replay { flights, otherwise: [slower, faster], learned_min, .. } = &self.replay;
        let predicted = mean(flights.iter().skip(1).map(|flight| flight.predicted));
        format!(
            "Learned from {learned_min:.1} min of flight. This is a prediction: nothing was flown. It takes the response at its \
             word; mean predicted\nerror from the second flight on {} {unit}, and if the loop really is a fifth slower {}, a \
             quarter faster {} {unit}.\n",
            number(predicted, 2),
            number(*slower, 2),
            number(*faster, 2),
            unit = self.unit
        )
    }

    pub(super) fn text(&self) -> String {
        let unit = self.unit;
        let rows = self.replay.flights.iter().zip(1..).map(|(flight, index)| {
            [
                index.to_string(),
                flight.name.clone(),
                number(flight.learned_before_min, 1),
                number(flight.recorded, 2),
                number(flight.predicted, 2),
                number(flight.reduction_percent, 1),
                number(flight.learning_on, 2),
            ]
        });
        let header = [
            "",
            "flight",
            "learned before, min",
            &format!("recorded, {unit}"),
            &format!("PREDICTED, {unit}"),
            "reduction, %",
            &format!("learning on, {unit}"),
        ];
        let mut text = format!(
            "PREDICTION by replay, nothing was flown: RMS error of {} with what the flights before had taught\n{}{}",
            line(&self.axes.join(", ")),
            self.response(),
            table(header, 2, rows)
        );
        for summary in &self.summaries {
            text += &format!(
                "{}: recorded {}, predicted {} {unit}; reduction {} %, worst flight {} %\n",
                summary.flights,
                number(summary.recorded, 2),
                number(summary.predicted, 2),
                number(summary.reduction_percent, 1),
                number(summary.worst_percent, 1)
            );
        }
        text + "learning on: predicted if the learner goes on learning in the flight itself\n" + &self.caution()
    }

    /// The page: words, figure, table.
    pub(super) fn study(&self, seed: u64, command: &str) -> Study {
        let unit = self.unit;
        let mut study = Study::new("What learning in flight would have left: a prediction", command, seed);
        study.note(SECTION, &self.response().replace('\n', " "));
        study.note(SECTION, &self.caution().replace('\n', " "));
        let curve = |label: &str, of: &dyn Fn(&Predicted) -> f64| {
            Curve::line_and_dots(label, self.replay.flights.iter().zip(1..).map(|(flight, at)| (f64::from(at), of(flight))))
        };
        study.draw(Figure {
            section: SECTION.into(),
            name: "error_by_flight".into(),
            title: "RMS error, flight after flight, as recorded and as predicted".into(),
            x: Axis::linear("flight"),
            y: Axis::linear(&format!("RMS error [{unit}]")),
            curves: vec![
                curve("predicted, with what the flights before had taught", &|flight| flight.predicted),
                curve("recorded", &|flight| flight.recorded),
                curve("predicted, learning on in the flight", &|flight| flight.learning_on),
            ],
        });
        for (flight, index) in self.replay.flights.iter().zip(1..) {
            for (name, what, value, unit) in [
                ("recorded", "recorded", flight.recorded, unit),
                ("predicted", "predicted", flight.predicted, unit),
                ("reduction", "predicted reduction", flight.reduction_percent, "%"),
                ("learned_before", "learned before", flight.learned_before_min, "min"),
            ] {
                let finding = Finding::new(SECTION, &format!("{name}_{index}"), &[], what, value, unit);
                study.find(finding.cell("Flight by flight", &format!("{index} {}", flight.name), what));
            }
        }
        study
    }
}
