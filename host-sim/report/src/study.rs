//! What a study found: numbers, figures and paragraphs by section, beside what a paper states.
//!
//! *in* findings; *out* a [`Study`] that views show; *never* a number without a name, or one that the report shows and the JSON
//! document lacks.

use serde::{Deserialize, Serialize};

use crate::figure::Figure;

/// A bound that a number should keep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Asked {
    /// At least so much.
    AtLeast(f64),
    /// At most so much.
    AtMost(f64),
}

/// Where a number stands in a table of its section.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cell {
    /// Title of the table.
    pub table: String,
    /// Title of the row.
    pub row: String,
    /// Title of the column.
    pub column: String,
}

/// A number that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Section of the report.
    pub section: String,
    /// Name in the JSON document, in snake case, unique.
    pub name: String,
    /// Rows of the paper that it answers.
    #[serde(default)]
    pub rows: Vec<u8>,
    /// What it is.
    pub what: String,
    /// The number.
    pub value: f64,
    /// Its unit; empty for none.
    #[serde(default)]
    pub unit: String,
    /// What the paper states.
    #[serde(default)]
    pub paper: Option<f64>,
    /// What it should keep.
    #[serde(default)]
    pub asked: Option<Asked>,
    /// Its place in a table of the section.
    #[serde(default)]
    pub cell: Option<Cell>,
}

impl Finding {
    /// A number of a section.
    pub fn new(section: &str, name: &str, rows: &[u8], what: &str, value: f64, unit: &str) -> Self {
        Self {
            section: section.into(),
            name: name.into(),
            rows: rows.into(),
            what: what.into(),
            value,
            unit: unit.into(),
            paper: None,
            asked: None,
            cell: None,
        }
    }

    /// In a table of its section.
    #[must_use]
    pub fn cell(self, table: &str, row: &str, column: &str) -> Self {
        Self { cell: Some(Cell { table: table.into(), row: row.into(), column: column.into() }), ..self }
    }

    /// With what the paper states.
    #[must_use]
    pub fn paper(self, value: f64) -> Self {
        Self { paper: Some(value), ..self }
    }

    /// With a bound.
    #[must_use]
    pub fn asked(self, asked: Asked) -> Self {
        Self { asked: Some(asked), ..self }
    }

    /// Whether the bound is kept; `None` without one.
    pub fn meets(&self) -> Option<bool> {
        self.asked.map(|asked| match asked {
            Asked::AtLeast(bound) => self.value >= bound,
            Asked::AtMost(bound) => self.value <= bound,
        })
    }

    /// The number with its unit.
    pub fn text(&self) -> String {
        with_unit(self.value, &self.unit)
    }

    /// What the paper states, or nothing.
    pub fn paper_text(&self) -> String {
        self.paper.map_or_else(String::new, |value| with_unit(value, &self.unit))
    }

    /// The bound, or nothing.
    pub fn asked_text(&self) -> String {
        match self.asked {
            None => String::new(),
            Some(Asked::AtLeast(bound)) => format!("\u{2265} {}", with_unit(bound, &self.unit)),
            Some(Asked::AtMost(bound)) => format!("\u{2264} {}", with_unit(bound, &self.unit)),
        }
    }

    /// Rows of the paper, as `4, 7`.
    pub fn rows_text(&self) -> String {
        listed(&self.rows)
    }
}

/// Numbers of rows, as `4, 7`.
pub fn listed(rows: &[u8]) -> String {
    rows.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn with_unit(value: f64, unit: &str) -> String {
    let magnitude = value.abs();
    let number = match magnitude {
        _ if !value.is_finite() => "n/a".to_owned(),
        _ if value == 0.0 || (1e-2..1e5).contains(&magnitude) && value.fract() == 0.0 => format!("{value:.0}"),
        0.1..1e5 if unit == "%" => format!("{value:.1}"),
        1e-2..1e1 => format!("{value:.3}"),
        1e1..1e5 => format!("{value:.1}"),
        _ => format!("{value:.1e}"),
    };
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// A paragraph of a section.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// Section of the report.
    pub section: String,
    /// The paragraph.
    pub text: String,
}

/// Everything that a study found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Title of the report.
    pub title: String,
    /// The command that repeats it.
    pub command: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Numbers.
    pub findings: Vec<Finding>,
    /// Figures.
    pub figures: Vec<Figure>,
    /// Paragraphs.
    pub notes: Vec<Note>,
}

impl Study {
    /// A study that has found nothing yet.
    pub fn new(title: &str, command: &str, seed: u64) -> Self {
        Self { title: title.into(), command: command.into(), seed, findings: Vec::new(), figures: Vec::new(), notes: Vec::new() }
    }

    /// Adds a number.
    pub fn find(&mut self, finding: Finding) {
        self.findings.push(finding);
    }

    /// Adds a figure.
    pub fn draw(&mut self, figure: Figure) {
        self.figures.push(figure);
    }

    /// Adds a paragraph to a section.
    pub fn note(&mut self, section: &str, text: &str) {
        self.notes.push(Note { section: section.into(), text: text.into() });
    }

    /// Numbers of a section.
    pub fn of_section<'a>(&'a self, section: &'a str) -> impl Iterator<Item = &'a Finding> {
        self.findings.iter().filter(move |finding| finding.section == section)
    }

    /// Sections in the order in which something was first said of them.
    pub fn sections(&self) -> Vec<&str> {
        let mut sections: Vec<&str> = Vec::new();
        let all = self.findings.iter().map(|finding| finding.section.as_str());
        for section in all
            .chain(self.notes.iter().map(|note| note.section.as_str()))
            .chain(self.figures.iter().map(|figure| figure.section.as_str()))
        {
            if !sections.contains(&section) {
                sections.push(section);
            }
        }
        sections
    }

    /// The number of that name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.findings.iter().find(|finding| finding.name == name).map(|finding| finding.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_kept_or_not_and_no_number_keeps_none() {
        let finding = Finding::new("s", "n", &[4, 7], "what", 2e-6, "m");
        assert_eq!(finding.meets(), None);
        assert_eq!(finding.clone().asked(Asked::AtMost(1e-6)).meets(), Some(false));
        assert_eq!(Finding { value: f64::NAN, ..finding.clone() }.asked(Asked::AtLeast(0.0)).meets(), Some(false));
        assert_eq!((finding.text().as_str(), finding.rows_text().as_str()), ("2.0e-6 m", "4, 7"));
    }
}
