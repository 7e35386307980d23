//! The one stored model type: checked once at load, then borrowed in place.
//!
//! *in* the bytes of a model file; *out* a [`Model`] whose every index, shape and probe has been checked; *never* a panic on
//! any bytes; *source* [`mod@file`] for the layout, [`Card`] for the fields.

mod validate;

use crate::{
    feedback::Lane,
    format::decode,
    guard::Monitor,
    network::{Network, Scratch},
};

pub use crate::format::*;

/// A model that passed every check.
#[derive(Debug)]
pub struct Model<'a> {
    card: Card<'a>,
    blob: Blob<'a>,
    network: Option<Network<'a>>,
    feedback: Option<Lane<'a>>,
    monitor: Option<Monitor<'a>>,
    envelope: (Floats<'a>, Floats<'a>),
    bounds: Bounds<'a>,
    checksum: u32,
    /// The whole file.
    file: &'a [u8],
}

impl<'a> Model<'a> {
    /// No model: where [`Model::load_into`] puts one. A static that starts with it has 4 KB of flash for its few numbers that are
    /// not zero; made at run time, by [`Model::empty`], it has none.
    pub const EMPTY: Self = Self::empty();

    /// [`Model::EMPTY`], made where it is called: a few words are written, what no list has yet is not.
    // Apart from where it is put, whose stack frame need not hold its parts beside it.
    #[inline(never)]
    pub const fn empty() -> Self {
        Self {
            card: Card::empty(),
            blob: Blob::new(&[]),
            network: None,
            feedback: None,
            monitor: None,
            envelope: (Floats::EMPTY, Floats::EMPTY),
            bounds: Bounds::EMPTY,
            checksum: 0,
            file: &[],
        }
    }

    /// Checks a model file and borrows its numbers.
    ///
    /// # Errors
    /// A [`Refusal`] that names what is wrong: header, check sum, card, shapes, indices, values, probes.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let mut model = Self::EMPTY;
        model.load(bytes, &mut Scratch::new())?;
        Ok(model)
    }

    /// [`Model::from_bytes`] into `place`, with the caller's working memory for the probes: for a model in a static, since 3 KB
    /// and 2 KB are much for the stack of a microcontroller. After a refusal it has neither network nor feedback lane.
    ///
    /// # Errors
    /// As [`Model::from_bytes`].
    pub fn load_into<'p>(place: &'p mut Self, bytes: &'a [u8], scratch: &mut Scratch) -> Result<&'p Self, Refusal> {
        if let Err(refusal) = place.load(bytes, scratch) {
            (place.network, place.feedback) = (None, None);
            return Err(refusal);
        }
        Ok(place)
    }

    /// Stage by stage, none of which leaves anything on the stack for the next.
    #[inline(never)]
    fn load(&mut self, bytes: &'a [u8], scratch: &mut Scratch) -> Result<(), Refusal> {
        let Self { card, blob, network, feedback, monitor, envelope, bounds, checksum, file } = self;
        load_card(bytes, card, blob)?;
        validate::card(card)?;
        (*network, *feedback, *monitor) = (None, None, None);
        if let Some(layout) = &card.network {
            Network::load(network, layout, blob, card.features.len(), card.outputs.len())?;
        }
        if let Some(layout) = &card.feedback {
            Lane::load(feedback, layout, blob)?;
        }
        load_rest(card, blob, envelope, monitor, bounds)?;
        let checked = network.as_ref().map(|network| (network, &*envelope, &*bounds));
        validate::network_probes(card, blob, checked, scratch)?;
        if let Some(lane) = feedback {
            validate::lane_probe(card, blob, lane)?;
        }
        (*checksum, *file) = (self::file::checksum(bytes), bytes);
        Ok(())
    }

    /// What the model says of itself.
    pub fn card(&self) -> &Card<'a> {
        &self.card
    }

    /// The bulk numbers to which the card's sections point.
    pub fn blob(&self) -> &Blob<'a> {
        &self.blob
    }

    /// The network lane's map.
    pub fn network(&self) -> Option<&Network<'a>> {
        self.network.as_ref()
    }

    /// The feedback lane's map.
    pub fn feedback(&self) -> Option<&Lane<'a>> {
        self.feedback.as_ref()
    }

    /// The loop's response to corrections; without it the guard has no counterfactual monitor.
    pub fn monitor(&self) -> Option<&Monitor<'a>> {
        self.monitor.as_ref()
    }

    /// Smallest and largest value of each feature in training.
    pub fn envelope(&self) -> (Floats<'a>, Floats<'a>) {
        self.envelope
    }

    /// What the network can do inside of the envelope.
    pub fn bounds(&self) -> &Bounds<'a> {
        &self.bounds
    }

    /// The whole file, which has passed every check.
    pub fn file(&self) -> &'a [u8] {
        self.file
    }

    /// CRC-32 that identifies the file.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}

#[inline(never)]
fn load_card<'a>(bytes: &'a [u8], card: &mut Card<'a>, blob: &mut Blob<'a>) -> Result<(), Refusal> {
    let (card_bytes, blob_bytes) = file::split(bytes)?;
    *blob = Blob::new(blob_bytes);
    if decode::card(card_bytes, card)?.is_empty() { Ok(()) } else { Err(Refusal::Card) }
}

#[inline(never)]
fn load_rest<'a>(
    card: &Card<'a>,
    blob: &Blob<'a>,
    envelope: &mut (Floats<'a>, Floats<'a>),
    monitor: &mut Option<Monitor<'a>>,
    bounds: &mut Bounds<'a>,
) -> Result<(), Refusal> {
    *envelope = blob.floats(card.envelope, 2 * card.features.len(), "envelope")?.split_at(card.features.len());
    [envelope.0, envelope.1].into_iter().try_for_each(|ends| ranges::ENVELOPE.all(ends))?;
    if envelope.0.iter().zip(envelope.1.iter()).any(|(low, high)| low > high) {
        return Err(Refusal::Value { what: "envelope" });
    }
    if let Some(layout) = &card.monitor {
        let loaded = monitor.insert(Monitor::new(layout, blob)?);
        loaded.axes().iter().try_for_each(|(_, taps)| ranges::TAPS.all(*taps))?;
    }
    *bounds = Bounds::new(card, blob)?;
    Ok(())
}
