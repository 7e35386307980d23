//! The diagnosis of logs and of simulated loops, and the gates before a training.

use impromptu_firmware::model::Model;

use crate::program::Folder;

/// A loop in numbers: y(t+2) = 0.8 y(t+1) + gain 0.2 u(t), under steps that a linear congruence draws.
fn log(gain: f64, rows: usize) -> String {
    let mut state = 7u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
    };
    let (mut text, mut reference, mut before, mut measured, mut held) =
        (String::from("time_s,reference,measured\n"), 0.0, 0.0, 0.0, 0);
    for row in 0..rows {
        text += &format!("{},{reference},{}\n", row as f64 * 0.02, measured + 0.01 * uniform());
        measured = 0.8 * measured + 0.2 * gain * before;
        before = reference;
        if held == 0 {
            (reference, held) = (2.0 * uniform(), 5 + (20.0 * (uniform() + 0.5)) as usize);
        }
        held -= 1;
    }
    text
}

#[test]
fn the_log_of_any_loop_is_diagnosed() {
    let folder = Folder::new();
    folder.write("one.csv", log(1.0, 2500));
    folder.write("half.csv", log(0.5, 2500).replace("time_s,reference,measured", "t,setpoint,angle"));
    let found = folder.fine("diagnose --log one.csv --sub-rate 50 --format json").json();
    let diagnosis = &found["channels"][0]["diagnosis"];
    assert_eq!(
        (diagnosis["verdict"].as_str(), diagnosis["properties"]["strict_degree"]["value"].as_u64()),
        (Some("will_help"), Some(2))
    );
    let text = folder.fine("diagnose --log half.csv --columns t,setpoint,angle").stdout;
    for part in [
        "will help without difference learning",
        "steady-state gain",
        "predicted reduction",
        "relative degree",
        "sub-rate",
        "seed 1",
    ] {
        assert!(text.contains(part), "`{part}` is missing in {text}");
    }
    assert_eq!(text, folder.fine("diagnose --log half.csv --columns t,setpoint,angle").stdout);
}

#[test]
fn a_flight_that_broke_down_is_left_out_and_a_log_of_unknown_kind_only_named() {
    let folder = Folder::new();
    folder.fine("collect --condition lab --signal spline --flights 3 --seconds 25 --out logs");
    let good = folder.files("logs", ".csv").join(" ");
    let wanted = folder.fine(&format!("diagnose --log {good} --axis x --delay-ms 24")).stdout;
    // A copy of a flight in which the vehicle leaves half way.
    let text = String::from_utf8(folder.read(&folder.files("logs", ".csv")[0])).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "measured_x_m").unwrap();
    let lines = text.lines().enumerate().map(|(line, text)| {
        let mut cells: Vec<String> = text.split(',').map(str::to_owned).collect();
        if line > 1200 {
            cells[column] = (40.0 + line as f64).to_string();
        }
        cells.join(",") + "\n"
    });
    folder.write("gone.csv", lines.collect::<String>());
    let run = folder.fine(&format!("diagnose --log {good} gone.csv --axis x --delay-ms 24"));
    assert!(run.stderr.contains("gone.csv") && run.stderr.contains("broke down; left out"), "{}", run.stderr);
    assert_eq!(run.stdout, wanted);
    for (name, seed) in [("a", 1.0), ("b", 1.0), ("c", 9.0)] {
        folder.write(
            &format!("{name}.csv"),
            log(1.0, 900)
                .replace(",reference", ",setpoint")
                .lines()
                .enumerate()
                .map(|(line, text)| {
                    let mut cells: Vec<String> = text.split(',').map(str::to_owned).collect();
                    if line > 0 {
                        cells[1..].iter_mut().for_each(|cell| *cell = (seed * cell.parse::<f64>().unwrap()).to_string());
                    }
                    cells.join(",") + "\n"
                })
                .collect::<String>(),
        );
    }
    let run = folder.fine("diagnose --log a.csv b.csv c.csv --columns time_s,setpoint,measured");
    assert!(run.stderr.contains("warning: c.csv") && run.stderr.contains("leave the log out"), "{}", run.stderr);
}

