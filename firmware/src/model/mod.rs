//! The one stored model type: checked once at load, then borrowed in place.
//!
//! *in* the bytes of a model file; *out* a [`Model`] whose every index, shape and probe has been checked; *never* a panic on
//! any bytes; *source* [`mod@file`] for the layout, [`Card`] for the fields.

mod blob;
mod bounds;
mod card;
mod counts;
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
    /// Checks a model file and borrows its numbers.
    ///
    /// # Errors
    /// A [`Refusal`] that names what is wrong: header, check sum, card, shapes, indices, values, probes.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let (card, blob) = file::split(bytes)?;
        let (card, rest) = postcard::take_from_bytes::<Card<'a>>(card).map_err(|_| counts::refusal(card))?;
        if !rest.is_empty() {
            return Err(Refusal::Card);
        }
        let blob = Blob::new(blob);
        validate::card(&card)?;
        let network = match &card.network {
            Some(layout) => Some(Network::new(layout, &blob, card.features.len(), card.outputs.len())?),
            None => None,
        };
        let lane = match &card.lane {
            Some(layout) => Some(Lane::new(layout, &blob)?),
            None => None,
        };
        let monitor = card.monitor.as_ref().map(|layout| Monitor::new(layout, &blob)).transpose()?;
        let envelope = blob.floats(card.envelope, 2 * card.features.len(), "envelope")?.split_at(card.features.len());
        if envelope.0.iter().zip(envelope.1.iter()).any(|(low, high)| low > high) {
            return Err(Refusal::Value { what: "envelope" });
        }
        let bounds = Bounds::new(&card, &blob)?;
        validate::probes(&card, &blob, network.as_ref().map(|network| (network, &envelope, &bounds)), lane.as_ref())?;
        Ok(Self { card, blob, network, lane, monitor, envelope, bounds, checksum: file::checksum(bytes) })
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
