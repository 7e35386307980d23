//! The table and the flights behind it as CSV, one header line with the names of the JSON document.

use crate::results::{PerFlight, Row};
use anyhow::Context as _;
use std::io::Write;

/// Writes the table's rows. Units: speed as a factor, `rms_cm_mean` in cm, reductions in %.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_table_csv(rows: &[Row], out: impl Write) -> anyhow::Result<()> {
    write_records(rows, "vehicle,gains,condition,speed,method,rms_cm_mean,reduction_mean,reduction_worst,seed", out)
        .context("the table cannot be written as CSV")
}

/// Writes one line for each flight. Units: speed as a factor, `rms_cm` in cm, reduction in %.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_flights_csv(flights: &[PerFlight], out: impl Write) -> anyhow::Result<()> {
    write_records(flights, "vehicle,gains,condition,speed,method,trajectory,rms_cm,reduction,seed", out)
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
    fn an_empty_list_still_has_its_header() {
        let mut out = Vec::new();
        write_flights_csv(&[], &mut out).unwrap();
        assert!(out.starts_with(b"vehicle,gains,condition,speed,method,trajectory,rms_cm,reduction,seed\n"));
    }
}
