//! The command line: exit codes, streams, files.

use std::path::{Path, PathBuf};

use impromptu_firmware::model::Model;
use impromptu_model_export::{
    Description, FloatNetwork,
    cli::{FAILED, FINE, USAGE, run},
    description::Tie,
    float_network::Activation,
    rows::read as rows_of_file,
};

use crate::fixture::{Numbers, description, lane, network, rows};

/// A folder with what `train` writes.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        let mut numbers = Numbers(2);
        let float = network(&mut numbers, 3, &[(9, Activation::Tanh)], 2, true);
        float.write(&folder.path("net.safetensors")).unwrap();
        let mut description = description(3);
        description.feedback_lane = Some(lane([vec![-1.0], vec![-0.4]], vec![0.0], -0.5));
        std::fs::write(folder.path("net.json"), description.to_json()).unwrap();
        let mut text = "a,b,c\n".to_owned();
        for row in rows(&mut numbers, &float, 64) {
            text += &format!("{},{},{}\n", row[0], row[1], row[2]);
        }
        std::fs::write(folder.path("net.rows.csv"), text).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs a command whose words that end in a known extension are files of this folder.
    fn run(&self, command: &str) -> (u8, String, String) {
        let file = |word: &str| {
            [".safetensors", ".json", ".csv", ".model", ".txt", ".key", ".pub", ".learned"].iter().any(|end| word.ends_with(end))
        };
        let words = command.split_whitespace().map(|word| if file(word) { self.path(word) } else { Path::new(word).to_owned() });
        let (mut out, mut messages) = (Vec::new(), Vec::new());
        let arguments: Vec<_> = [PathBuf::from("model-export")].into_iter().chain(words).collect();
        let code = run(arguments, &mut out, &mut messages);
        (code, String::from_utf8(out).unwrap(), String::from_utf8(messages).unwrap())
    }
}

#[test]
fn exports_from_a_name_alone_and_the_result_loads() {
    let folder = Folder::new();
    let (code, out, messages) = folder.run("export --network net.safetensors --output net.model");
    assert_eq!((code, messages.as_str()), (FINE, ""));
    assert!(out.contains("over 64 calibration rows") && out.contains("velocity"), "{out}");
    let bytes = std::fs::read(folder.path("net.model")).unwrap();
    let crc = format!("{:08x}", Model::from_bytes(&bytes).unwrap().checksum());
    assert!(out.contains(&crc));
    let (code, out, _) = folder.run("export --network net.safetensors --precision float --output net.model --format json");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, json["calibration_rows"].as_u64()), (FINE, Some(64)));
    let (code, _, messages) = folder.run("export --description net.json --output lane.model");
    assert_eq!(code, FAILED);
    assert!(messages.contains("give the --network"), "{messages}");
}

#[test]
fn a_lane_alone_needs_no_network() {
    let folder = Folder::new();
    let mut lane_only = description(0);
    lane_only.feedback_lane = Some(lane([vec![-1.0], vec![-0.4]], vec![0.0], -0.5));
    std::fs::write(folder.path("lane.json"), lane_only.to_json()).unwrap();
    assert_eq!(folder.run("export --description lane.json --output lane.model").0, FINE);
    let (code, out, _) = folder.run("inspect lane.model");
    assert_eq!(code, FINE);
    assert!(out.contains("network lane   none") && out.contains("1 axes, 1 lags"), "{out}");
    let (code, _, messages) = folder.run("verify lane.model --network net.safetensors");
    assert_eq!(code, FAILED);
    assert!(messages.contains("net.rows.csv") || messages.contains("no network to compare"), "{messages}");
}

