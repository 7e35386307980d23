//! The table and the flights behind it as CSV, one header line with the names of the JSON document.

use crate::results::{PerFlight, Row};
use anyhow::Context as _;
use impromptu_files::text::cell;
use std::io::Write;

/// Writes the table's rows; a text that a spreadsheet would take for a formula begins with an apostrophe. Units: speed as a
/// factor, `rms_cm_mean` in cm, reductions in %.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_table_csv(rows: &[Row], out: impl Write) -> anyhow::Result<()> {
    let rows: Vec<Row> = rows.iter().map(|row| row.with_texts(cell)).collect();
    write_records(&rows, "vehicle,gains,condition,speed,method,rms_cm_mean,reduction_mean,reduction_worst,seed", out)
        .context("the table cannot be written as CSV")
}

/// Writes one line for each flight. Units: speed as a factor, `rms_cm` in cm, reduction in %.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_flights_csv(flights: &[PerFlight], out: impl Write) -> anyhow::Result<()> {
    let flights: Vec<PerFlight> = flights.iter().map(|flight| flight.with_texts(cell)).collect();
    write_records(&flights, "vehicle,gains,condition,speed,method,trajectory,rms_cm,reduction,seed", out)
        .context("the flights cannot be written as CSV")
}

/// The header is written here, because an empty list must have one too.
fn write_records(records: &[impl serde::Serialize], header: &str, out: impl Write) -> anyhow::Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    writer.write_record(header.split(','))?;
    for record in records {
        writer.serialize(record)?;
    }
    writer.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn what_is_written_is_read_back_under_the_same_names() {
        let results = fixture::small();
        let (mut table, mut flights) = (Vec::new(), Vec::new());
        write_table_csv(&results.table, &mut table).unwrap();
        write_flights_csv(&results.per_flight, &mut flights).unwrap();
        let rows: Vec<Row> = csv::Reader::from_reader(&table[..]).deserialize().map(Result::unwrap).collect();
        let back: Vec<PerFlight> = csv::Reader::from_reader(&flights[..]).deserialize().map(Result::unwrap).collect();
        assert_eq!((rows, back), (results.table, results.per_flight));
    }

    #[test]
    fn texts_are_no_formulae_and_numbers_stay_numbers() {
        let mut results = fixture::small();
        results.table[1].vehicle = "=HYPERLINK(\"http://x\")".into();
        results.table[1].condition = "\t@lab\u{1b}[2J".into();
        results.table[1].reduction_worst = -20.0;
        let mut out = Vec::new();
        write_table_csv(&results.table, &mut out).unwrap();
        let text = String::from_utf8(out.clone()).unwrap();
        assert!(!text.contains(['\u{1b}', '\t']), "{text}");
        let row = csv::Reader::from_reader(&out[..]).records().nth(1).unwrap().unwrap();
        assert_eq!((&row[0], &row[2], &row[7]), ("'=HYPERLINK(\"http://x\")", "'\\u{9}@lab\\u{1b}[2J", "-20.0"));
    }

    #[test]
    fn an_empty_list_still_has_its_header() {
        let mut out = Vec::new();
        write_flights_csv(&[], &mut out).unwrap();
        assert!(out.starts_with(b"vehicle,gains,condition,speed,method,trajectory,rms_cm,reduction,seed\n"));
    }
}
