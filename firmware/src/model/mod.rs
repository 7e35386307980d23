//! The one stored model type: checked once at load, then borrowed in place.
//!
//! *in* the bytes of a model file; *out* a [`Model`] whose every index, shape and probe has been checked; *never* a panic on
//! any bytes; *source* [`mod@file`] for the layout, [`Card`] for the fields.

mod blob;
mod bounds;
mod card;
mod counts;
mod decode;
pub mod file;
mod place;
mod refusal;
mod validate;

pub use blob::{Blob, Floats, Words};
pub use bounds::{Bounds, OutputBounds, Reach};
pub use card::*;
pub use place::Place;
pub use refusal::Refusal;

use crate::{feedback::Lane, guard::Monitor, network::Network};

/// A model that passed every check.
#[derive(Debug)]
pub struct Model<'a> {
    card: Card<'a>,
    blob: Blob<'a>,
    network: Option<Network<'a>>,
    lane: Option<Lane<'a>>,
    monitor: Option<Monitor<'a>>,
    envelope: (Floats<'a>, Floats<'a>),
    bounds: Bounds<'a>,
    checksum: u32,
}

impl<'a> Model<'a> {
    /// No model: where [`Model::load_into`] puts one.
    pub const VACANT: Self = Self {
        card: Card::EMPTY,
        blob: Blob::new(&[]),
        network: None,
        lane: None,
        monitor: None,
        envelope: (Floats::EMPTY, Floats::EMPTY),
        bounds: Bounds::EMPTY,
        checksum: 0,
    };

    /// Checks a model file and borrows its numbers.
    ///
    /// # Errors
    /// A [`Refusal`] that names what is wrong: header, check sum, card, shapes, indices, values, probes.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let mut model = Self::VACANT;
        model.load(bytes)?;
        Ok(model)
    }

    /// [`Model::from_bytes`] into `place`: for a model in a static, since 3 KB are much for the stack of a microcontroller. After a
    /// refusal it has neither network nor lane.
    ///
    /// # Errors
    /// As [`Model::from_bytes`].
    pub fn load_into<'p>(place: &'p mut Self, bytes: &'a [u8]) -> Result<&'p Self, Refusal> {
        if let Err(refusal) = place.load(bytes) {
            (place.network, place.lane) = (None, None);
            return Err(refusal);
        }
        Ok(place)
    }

    #[inline(never)]
    fn load(&mut self, bytes: &'a [u8]) -> Result<(), Refusal> {
        let Self { card, blob, network, lane, monitor, envelope, bounds, checksum } = self;
        let (card_bytes, blob_bytes) = file::split(bytes)?;
        match decode::card(card_bytes, card) {
            Some([]) => {}
            Some(_) => return Err(Refusal::Card),
            None => return Err(counts::refusal(card_bytes)),
        }
        *blob = Blob::new(blob_bytes);
        validate::card(card)?;
        *network = match &card.network {
            Some(layout) => Some(Network::new(layout, blob, card.features.len(), card.outputs.len())?),
            None => None,
        };
        *lane = match &card.lane {
            Some(layout) => Some(Lane::new(layout, blob)?),
            None => None,
        };
        *envelope = blob.floats(card.envelope, 2 * card.features.len(), "envelope")?.split_at(card.features.len());
        if envelope.0.iter().zip(envelope.1.iter()).any(|(low, high)| low > high) {
            return Err(Refusal::Value { what: "envelope" });
        }
        *monitor = card.monitor.as_ref().map(|layout| Monitor::new(layout, blob)).transpose()?;
        *bounds = Bounds::new(card, blob)?;
        validate::probes(card, blob, network.as_ref().map(|network| (network, &*envelope, &*bounds)), lane.as_ref())?;
        *checksum = file::checksum(bytes);
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
    pub fn lane(&self) -> Option<&Lane<'a>> {
        self.lane.as_ref()
    }

    /// The loop's response to corrections; without it the guard cannot judge by evidence.
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

    /// CRC-32 that identifies the file.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }
}
