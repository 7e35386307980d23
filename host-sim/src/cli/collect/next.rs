//! `host-sim collect --next`: which flight next.

use std::{fmt::Write as _, path::PathBuf};

use anyhow::Result;
use impromptu_diagnosis::digits::digits;
use impromptu_loops::{
    LoopDescription,
    built_in::QUADROTOR,
    next::{AxisKnowledge, Knowledge, PAYS_PERCENT, knowledge},
    next_flight::{NextFlight, derivative, next_flight},
    reading::read,
};
use serde::Serialize;

use super::super::{
    Invocation,
    log_reading::{LogReading, say},
    output::{self, table_of},
    train::any_loop::described,
};

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Summary {
    seed: u64,
    #[serde(flatten)]
    known: Knowledge,
    /// The trajectory.
    file: PathBuf,
    /// Of each axis the largest distance from the middle, speed and acceleration of the trajectory.
    asks: Vec<[f64; 3]>,
}

pub(super) fn run(paths: &[PathBuf], name: &str, reading: LogReading, invocation: &Invocation) -> Result<()> {
    let (described, known_layout) = described(name, &paths[0])?;
    let seed = invocation.configuration.seed();
    invocation.console.note(&format!("seed {seed}"));
    let file = invocation.configuration.folder()?.join("next.csv");
    invocation.check_output(&file, paths.iter().map(PathBuf::as_path).chain([std::path::Path::new(name)]))?;
    let reading = reading.reading();
    let mut logs = Vec::with_capacity(paths.len());
    for path in paths {
        let axes = read(path, &described, &reading)?;
        say(invocation, &path.display().to_string(), axes.iter().flat_map(|log| &log.notes));
        logs.push(axes);
    }
    let rate_hz = described.rate_hz.unwrap_or(logs[0][0].rate_hz);
    let known = knowledge(&described, &logs, known_layout.is_some(), seed)?;
    for name in &known.left_out {
        invocation.console.note(&format!("{name}: left out, the loop was lost in it: nothing is asked for because of it"));
    }
    let flight = next_flight(&known, rate_hz, seed);
    output::write(&file, csv(&flight, &described).as_bytes())?;
    let asks = flight.positions.iter().zip(&known.axes).map(|(values, axis)| {
        let from_middle: Vec<f64> = values.iter().map(|value| value - axis.survived[0]).collect();
        [0, 1, 2].map(|order| derivative(&from_middle, rate_hz, order).iter().fold(0.0f64, |most, value| most.max(value.abs())))
    });
    let summary = Summary { seed, asks: asks.collect(), known, file };
    invocation.format.print(&summary, || text(&summary, name))
}

/// The trajectory as `fly` reads it, or with the columns of the loop's own logs.
fn csv(flight: &NextFlight, described: &LoopDescription) -> String {
    let quadrotor = described.name == QUADROTOR;
    let column = |axis: &impromptu_loops::description::AxisDescription| axis.desired.clone().unwrap_or(axis.reference.clone());
    let mut text = if quadrotor {
        "t,x,y,z,yaw\n".to_owned()
    } else {
        let columns = described.axes.iter().map(column);
        std::iter::once(described.time.clone()).chain(columns).collect::<Vec<_>>().join(",") + "\n"
    };
    for tick in 0..flight.positions.first().map_or(0, Vec::len) {
        // Writing into a text does not fail.
        let _ = write!(text, "{}", tick as f64 / flight.rate_hz);
        for values in &flight.positions {
            let _ = write!(text, ",{}", values[tick]);
        }
        text.push_str(if quadrotor { ",0\n" } else { "\n" });
    }
    text
}

/// What is said of an axis.
fn words(axis: &AxisKnowledge) -> String {
    match (axis.excited, axis.left_percent) {
        (false, _) => "not excited: nothing is known of it".into(),
        (true, None) => "too little to identify anything by".into(),
        (true, Some(left)) => format!("what is not known of it leaves {} % of its error", digits(left)),
    }
}

fn text(summary: &Summary, name: &str) -> String {
    let Summary { known, file, asks, .. } = summary;
    let bands = known.axes.first().map_or(&[][..], |axis| &axis.bands);
    let header = ["axis".to_owned(), "so far".to_owned()]
        .into_iter()
        .chain(bands.iter().map(|band| format!("{} … {} Hz", digits(band.hz[0]), digits(band.hz[1]))));
    let of_axis = |axis: &AxisKnowledge| {
        let band = |band: &impromptu_loops::next::Band| {
            let error = band.error_percent.map_or("?".to_owned(), |error| format!("± {} %", digits(error)));
            format!("{} {}\n{error}", digits(band.asked), axis.unit)
        };
        let [_, far, fast, hard] = axis.survived;
        let so_far = format!("± {} {}, {}/s, {}/s²", digits(far), axis.unit, digits(fast), digits(hard));
        [axis.axis.clone(), so_far].into_iter().chain(axis.bands.iter().map(band)).collect::<Vec<_>>()
    };
    let mut text = table_of(header, 2, known.axes.iter().map(of_axis));
    text.push_str("Each band: RMS of what was asked in it, and how well the loop's answer is known there.\n");
    for axis in &known.axes {
        let _ = writeln!(text, "axis {}: {}", axis.axis, words(axis));
    }
    let minutes = known.minutes;
    let _ = match known.gain_percent {
        None => writeln!(text, "{minutes:.1} min so far: another flight pays, of the axes of which nothing is known."),
        Some(gain) if known.pays => writeln!(
            text,
            "{minutes:.1} min so far: as much flight again takes {} % off the error of the axis that is known least: it pays \
             (above {PAYS_PERCENT} %).",
            digits(gain)
        ),
        Some(gain) => writeln!(
            text,
            "{minutes:.1} min so far: as much flight again takes {} % off the error of the axis that is known least: more \
             flights do not pay (below {PAYS_PERCENT} %).",
            digits(gain)
        ),
    };
    for (axis, [far, fast, hard]) in known.axes.iter().zip(asks) {
        let _ = writeln!(
            text,
            "next, axis {}: ± {} {}, {}/s, {}/s² at most",
            axis.axis,
            digits(*far),
            axis.unit,
            digits(*fast),
            digits(*hard)
        );
    }
    let _ = writeln!(text, "trajectory: {}", file.display());
    if name == QUADROTOR {
        let _ = writeln!(text, "flown in the simulator by: host-sim fly --trajectory {} --log flown.csv", file.display());
    }
    text
}
