//! The command line: exit codes, streams, files.

use std::path::{Path, PathBuf};

use impromptu_firmware::model::Model;
use impromptu_model_export::{
    cli::{FAILED, FINE, USAGE, run},
    float_network::Activation,
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
        let file = |word: &str| [".safetensors", ".json", ".csv", ".model", ".txt"].iter().any(|end| word.ends_with(end));
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
    assert!(folder.run("export --network net.safetensors --output net.safetensors --force").2.contains("is an input"));
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
