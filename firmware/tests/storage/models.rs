//! Small models of a cart, and loops for which they are or are not.

use impromptu_firmware::{
    Cap, Caps,
    adapter::Adapter,
    model::{Channel, Channels, Model, Refusal, file},
    preview::EndRule,
};

/// Samples of the desired trajectory that these loops keep.
const PREVIEW: usize = 192;

pub(crate) const FLOAT: &[u8] = include_bytes!("../models/float-skip.model");
pub(crate) const INTEGER: &[u8] = include_bytes!("../models/int8-lane.model");

/// The file with a correct check sum.
fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    let checksum = file::checksum(&file);
    file[20..24].copy_from_slice(&checksum.to_le_bytes());
    file
}

/// The float model under another name of five letters.
pub(crate) fn named(name: &[u8; 5]) -> Vec<u8> {
    let mut file = FLOAT.to_vec();
    let at = file.windows(5).position(|bytes| bytes == b"small").unwrap();
    file[at..at + 5].copy_from_slice(name);
    sealed(file)
}

/// The float model, undamaged, with a probe that no machine computes.
pub(crate) fn with_wrong_probe() -> Vec<u8> {
    let wrong = (32..FLOAT.len()).rev().find_map(|at| {
        let mut file = FLOAT.to_vec();
        file[at] ^= 1;
        let file = sealed(file);
        matches!(Model::from_bytes(&Aligned::new(&file).0[..file.len()]), Err(Refusal::Probe { .. })).then_some(file)
    });
    wrong.expect("a byte of a probe")
}

#[repr(align(16))]
struct Aligned([u8; 2048]);

impl Aligned {
    fn new(file: &[u8]) -> Box<Self> {
        let mut aligned = Box::new(Self([0; 2048]));
        aligned.0[..file.len()].copy_from_slice(file);
        aligned
    }
}

/// A bound wider than any model's.
const WIDE: Cap = Cap { limit: 1e9, rate: 1e12 };

/// Any loop.
pub(crate) fn anything(_: &Model<'_>) -> Result<(), Refusal> {
    Ok(())
}

/// A servo, which is not for models of a cart.
pub(crate) fn servo(model: &Model<'_>) -> Result<(), Refusal> {
    let angle = [Channel { name: "angle", unit: "rad", frame: "joint", end: EndRule::Hold }];
    let signals = Channels { desired: &angle, measured: &angle, reference: &angle };
    Adapter::<1, 1, 1>::new(model, signals, 100.0, &Caps { channels: &[WIDE], sums: &[] }, PREVIEW).map(drop)
}

/// The cart of all these models.
pub(crate) fn cart(model: &Model<'_>) -> Result<(), Refusal> {
    let known = Model::from_bytes(FLOAT)?;
    Adapter::<2, 2, 2>::new(model, &known.card().signals, 100.0, &Caps { channels: &[WIDE; 2], sums: &[] }, PREVIEW).map(drop)
}
