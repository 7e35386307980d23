//! Whole flights on the emulated microcontroller: the same bits as on the host, and instruction counts that are golden numbers.

pub(crate) mod flight;
pub(crate) mod model;

use std::fmt::Write;

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_flight::replay::Event;
use impromptu_model_export::Precision;
use impromptu_tests::{board::fly_again, emulator, golden};
use nalgebra::Vector3;
use serde_json::Value;

/// 15 s.
const TICKS: u32 = 7_500;
const GOLDEN: &str = "board.txt";

/// Lines of the golden table for one flight.
fn rows(table: &mut String, flight: &str, report: &Value) {
    for (stage, cost) in report["instructions"].as_object().unwrap() {
        let number = |name: &str| cost[name].as_u64().unwrap();
        let (runs, total) = (number("runs"), number("total"));
        let mean = total as f64 / runs as f64;
        writeln!(table, "{flight:<30} {stage:<9} {runs:>6} {:>9} {:>9} {mean:>12.2}", number("least"), number("most")).unwrap();
    }
    let stack = &report["stack_bytes"];
    writeln!(table, "{flight:<30} stack bytes: {} to load, {} in flight", stack["load"], stack["flight"]).unwrap();
}

/// Lanes that come and go in flight, with a dither in between.
fn switching(tick: u32) -> Option<Event> {
    match tick {
        1_003 => Some(Event::Lanes(Lanes::BOTH)),
        2_000 => Some(Event::Dither(Vector3::new(0.02, -0.02, 0.01))),
        2_501 => Some(Event::Dither(Vector3::zeros())),
        3_333 => Some(Event::Lanes(Lanes { network: false, feedback: true })),
        4_000 => Some(Event::Lanes(Lanes::NONE)),
        5_555 => Some(Event::Lanes(Lanes { network: true, feedback: false })),
        _ => None,
    }
}

#[test]
fn every_bit_equals_the_host_over_whole_flights_and_the_golden_counts_hold() {
    let still = |_| None;
    let mut table = String::new();
    let baseline = flight::fly(None, TICKS, still);
    let report = fly_again("baseline", None, &baseline).unwrap();
    assert_eq!(report, fly_again("baseline", None, &baseline).unwrap(), "two runs of the same flight");
    assert_eq!(report["ticks"], TICKS);
    assert!(report["model"].is_null());
    rows(&mut table, "baseline", &report);

    let network = Lanes { network: true, feedback: false };
    let feedback = Lanes { network: false, feedback: true };
    for shape in [&model::TANH, &model::RELU] {
        for (precision, format) in [(Precision::Int8, "int8"), (Precision::Float, "f32")] {
            let file = model::file(shape, precision);
            let model = Model::from_bytes(&file).unwrap();
            let mut answers = vec![baseline.answers.clone()];
            let mut fly = |what: &str, lanes, switches: fn(u32) -> Option<Event>| {
                let flight = flight::fly(Some((&model, lanes)), TICKS, switches);
                let name = format!("{} {format}, {what}", shape.name.replace('"', ""));
                let report = fly_again(&name, Some(&file), &flight).unwrap();
                assert_eq!(report["model"]["name"], shape.name);
                rows(&mut table, &name, &report);
                flight.answers
            };
            answers.push(fly("both", Lanes::BOTH, still));
            answers.push(fly("network", network, still));
            if (shape.name, precision) == (model::TANH.name, Precision::Int8) {
                answers.push(fly("feedback", feedback, still));
                answers.push(fly("switched", Lanes::NONE, switching));
                let bypass = fly("bypass", Lanes::NONE, still);
                assert!(bypass == baseline.answers, "with both lanes off the add-on changes nothing, to the bit");
            }
            for (index, one) in answers.iter().enumerate() {
                assert!(answers[..index].iter().all(|other| other != one), "every other flight has answers of its own");
            }
        }
    }

    compare(&table);
}

/// Compares the table with the golden one.
fn compare(table: &str) {
    let compiler = emulator::compiler().unwrap();
    let text = format!(
        "Executed instructions of the emulated board in each stage of its test flights; {}=1 rewrites this table.\n\
         compiler: {compiler}\n\n{:<30} {:<9} {:>6} {:>9} {:>9} {:>12}\n{table}",
        golden::UPDATE_VARIABLE,
        "flight",
        "stage",
        "runs",
        "least",
        "most",
        "mean"
    );
    golden::compare(GOLDEN, &text).unwrap();
}