#[test]
fn what_is_wrong_with_a_log_and_what_to_do_is_said() {
    let folder = Folder::new();
    let good = log(1.0, 400);
    let edited = |line: usize, text: &str| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[line] = text;
        lines.join("\n")
    };
    folder.write("short.csv", log(1.0, 30));
    folder.write("nan.csv", edited(40, "0.78,NaN,0"));
    folder.write(
        "gap.csv",
        good.lines()
            .enumerate()
            .filter(|(row, _)| !(100..130).contains(row))
            .map(|(_, line)| format!("{line}\n"))
            .collect::<String>(),
    );
    folder.write("column.csv", good.replacen("measured", "angle", 1));
    folder.write(
        "still.csv",
        (0..300)
            .map(|row| format!("{},1,1\n", f64::from(row) * 0.02))
            .fold("time_s,reference,measured\n".into(), |text: String, row| text + &row),
    );
    folder.refused("diagnose --log short.csv", &["short.csv", "30 rows are too few"]);
    folder.refused("diagnose --log nan.csv", &["nan.csv", "line 41", "`reference`", "NaN"]);
    folder.refused("diagnose --log gap.csv", &["gap.csv", "row 99", "resample"]);
    folder.refused("diagnose --log column.csv", &["column.csv", "`measured`", "time_s, reference, angle", "--columns"]);
    folder.refused("diagnose --log still.csv", &["no excitation", "steps"]);
    folder.refused("diagnose --log absent.csv", &["absent.csv"]);
}

#[test]
fn a_simulated_loop_is_diagnosed_on_every_axis() {
    let folder = Folder::new();
    let found = folder.fine("diagnose --vehicle crazyflie --condition lab --format json").json();
    for axis in 0..3 {
        let channel = &found["channels"][axis];
        assert_eq!(channel["diagnosis"]["verdict"], "will_help", "{channel}");
        let reduction = |end: &str| channel["diagnosis"]["prediction"]["reduction_percent"][end].as_f64().unwrap();
        assert!(reduction("value") > 75.0 && reduction("low") > 60.0, "{channel}");
    }
    let steps = folder.fine("diagnose --vehicle crazyflie --condition lab --test steps --axis x").stdout;
    assert!(steps.contains("will help: stable inverse, gain of one"), "{steps}");
    assert!(steps.contains("steps of the position reference") && steps.contains("\nx\n") && !steps.contains("\ny\n"), "{steps}");
}

#[test]
fn training_refuses_a_gain_that_is_not_one_and_records_that_it_was_forced() {
    let folder = Folder::new();
    folder.fine("collect --condition lab --signal strokes spline --flights 3 --seconds 12 --out logs");
    // As if the loop came only half of the way: every measured position halved.
    for name in folder.files("logs", ".csv") {
        let text = String::from_utf8(folder.read(&name)).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let halved = text.lines().skip(1).map(|line| {
            let cells = line.split(',').zip(&header).map(|(cell, column)| {
                let half = column.starts_with("measured_") && column.ends_with("_m");
                if half { (0.5 * cell.parse::<f64>().unwrap()).to_string() } else { cell.to_owned() }
            });
            cells.collect::<Vec<_>>().join(",")
        });
        let lines: Vec<String> = std::iter::once(header.join(",")).chain(halved).collect();
        folder.write(&name, lines.join("\n"));
    }
    let logs = folder.files("logs", ".csv").join(" ");
    folder.refused(&format!("train --log {logs} --recipe recipe.toml"), &["axis x", "steady-state gain 0.5", "--force"]);
    let run = folder.fine(&format!("train --log {logs} --recipe recipe.toml --force --out models --format json"));
    assert!(run.stderr.contains("warning: gates overridden by --force"), "{}", run.stderr);
    assert!(run.json()["overridden"].as_str().unwrap().contains("steady-state gain"));
    let bytes = folder.read("models/model.impromptu");
    let remarks = Model::from_bytes(&bytes).unwrap().card().provenance.remarks.to_owned();
    assert!(remarks.contains("gates overridden by --force") && remarks.contains("axis z"), "{remarks}");
}

