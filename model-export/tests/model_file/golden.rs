//! The exact bytes of small models: a change of the format, or of what writes it, is seen here. They are also what fuzzing of the
//! decoder starts from. `UPDATE_GOLDEN=1` rewrites them; both format versions are frozen: it must not be needed for a file that
//! exists.

use std::{env, fs, path::Path};

use impromptu_firmware::model::{LargestModel, Model, file};
use impromptu_model_export::{Precision, encode, float_network::Activation};

use crate::{
    fixture::{Numbers, description, network, rows, small_model},
    large::model,
};

/// A float network with a skip, no lane.
fn float_model() -> Vec<u8> {
    let mut numbers = Numbers(2);
    let network = network(&mut numbers, 3, &[(5, Activation::Relu), (9, Activation::Tanh)], 2, true);
    let rows = rows(&mut numbers, &network, 8);
    encode(&description(3), Some(&network), Precision::Float, &rows).unwrap()
}

/// First place where two files differ, with some bytes of both.
fn difference(golden: &[u8], found: &[u8]) -> String {
    let at = golden.iter().zip(found).position(|(a, b)| a != b).unwrap_or(golden.len().min(found.len()));
    let excerpt = |bytes: &[u8]| format!("{:02x?}", bytes.iter().skip(at).take(8).collect::<Vec<_>>());
    format!("{} and {} bytes, from byte {at} on {} and {}", golden.len(), found.len(), excerpt(golden), excerpt(found))
}

#[test]
fn the_format_is_what_it_was() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/models");
    let eight_axes = model(8, Precision::Int8, &[(9, Activation::Relu)], true, 4);
    for (name, bytes, version) in [
        ("float-skip.model", float_model(), 2),
        ("int8-lane.model", small_model(Precision::Int8), 2),
        ("eight-axes.model", eight_axes, 3),
    ] {
        let path = folder.join(name);
        if env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1") {
            fs::write(&path, &bytes).unwrap();
        }
        let golden = fs::read(&path).unwrap();
        assert!(golden == bytes, "{name}: {}", difference(&golden, &bytes));
        // What an older build wrote is read for as long as the version is the same.
        assert!(LargestModel::sized(&golden).is_ok());
        assert_eq!(Model::from_bytes(&golden).is_ok(), version == 2);
        assert_eq!(golden[..12], *[&b"IMPROMPT"[..], &[version, 0, 0, 0]].concat());
    }
    assert_eq!((file::OLDEST_VERSION, file::VERSION, file::HEADER, file::ALIGNMENT), (2, 3, 32, 16));
}