/// What a learner kept is told from a model; damaged, it is refused by name.
#[test]
fn inspects_what_was_learned() {
    use impromptu_firmware::learning::{AxisSettings, Kept, LearningAddOn, Limits, Probe, Response};
    let folder = Folder::new();
    let limits = Limits { scale: 1.0, correction: 1.0, feedback: 0.3, rate: 20.0 };
    let response = Response::second_order(1.0, 6.0, 0.7, 0.03, 100.0);
    let axis = AxisSettings { response, limits, probe: Probe { size: 0.05, seconds: 4.0 } };
    let add_on = LearningAddOn::new(&[axis; 2], 100.0, 0.0).unwrap();
    let mut bytes = [0; Kept::length(2)];
    add_on.keep(0xabc, &mut bytes).unwrap();
    std::fs::write(folder.path("a.learned"), bytes).unwrap();
    let (code, out, _) = folder.run("inspect a.learned");
    assert_eq!(code, FINE);
    for words in ["2 axes at 100 Hz, identity 00000abc", "gain 1.000, 6.000 rad/s", "axis 1", "0.000 at -0.17 s", "error rate"] {
        assert!(out.contains(words), "{words}\n{out}");
    }
    let json: serde_json::Value = serde_json::from_str(&folder.run("inspect a.learned --format json").1).unwrap();
    assert_eq!((&json["kind"], json["axes"][1]["preview"].as_array().unwrap().len()), (&"learned".into(), 12));
    assert!((json["axes"][0]["delay_s"].as_f64().unwrap() - 0.03).abs() < 1e-6, "{json}");
    bytes[60] ^= 1;
    std::fs::write(folder.path("a.learned"), bytes).unwrap();
    let (code, _, messages) = folder.run("inspect a.learned");
    assert!(code == FAILED && messages.contains("a.learned") && messages.contains("damaged"), "{messages}");
}

#[test]
fn inspects_for_people_and_programs() {
    let folder = Folder::new();
    folder.run("export --network net.safetensors --output net.model");
    let (code, out, _) = folder.run("inspect net.model");
    assert_eq!(code, FINE);
    for words in [
        "model          small",
        "vehicle        cart",
        "reference 100 Hz, network 10 Hz (every 10 ticks, held in between)",
        "30 ticks (0.3 s) of preview",
        "3-9 tanh-2 and linear skip, int8",
        "51 multiply-adds",
        "margins: delay 30.00 ms, gain 2.00, modulus 0.50",
        "measured position - desired position",
        "desired position - desired position now  m     1..3     -3.0000 to 3.0000",
        "world ENU",
    ] {
        assert!(out.contains(words), "{words}\n{out}");
    }
    let (code, out, _) = folder.run("inspect net.model --format json");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, FINE);
    assert_eq!(json["network"]["layers"][0][1], "Tanh");
    assert_eq!(json["timing"]["preview_ticks"], 30);
    assert_eq!(json["features"].as_array().unwrap().len(), 3);
    assert_eq!(json["feedback_lane"]["axes"][0]["errors"][1], "measured velocity - desired velocity");
    assert_eq!(json["size"]["file"].as_u64().unwrap(), std::fs::metadata(folder.path("net.model")).unwrap().len());
}

#[test]
fn verifies_and_fails_over_a_threshold() {
    let folder = Folder::new();
    folder.run("export --network net.safetensors --output net.model");
    assert_eq!(folder.run("verify net.model").0, FINE);
    let (code, out, _) = folder.run("verify net.model --network net.safetensors --max-rms-percent 2 --max-rms 0.1");
    assert_eq!(code, FINE, "{out}");
    assert!(
        out.contains("same bits on this machine: 4 network probes, 1 feedback lane axes") && out.contains("over 64 rows"),
        "{out}"
    );
    for limit in ["--max-rms-percent 0.0001", "--max-rms 1e-9"] {
        let (code, out, messages) = folder.run(&format!("verify net.model --network net.safetensors --format json {limit}"));
        assert_eq!(code, FAILED);
        assert!(messages.contains("output position: RMS difference") && messages.contains("output velocity"), "{messages}");
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(json["failures"].as_array().unwrap().len(), 2);
    }
    let mut bytes = std::fs::read(folder.path("net.model")).unwrap();
    bytes[100] ^= 4;
    std::fs::write(folder.path("net.model"), bytes).unwrap();
    let (code, out, messages) = folder.run("verify net.model");
    assert_eq!((code, out.as_str()), (FAILED, ""));
    assert!(messages.contains("net.model: check sum"), "{messages}");
}