/// Logs as loggers leave them: each is read for what it is, with a note, or refused with the option that settles it.
#[test]
fn logs_of_all_kinds_are_read_for_what_they_are() {
    let folder = Folder::new();
    let good = log(1.0, 2500);
    let lag = |arguments: &str| {
        let run = folder.fine(&format!("diagnose --format json --log {arguments}"));
        let lag = run.json()["channels"][0]["diagnosis"]["properties"]["lag_s"]["value"].as_f64().unwrap();
        (lag, run.stderr)
    };
    folder.write("good.csv", &good);
    let (wanted, _) = lag("good.csv");
    let cells = |of: &dyn Fn(usize, [f64; 3]) -> String| {
        let rows = good.lines().skip(1).enumerate();
        rows.fold("time_s,reference,measured\n".to_owned(), |text, (row, line)| {
            let mut cells = line.split(',').map(|cell| cell.parse::<f64>().unwrap());
            text + &of(row, std::array::from_fn(|_| cells.next().unwrap())) + "\n"
        })
    };
    // The last row is cut short; rows repeat; wild samples; far from zero.
    folder.write("cut.csv", good.clone() + "50.0,0.1");
    folder.write(
        "twice.csv",
        cells(&|row, [t, u, y]| if row % 7 == 3 { format!("{t},{u},{y}\n{t},{u},{y}") } else { format!("{t},{u},{y}") }),
    );
    folder.write("wild.csv", cells(&|row, [t, u, y]| format!("{t},{u},{}", if row % 900 == 50 { 300.0 } else { y })));
    folder.write("far.csv", cells(&|_, [t, u, y]| format!("{t},{},{}", u + 1e4, y + 1e4)));
    for (name, note) in [
        ("cut.csv", "line 2502, the last one, is cut short"),
        ("twice.csv", "repeat the one before"),
        ("wild.csv", "line 52, 952, 1852"),
        ("far.csv", ""),
    ] {
        let (found, said) = lag(name);
        assert!((found / wanted - 1.0).abs() < 0.02 && said.contains(note), "{name}: {found} {wanted} {said}");
    }
    // Time in milliseconds; the other way round; topics that were merged.
    folder.write("ms.csv", cells(&|_, [t, u, y]| format!("{},{u},{y}", (1e3 * t).round())));
    folder.write("flipped.csv", cells(&|_, [t, u, y]| format!("{t},{u},{}", -y)));
    for (name, option) in [("ms.csv", "--time-unit ms"), ("flipped.csv", "--negate-measured")] {
        let refused = folder.run(&format!("diagnose --log {name}"));
        let named = option.split(' ').next().unwrap();
        assert!(refused.code == 2 && refused.stderr.contains(named), "{name}: {}", refused.stderr);
        let (found, _) = lag(&format!("{name} {option}"));
        assert!((found / wanted - 1.0).abs() < 0.02, "{name}: {found} {wanted}");
    }
    folder.write("merged.csv", cells(&|_, [t, u, y]| format!("{},{u},\n{t},,{y}", t - 0.001)));
    let (found, said) = lag("merged.csv");
    assert!((found - wanted).abs() < 0.005 && said.contains("reference was held in 2500 row(s)"), "{found} {wanted} {said}");
}

#[test]
fn time_on_the_ground_is_left_out_and_another_unit_asked_about() {
    let folder = Folder::new();
    let flight = log(1.0, 2000);
    folder.write("cut.csv", &flight);
    let rows: Vec<Vec<f64>> =
        flight.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let with_ground = (0..2600).fold(String::from("time_s,reference,measured\n"), |text, row: usize| {
        let time = row as f64 * 0.02;
        match row.checked_sub(300).and_then(|row| rows.get(row)) {
            Some(row) => text + &format!("{time},{},{}\n", 3.0 + row[1], 3.0 + row[2]),
            None if row < 300 => text + &format!("{time},0,0.01\n"),
            None => text + &format!("{time},0,2.9\n"),
        }
    });
    folder.write("whole.csv", with_ground);
    let of = |name: &str| folder.fine(&format!("diagnose --log {name} --sub-rate 50"));
    let (cut, whole) = (of("cut.csv"), of("whole.csv"));
    for part in ["300 rows up to line 301", "300 rows from line 2302 on"] {
        assert!(whole.stderr.contains(part), "{}", whole.stderr);
    }
    let verdict = |text: &str| text.lines().find(|line| line.starts_with("verdict")).map(|line| line[..60].to_owned());
    assert_eq!(verdict(&cut.stdout), verdict(&whole.stdout));
    let millimetres = rows.iter().fold(String::from("time_s,reference,measured\n"), |text, row| {
        text + &format!("{},{},{}\n", row[0], row[1], 1000.0 * row[2])
    });
    folder.write("mm.csv", millimetres);
    let refusal = folder.run("diagnose --log mm.csv");
    assert!(refusal.code == 2 && refusal.stderr.contains("--measured-scale"), "{}", refusal.stderr);
    assert_eq!(folder.fine("diagnose --log mm.csv --sub-rate 50 --measured-scale 0.001").stdout, cut.stdout);
    let refusal = folder.run("diagnose --log mm.csv --measured-scale 0");
    assert!(refusal.code == 2 && refusal.stderr.contains("1e-9"), "{}", refusal.stderr);
}
