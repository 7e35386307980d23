//! Columns of a log as it is read, row by row.
//!
//! *in* rows of a table; *out* columns that can be what they are taken for, with what was done to them; *never* a measured value
//! that nobody measured; *source* logs of topics that were merged (ULog, rosbag): each topic has a row of its own, and the other
//! cells of that row are empty.

use std::io;

use impromptu_diagnosis::plausibility::{Columns, Implausible, Reading, plausible};
use impromptu_sim::columns::{Row, Table, TableError};

/// Places of the columns in a table.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Time.
    pub time: usize,
    /// Reference.
    pub reference: usize,
    /// Measured value.
    pub measured: usize,
    /// Rate of change of the measured value, if there is one.
    pub rate: Option<usize>,
}

/// What was read so far.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    columns: Columns,
    reference: Option<f64>,
    held: usize,
    skipped: usize,
    /// Line of a last row that was cut short and left out.
    cut: Option<u64>,
}

/// The columns at these places of a table, whose values are of this magnitude at most.
///
/// # Errors
/// Names the cell that is no number, or larger.
pub fn gathered<R: io::Read>(mut table: Table<R>, places: &[Places], largest: f64) -> Result<Vec<Gathered>, TableError> {
    let mut all = vec![Gathered::default(); places.len()];
    for row in table.rows() {
        let row = row?;
        for (&places, gathered) in places.iter().zip(&mut all) {
            gathered.push(&row, places, largest)?;
        }
    }
    all.iter_mut().for_each(|gathered| gathered.cut = table.cut());
    Ok(all)
}

impl Gathered {
    /// A row. Where the reference is empty it is the last one; a row without a measured value is none.
    fn push(&mut self, row: &Row<'_>, places: Places, largest: f64) -> Result<(), TableError> {
        let time = row.number(places.time)?;
        let [reference, measured] = [row.optional(places.reference, largest)?, row.optional(places.measured, largest)?];
        self.reference = reference.or(self.reference);
        let rate = places.rate.map(|place| row.optional(place, largest)).transpose()?;
        let (Some(held), Some(measured), false) = (self.reference, measured, rate == Some(None)) else {
            self.skipped += 1;
            return Ok(());
        };
        self.held += usize::from(reference.is_none());
        self.columns.decimal |= row.text(places.time).contains(['.', 'e', 'E']);
        let Columns { lines, time: times, reference: references, measured: values, rate: rates, .. } = &mut self.columns;
        lines.push(row.line());
        times.push(time);
        references.push(held);
        values.push(measured);
        if let Some(rate) = rate.flatten() {
            rates.get_or_insert_default().push(rate);
        }
        Ok(())
    }

    /// The columns in seconds, and what was done to them; `time` is the name of the time's column.
    ///
    /// # Errors
    /// What they cannot be.
    pub fn plausible(self, time: &str, reading: &Reading) -> Result<(Columns, Vec<String>), Implausible> {
        let Self { columns, held, skipped, cut, .. } = self;
        let mut notes: Vec<String> =
            cut.map(|line| format!("line {line}, the last one, is cut short: left out")).into_iter().collect();
        if held + skipped > 0 {
            notes.push(format!(
                "empty cells: the reference was held in {held} row(s), {skipped} without a measured value left out"
            ));
        }
        let (columns, more) = plausible(columns, time, reading)?;
        notes.extend(more);
        Ok((columns, notes))
    }
}