#[test]
fn nothing_is_overwritten_when_something_fails() {
    let folder = Folder::new();
    folder.run("export --network net.safetensors --output net.model");
    let before = std::fs::read(folder.path("net.model")).unwrap();
    let entries = || std::fs::read_dir(folder.0.path()).unwrap().count();
    let count = entries();
    let failing = [
        ("bad.csv", "a,b,c\n1,2,3\n1,NaN,3\n", "bad.csv, line 3, column 2: `NaN` (b) is not a finite number"),
        ("bad.csv", "a,b\n1,2\n", "2 columns where the model has 3 features"),
    ];
    for (name, text, words) in failing {
        std::fs::write(folder.path(name), text).unwrap();
        let (code, out, messages) =
            folder.run(&format!("export --network net.safetensors --calibration {name} --output net.model"));
        assert_eq!((code, out.as_str()), (FAILED, ""));
        assert!(messages.contains(words), "{messages}");
    }
    let text = std::fs::read_to_string(folder.path("net.json")).unwrap();
    std::fs::write(folder.path("net.json"), text.replace("\"divisor\": 10", "\"divisor\": 0")).unwrap();
    let (code, _, messages) = folder.run("export --network net.safetensors --output net.model");
    assert_eq!(code, FAILED);
    assert!(messages.contains("sub-rate divisor"), "{messages}");
    std::fs::write(folder.path("net.json"), text.replace("\"divisor\"", "\"divider\"")).unwrap();
    let (_, _, messages) = folder.run("export --network net.safetensors --output net.model");
    assert!(messages.contains("net.json") && messages.contains("unknown field `divider`"), "{messages}");
    std::fs::write(folder.path("net.json"), text).unwrap();
    assert_eq!(std::fs::read(folder.path("net.model")).unwrap(), before);
    assert_eq!(entries(), count + 1, "only bad.csv is new");

    std::fs::write(folder.path("notes.txt"), "precious").unwrap();
    let (code, _, messages) = folder.run("export --network net.safetensors --output notes.txt");
    assert_eq!(code, FAILED);
    assert!(messages.contains("not a model file"), "{messages}");
    assert!(folder.run("export --network net.safetensors --output net.safetensors --force").2.contains("same file as the input"));
    assert_eq!(folder.run("export --network net.safetensors --output notes.txt --force").0, FINE);
}

#[test]
fn usage_is_two_and_help_shows_examples() {
    let folder = Folder::new();
    for command in [
        "",
        "fly",
        "inspect",
        "export --output net.model",
        "verify net.model --max-rms -1",
        "export --network net.safetensors --precision int4 --output net.model",
        "verify net.model --data net.rows.csv",
    ] {
        let (code, out, messages) = folder.run(command);
        assert_eq!((code, out.as_str()), (USAGE, ""), "{command}");
        assert!(messages.contains("Usage") || messages.contains("usage") || messages.contains("--help"), "{messages}");
    }
    let (code, out, messages) = folder.run("--help");
    assert_eq!((code, messages.as_str()), (FINE, ""));
    assert!(out.contains("model-export export --network out/net.safetensors"));
    let (code, _, messages) = folder.run("inspect absent.model");
    assert_eq!(code, FAILED);
    assert!(messages.contains("absent.model"));
}

