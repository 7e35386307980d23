//! Results and studies whose texts are seen and not obeyed: what views show.
//!
//! *in* data with texts of others in them (names of vehicles, conditions, trajectories; words); *out* the same with whatever acts
//! on a terminal or a page written out; *never* a number that is changed; *source* [`impromptu_files::text`].

use std::borrow::Cow;

use impromptu_files::text::line;

use crate::{
    figure::{Axis, Curve, Figure},
    results::{FlightTrace, LaneOutcome, ModelCard, PerFlight, Results, Row},
    study::{Cell, Finding, Note, Study},
};

fn text(text: &str) -> String {
    line(text).into_owned()
}

fn option(words: &[(String, String)]) -> Vec<(String, String)> {
    words.iter().map(|(name, words)| (text(name), text(words))).collect()
}

impl Row {
    /// The row with each text put through `mend`.
    pub(crate) fn with_texts(&self, mend: fn(&str) -> Cow<'_, str>) -> Self {
        let mend = |text: &str| mend(text).into_owned();
        Self { vehicle: mend(&self.vehicle), gains: mend(&self.gains), condition: mend(&self.condition), ..self.clone() }
    }
}

impl PerFlight {
    /// The flight with each text put through `mend`.
    pub(crate) fn with_texts(&self, mend: fn(&str) -> Cow<'_, str>) -> Self {
        let mend = |text: &str| mend(text).into_owned();
        Self {
            vehicle: mend(&self.vehicle),
            gains: mend(&self.gains),
            condition: mend(&self.condition),
            trajectory: mend(&self.trajectory),
            ..self.clone()
        }
    }
}

impl Results {
    /// The same with harmless texts.
    pub(crate) fn harmless(&self) -> Self {
        let trace = |trace: &FlightTrace| FlightTrace {
            trajectory: text(&trace.trajectory),
            vehicle: text(&trace.vehicle),
            gains: text(&trace.gains),
            condition: text(&trace.condition),
            ..trace.clone()
        };
        let model = |model: &ModelCard| ModelCard {
            name: text(&model.name),
            vehicle: text(&model.vehicle),
            gains: text(&model.gains),
            condition: text(&model.condition),
            lane: match &model.lane {
                LaneOutcome::Chosen(design) => LaneOutcome::Chosen(text(design)),
                LaneOutcome::Refused(reason) => LaneOutcome::Refused(text(reason)),
            },
            ..model.clone()
        };
        Self {
            title: text(&self.title),
            command: text(&self.command),
            seed: self.seed,
            software_version: text(&self.software_version),
            table: self.table.iter().map(|row| row.with_texts(line)).collect(),
            flights: self.flights.iter().map(trace).collect(),
            per_flight: self.per_flight.iter().map(|flight| flight.with_texts(line)).collect(),
            models: self.models.iter().map(model).collect(),
            timings: self.timings.iter().map(|(stage, seconds)| (text(stage), *seconds)).collect(),
            conditions: option(&self.conditions),
            notes: self.notes.iter().map(|note| text(note)).collect(),
        }
    }
}

impl Study {
    /// The same with harmless texts.
    #[must_use]
    pub fn harmless(&self) -> Self {
        let cell = |cell: &Cell| Cell { table: text(&cell.table), row: text(&cell.row), column: text(&cell.column) };
        let finding = |finding: &Finding| Finding {
            section: text(&finding.section),
            name: text(&finding.name),
            what: text(&finding.what),
            unit: text(&finding.unit),
            cell: finding.cell.as_ref().map(cell),
            ..finding.clone()
        };
        let axis = |axis: &Axis| Axis { label: text(&axis.label), ..axis.clone() };
        let figure = |figure: &Figure| Figure {
            section: text(&figure.section),
            name: text(&figure.name),
            title: text(&figure.title),
            x: axis(&figure.x),
            y: axis(&figure.y),
            curves: figure.curves.iter().map(|curve| Curve { label: text(&curve.label), ..curve.clone() }).collect(),
        };
        Self {
            title: text(&self.title),
            command: text(&self.command),
            seed: self.seed,
            findings: self.findings.iter().map(finding).collect(),
            figures: self.figures.iter().map(figure).collect(),
            notes: self.notes.iter().map(|note| Note { section: text(&note.section), text: text(&note.text) }).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{console_table, fixture, render_html, render_study, study::Asked};

    const FAKE: &str = "lab\u{1b}[2K\r\u{202e}\nSafe to fly <b>";

    #[test]
    fn no_view_of_results_passes_a_control_character_on() {
        let mut results = fixture::full();
        let fake = || FAKE.to_owned();
        (results.title, results.command, results.software_version) = (fake(), fake(), fake());
        results.notes.push(fake());
        results.conditions.push((fake(), fake()));
        results.timings.push((fake(), 1.0));
        for row in &mut results.table {
            (row.vehicle, row.gains, row.condition) = (fake(), fake(), fake());
        }
        for flight in &mut results.per_flight {
            (flight.vehicle, flight.gains, flight.condition, flight.trajectory) = (fake(), fake(), fake(), fake());
        }
        for flight in &mut results.flights {
            (flight.vehicle, flight.gains, flight.condition, flight.trajectory) = (fake(), fake(), fake(), fake());
        }
        for model in &mut results.models {
            (model.name, model.vehicle, model.gains, model.condition) = (fake(), fake(), fake(), fake());
            model.lane = LaneOutcome::Refused(fake());
        }
        for view in [console_table(&results), render_html(&results).unwrap()] {
            assert!(!view.chars().any(|c| impromptu_files::text::acts(c) && c != '\n'));
            assert!(!view.lines().any(|line| line.trim_start().starts_with("Safe to fly")));
        }
    }

    #[test]
    fn nor_does_the_page_of_a_study() {
        let mut study = Study::new(FAKE, FAKE, 1);
        study.find(Finding::new(FAKE, FAKE, &[], FAKE, 1.0, FAKE).asked(Asked::AtMost(2.0)));
        study.find(Finding::new(FAKE, FAKE, &[], FAKE, 1.0, FAKE).cell(FAKE, FAKE, FAKE));
        study.note(FAKE, FAKE);
        let (x, y) = (Axis::linear(FAKE), Axis::linear(FAKE));
        let curves = vec![Curve::line(FAKE, [(0.0, 1.0), (1.0, 2.0)])];
        study.draw(Figure { section: FAKE.into(), name: FAKE.into(), title: FAKE.into(), x, y, curves });
        let page = render_study(&study).unwrap();
        assert!(!page.chars().any(|c| impromptu_files::text::acts(c) && c != '\n'));
        assert!(page.contains("Safe to fly &lt;b&gt;"));
    }
}
