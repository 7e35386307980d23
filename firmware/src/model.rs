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

/// A model that passed every check, of at most `C` channels in a signal, `O` corrected channels, and `A` axes of the feedback
/// lane and of the monitor.
///
/// Memory is that of the limits, here and in an [adapter](crate::Adapter), and nothing is done for what lies between a model and
/// its limits but zeros. Without numbers they are enough for a vehicle; one axis needs `Model<'_, 1, 1, 1>` and less; an arm of
/// eight, each with position and velocity, a [`LargestModel`].
#[derive(Debug)]
pub struct Model<'a, const C: usize = DEFAULT_CHANNELS, const O: usize = DEFAULT_OUTPUTS, const A: usize = DEFAULT_AXES> {
    card: Card<'a, C, O, A>,
    blob: Blob<'a>,
    network: Option<Network<'a>>,
    feedback: Option<Lane<'a, A>>,
    monitor: Option<Monitor<'a, A>>,
    envelope: (Floats<'a>, Floats<'a>),
    bounds: Bounds<'a>,
    checksum: u32,
    /// The whole file.
    file: &'a [u8],
}

/// A model of any size that a file can have.
pub type LargestModel<'a> = Model<'a, MAX_CHANNELS, MAX_OUTPUTS, MAX_AXES>;

impl<'a> Model<'a> {
    /// Checks a model file and borrows its numbers. The limits are those of a `Model<'_>` without numbers; another type's model
    /// is [`Model::sized`].
    ///
    /// # Errors
    /// A [`Refusal`] that names what is wrong: header, check sum, card, shapes, indices, values, probes.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Refusal> {
        Self::sized(bytes)
    }
}

impl<'a, const C: usize, const O: usize, const A: usize> Model<'a, C, O, A> {
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

    /// [`Model::from_bytes`] of a model whose limits its type says.
    ///
    /// # Errors
    /// As [`Model::from_bytes`].
    pub fn sized(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let mut model = Self::EMPTY;
        model.load(bytes, &mut Scratch::new())?;
        Ok(model)
    }

    /// [`Model::from_bytes`] into `place`, with the caller's working memory for the probes: for a model in a static, since 3 KB
    /// and 2 KB are much for the stack of a microcontroller. After a refusal it has neither network nor feedback lane.
    ///
    /// # Errors
    /// As [`Model::from_bytes`].
    #[inline]
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
    pub fn card(&self) -> &Card<'a, C, O, A> {
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
    pub fn feedback(&self) -> Option<&Lane<'a, A>> {
        self.feedback.as_ref()
    }

    /// The loop's response to corrections; without it the guard has no counterfactual monitor.
    pub fn monitor(&self) -> Option<&Monitor<'a, A>> {
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
fn load_card<'a, const C: usize, const O: usize, const A: usize>(
    bytes: &'a [u8],
    card: &mut Card<'a, C, O, A>,
    blob: &mut Blob<'a>,
) -> Result<(), Refusal> {
    let (card_bytes, blob_bytes) = file::split(bytes)?;
    *blob = Blob::new(blob_bytes);
    if !decode::card(card_bytes, card)?.is_empty() {
        return Err(Refusal::Card);
    }
    // Where the limits are those of version 2, or less, there is nothing to ask.
    let larger = C > DEFAULT_CHANNELS || O > DEFAULT_OUTPUTS || A > DEFAULT_AXES;
    if larger
        && file::version(bytes) == file::OLDEST_VERSION
        && let Some(refusal) = card.beyond_version_2()
    {
        return Err(refusal);
    }
    Ok(())
}

#[inline(never)]
fn load_rest<'a, const C: usize, const O: usize, const A: usize>(
    card: &Card<'a, C, O, A>,
    blob: &Blob<'a>,
    envelope: &mut (Floats<'a>, Floats<'a>),
    monitor: &mut Option<Monitor<'a, A>>,
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