#[test]
fn a_signed_model_is_verified_with_the_signers_key_and_no_other() {
    let folder = Folder::new();
    assert_eq!(folder.run("export --network net.safetensors --output net.model").0, FINE);
    let (code, out, messages) = folder.run("keygen fleet.key");
    assert_eq!((code, messages.as_str()), (FINE, ""));
    let public = std::fs::read_to_string(folder.path("fleet.key.pub")).unwrap();
    assert!(public.trim().ends_with(out.split_whitespace().last().unwrap()), "{out}");
    let private = std::fs::read(folder.path("fleet.key")).unwrap();
    let (code, _, messages) = folder.run("keygen fleet.key");
    assert!(code == FAILED && messages.contains("never replaced"), "{messages}");
    assert_eq!(std::fs::read(folder.path("fleet.key")).unwrap(), private);
    let (code, out, _) = folder.run("sign net.model --key fleet.key --model-version 3 --output signed.model");
    assert!(code == FINE && out.contains("version 3"), "{out}");
    let (file, signed) = ["net.model", "signed.model"].map(|name| std::fs::read(folder.path(name)).unwrap()).into();
    assert!(signed.starts_with(&file) && signed.len() == file.len() + 96);
    let (code, out, _) = folder.run("verify signed.model --key fleet.key.pub");
    assert!(code == FINE && out.contains("signed by this key as version 3"), "{out}");
    // Whoever does not ask reads the file as before.
    assert_eq!(folder.run("verify signed.model").0, FINE);
    let inspected = ["net.model", "signed.model"].map(|name| folder.run(&format!("inspect {name} --format json")).1);
    assert_eq!(inspected[0], inspected[1]);
    assert_eq!(folder.run("keygen other.key").0, FINE);
    for (command, expected) in [
        ("verify signed.model --key other.key.pub", "this key has not signed"),
        ("verify net.model --key fleet.key.pub", "not signed"),
        ("verify signed.model --key fleet.key", "public key"),
        ("sign net.model --key fleet.key.pub --model-version 4 --output more.model", "private key"),
        ("sign signed.model --key fleet.key --model-version 4 --output more.model", "signed already, as version 3"),
        ("sign net.json --key fleet.key --model-version 4 --output more.model", "not a model file"),
        ("sign net.model --key fleet.key --model-version 4 --output net.model", "same file as the input"),
        ("sign net.model --key fleet.key --model-version 4 --output fleet.key", "same file as the input"),
        ("sign net.model --key fleet.key --model-version 4 --output net.rows.csv", "not a model file"),
    ] {
        let (code, _, messages) = folder.run(command);
        assert!(code == FAILED && messages.contains(expected), "{command}: {messages}");
    }
    assert_eq!(folder.run("sign net.model --key fleet.key --output more.model").0, USAGE);
    assert!(!folder.path("more.model").exists());
    assert_eq!(std::fs::read(folder.path("fleet.key")).unwrap(), private);
}

/// The folder's network and another one of the same shape, both with descriptions that say whose they are.
fn tied() -> Folder {
    let folder = Folder::new();
    let mut numbers = Numbers(7);
    network(&mut numbers, 3, &[(9, Activation::Tanh)], 2, true).write(&folder.path("other.safetensors")).unwrap();
    let text = std::fs::read_to_string(folder.path("net.json")).unwrap();
    for name in ["net", "other"] {
        std::fs::copy(folder.path("net.rows.csv"), folder.path(&format!("{name}.copy.csv"))).unwrap();
        let float = FloatNetwork::read(&folder.path(&format!("{name}.safetensors"))).unwrap();
        let rows = rows_of_file(&folder.path("net.rows.csv"), 3).unwrap();
        let mut description = Description::from_json(&text).unwrap();
        description.tie = Some(Tie::of(&float, &rows));
        std::fs::write(folder.path(&format!("{name}.json")), description.to_json()).unwrap();
    }
    std::fs::copy(folder.path("net.rows.csv"), folder.path("other.rows.csv")).unwrap();
    folder
}

#[test]
fn a_network_is_not_exported_with_another_ones_description() {
    let folder = tied();
    let export = "export --output out.model --network";
    for name in ["net", "other"] {
        let (code, _, messages) = folder.run(&format!("{export} {name}.safetensors"));
        assert_eq!((code, messages.as_str()), (FINE, ""));
    }
    let before = std::fs::read(folder.path("out.model")).unwrap();
    let (code, _, messages) = folder.run(&format!("{export} net.safetensors --description other.json"));
    assert_eq!(code, FAILED);
    for part in ["other.json", "another training", "net.safetensors", "network's numbers", "host-sim train", "--untied"] {
        assert!(messages.contains(part), "{part}: {messages}");
    }
    // A set of which a power cut has left some files old: the description, or the rows.
    std::fs::copy(folder.path("other.json"), folder.path("net.json")).unwrap();
    assert_eq!(folder.run(&format!("{export} net.safetensors")).0, FAILED);
    let rows = std::fs::read_to_string(folder.path("other.rows.csv")).unwrap();
    std::fs::write(folder.path("other.rows.csv"), rows.lines().take(60).collect::<Vec<_>>().join("\n")).unwrap();
    let (code, _, messages) = folder.run(&format!("{export} other.safetensors"));
    assert!(code == FAILED && messages.contains("calibration rows"), "{messages}");
    assert_eq!(std::fs::read(folder.path("out.model")).unwrap(), before);
    assert_eq!(folder.run(&format!("{export} other.safetensors --untied")).0, FINE);
}

