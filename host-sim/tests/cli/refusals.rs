//! What is refused, how it is named, and that nothing is overwritten.

use crate::program::Folder;

#[test]
fn unknown_keys_of_a_configuration_are_named() {
    let folder = Folder::new();
    folder.write("demo.toml", "seed = 3\n[recipe]\nstrid = 4\n");
    folder.write("quick.toml", "stride = 4\n[network]\nepoch = 4\n");
    folder.refused("--config demo.toml", &["demo.toml, line 3", "`strid`"]);
    folder.refused("fly --trajectory circle --config demo.toml", &["demo.toml, line 3", "`strid`"]);
    folder.refused("fly --trajectory circle --config absent.toml", &["absent.toml"]);
    folder.refused("train --log log.csv --recipe quick.toml", &["quick.toml, line 3", "`epoch`"]);
}

#[test]
fn unknown_names_are_answered_with_the_known_ones() {
    let folder = Folder::new();
    folder.refused("fly --trajectory circle --vehicle crazyfly", &["--vehicle", "`crazyfly`", "crazyflie-brushless"]);
    folder.refused("fly --trajectory circle --gains hard", &["--gains", "`hard`", "soft, stock"]);
    folder.refused("fly --trajectory circle --condition wet", &["--condition", "`wet`", "clean, lab, rough"]);
    folder.refused("fly --trajectory round", &["`round`", "figure8"]);
}

#[test]
fn a_loop_is_refused_where_it_cannot_fly() {
    let folder = Folder::new();
    for (words, named) in [
        ("fly --pil --learn 30", "--pil: it learns from each stroke for the next ones; leave out the SECONDS of --learn"),
        ("fly --pil --controller pid", "--pil: the firmware flies its own loop, se3; leave out --controller pid"),
        ("fly --trajectory circle --controller pid --gains soft", "--gains soft: --controller pid has its own gains"),
        ("train --log a.csv --vehicle crazyflie --controller mellinger --gains soft", "--controller mellinger has its own gains"),
        ("fly --trajectory circle --controller lqr", "known names: se3, pid, mellinger, mellinger_feed_forward"),
    ] {
        let run = folder.run(words);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{words}: {}", run.stderr);
        assert!(run.stderr.contains(named), "{words}: {}", run.stderr);
    }
    let named = ["--controller", "`pid`", "vehicle `hummingbird`", "0.5 kg"];
    folder.refused("fly --trajectory circle --controller pid --vehicle hummingbird", &named);
    let flown = folder.fine("fly --trajectory circle --controller pid");
    assert!(flown.stdout.contains("crazyflie pid lab"), "{}", flown.stdout);
}

#[test]
fn malformed_trajectories_are_refused_and_nothing_is_overwritten() {
    let folder = Folder::new();
    folder.write("out.csv", "precious");
    folder.write("word.csv", "t,x,y,z\n0,0,0,1\n1,0,zero,1\n2,0,0,1\n3,0,0,1\n");
    folder.write("short.csv", "t,x,y,z\n0,0,0,1\n1,0,0\n2,0,0,1\n3,0,0,1\n");
    folder.write("nan.csv", "t,x,y,z\n0,0,0,1\n1,0,0,1\n2,0,0,NaN\n3,0,0,1\n");
    for (file, place) in [("word.csv", ["line 3", "`y`"]), ("short.csv", ["line 3", "`z`"]), ("nan.csv", ["line 4", "`z`"])] {
        folder.refused(&format!("fly --trajectory {file} --log out.csv"), &[file, place[0], place[1]]);
        folder.refused(&format!("trajectory {file} --output out.csv"), &[file, place[0], place[1]]);
    }
    folder.refused("fly --trajectory absent.csv --log out.csv", &["absent.csv"]);
    assert_eq!(folder.read("out.csv"), b"precious");
}

#[test]
fn logs_with_bad_rows_are_refused_and_nothing_is_overwritten() {
    let folder = Folder::new();
    folder.fine("fly --trajectory circle --log good.csv");
    let good = String::from_utf8(folder.read("good.csv")).unwrap();
    let mut lines: Vec<&str> = good.lines().collect();
    let broken = lines[40].replacen(|c: char| c.is_ascii_digit(), "x", 1);
    let not_a_number = format!("{},NaN{}", &lines[40][..lines[40].find(',').unwrap()], {
        let rest = lines[40].split_once(',').unwrap().1;
        &rest[rest.find(',').unwrap()..]
    });
    std::fs::create_dir(folder.path("models")).unwrap();
    folder.write("models/model.impromptu", "precious");
    for (name, row, field) in [("nan.csv", not_a_number.as_str(), "`desired_x_m`"), ("word.csv", broken.as_str(), "`time_s`")] {
        lines[40] = row;
        folder.write(name, lines.join("\n"));
        folder.refused(&format!("train --log good.csv {name} --out models"), &[name, "line 41", field]);
    }
    folder.write("column.csv", good.replacen("measured_vx_m_s", "speed", 1));
    folder.refused("train --log good.csv column.csv --out models", &["column.csv", "`measured_vx_m_s`", "train --help"]);
    folder.refused("train --log good.csv --out models", &["two logs"]);
    assert_eq!(folder.read("models/model.impromptu"), b"precious");
    assert_eq!(folder.files("models", "").len(), 1);
}

#[test]
fn logs_of_a_vehicle_that_stands_still_teach_nothing() {
    let folder = Folder::new();
    folder.write("hover.csv", "t,x,y,z\n0,0,0,1\n1,0,0,1\n2,0,0,1\n3,0,0,1\n");
    folder.fine("fly --trajectory hover.csv --log hovering.csv");
    folder.refused("train --log hovering.csv hovering.csv", &["no excitation", "--log"]);
}

#[test]
fn damaged_models_are_refused_by_name() {
    let folder = Folder::new();
    folder.write("text.impromptu", "not a model at all, but long enough to hold a header");
    folder.write("empty.impromptu", "");
    for file in ["text.impromptu", "empty.impromptu", "absent.impromptu"] {
        folder.refused(&format!("fly --trajectory circle --model {file} --log out.csv"), &[file]);
        folder.refused(&format!("evaluate --model {file}"), &[file]);
    }
    assert!(!folder.path("out.csv").exists());
}
