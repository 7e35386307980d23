//! Layers, networks, flights and learners give the same bits on every core and in WebAssembly: the kernels in assembly, their
//! portable twin beside them, and this machine's.

mod layers;
mod learner;
mod web_assembly;

use std::{fs, path::Path};

use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_model_export::Precision;
use impromptu_tests::{
    mcu::{images::Form, nets::Net},
    twins::{cases::Cases, cores::Core},
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::board::{flight, model};

/// Rows for which a network is evaluated.
const ROWS: usize = 8;
/// Control ticks of a flight, 3 s.
const TICKS: u32 = 1_500;

/// `layers` random layers, the golden models, trained and random networks of all kinds, and flights; none needs more than `room`
/// bytes for its stream or model.
fn cases(layers: usize, room: usize, flights: bool) -> Cases {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    let mut cases = Cases::default();
    for _ in 0..layers {
        layers::add(&mut cases, &mut random, room);
    }
    assert!(cases.unaligned() > layers / 20);

    for name in ["int8-lane.model", "float-skip.model"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/models").join(name);
        let file = fs::read(&path).unwrap();
        let inputs = Model::from_bytes(&file).unwrap().card().features.len();
        let rows: Vec<Vec<f32>> = (0..ROWS).map(|_| (0..inputs).map(|_| random.random_range(-3.0f32..3.0)).collect()).collect();
        cases.network(name, &file, &rows).unwrap();
    }
    let mut evaluated = 0;
    for net in Net::all().unwrap() {
        for precision in [Precision::Int8, Precision::Int16, Precision::Float] {
            let form = Form::Model(precision);
            let file = form.image(&net).unwrap();
            if file.len() <= room {
                cases.network(&form.image_name(&net), &file, &net.counted_inputs()).unwrap();
                evaluated += 1;
            }
        }
    }
    assert!(evaluated >= 2, "integer networks too");

    learner::add(&mut cases);
    for precision in [Precision::Int8, Precision::Float].into_iter().filter(|_| flights) {
        let file = model::file(&model::TANH, precision);
        let model = Model::from_bytes(&file).unwrap();
        let flown = flight::fly(Some((&model, Lanes::BOTH)), TICKS, |_| None);
        cases.flight(&format!("{precision:?}"), &file, &flown.recording, &flown.answers);
    }
    cases
}

fn the_same_bits_on(core: &str, layers: usize) {
    let core = Core::named(core);
    core.run(&cases(layers, core.room, core.flies), &[]).unwrap();
}

#[test]
fn the_same_bits_on_a_cortex_m0() {
    the_same_bits_on("M0", 300);
}

#[test]
fn the_same_bits_on_a_cortex_m3() {
    the_same_bits_on("M3", 300);
}

#[test]
fn the_same_bits_on_a_cortex_m4_with_and_without_its_fpu() {
    the_same_bits_on("M4F", 600);
    the_same_bits_on("M4", 300);
}

#[test]
fn the_same_bits_on_a_cortex_m7() {
    the_same_bits_on("M7", 300);
}

#[test]
fn the_same_bits_on_a_cortex_m33_with_and_without_its_dsp_extension() {
    the_same_bits_on("M33", 300);
    the_same_bits_on("M33, no DSP", 300);
}