#[test]
fn a_description_without_a_tie_is_taken_from_beside_its_network_alone() {
    let folder = Folder::new();
    std::fs::copy(folder.path("net.json"), folder.path("else.json")).unwrap();
    let export = "export --output out.model --network net.safetensors";
    assert_eq!(folder.run(export).0, FINE);
    assert_eq!(folder.run(&format!("{export} --description net.json")).0, FINE);
    let (code, _, messages) = folder.run(&format!("{export} --description else.json"));
    assert!(code == USAGE && messages.contains("else.json") && messages.contains("--untied"), "{messages}");
    let (code, _, messages) = folder.run(&format!("{export} --description else.json --untied"));
    assert!(code == FINE && messages.contains("--untied"), "{messages}");
}

#[cfg(unix)]
#[test]
fn places_that_are_no_files_are_left_alone_and_inputs_are_no_outputs() {
    use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _, symlink};
    let folder = Folder::new();
    assert!(std::process::Command::new("mkfifo").arg(folder.path("pipe.model")).status().unwrap().success());
    std::fs::hard_link(folder.path("net.json"), folder.path("hard.model")).unwrap();
    symlink("net.safetensors", folder.path("soft.model")).unwrap();
    let export = |output: &str| folder.run(&format!("export --network net.safetensors --force --output {output}"));
    let (code, _, messages) = export("pipe.model");
    assert!(code == FAILED && messages.contains("no regular file"), "{messages}");
    assert!(std::fs::metadata(folder.path("pipe.model")).unwrap().file_type().is_fifo());
    for output in ["hard.model", "soft.model", "net.json", "net.rows.csv"] {
        let (code, _, messages) = export(output);
        assert!(code == FAILED && messages.contains("same file as the input"), "{output}: {messages}");
    }
    let (code, _, messages) = folder.run("export --network /dev/zero --description net.json --output x.model");
    assert!(code == FAILED && messages.contains("no regular file"), "{messages}");
    assert_eq!(export("net.model").0, FINE);
    std::fs::set_permissions(folder.path("net.model"), std::fs::Permissions::from_mode(0o600)).unwrap();
    assert_eq!(export("net.model").0, FINE);
    assert_eq!(std::fs::metadata(folder.path("net.model")).unwrap().permissions().mode() & 0o777, 0o600);
}

#[test]
fn texts_of_a_model_are_seen_and_not_obeyed() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(folder.path("net.json")).unwrap();
    let mut hostile = Description::from_json(&text).unwrap();
    let fake = "x\u{1b}[2K\r\u{202e}\nSafe to fly";
    (hostile.name, hostile.provenance.vehicle, hostile.provenance.remarks) = (fake.into(), fake.into(), fake.into());
    for channel in hostile.signals.desired.iter_mut().chain(&mut hostile.signals.reference).take(9) {
        (channel.name, channel.frame) = ("y\u{1b}c\nSafe".into(), "z\u{7}".into());
    }
    std::fs::write(folder.path("net.json"), hostile.to_json()).unwrap();
    let mut shown = vec![folder.run("export --network net.safetensors --output net.model")];
    shown.push(folder.run("inspect net.model"));
    shown.push(folder.run("inspect net.model --format json"));
    shown.push(folder.run("verify net.model --network net.safetensors --max-rms 0"));
    for (_, out, messages) in shown {
        for text in [out, messages] {
            assert!(!text.chars().any(|c| (c.is_control() && c != '\n') || c == '\u{202e}'), "{text}");
            assert!(!text.lines().any(|line| line.starts_with("Safe")), "{text}");
        }
    }
}
