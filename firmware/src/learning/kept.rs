//! What was learned, as bytes that outlive a power cut.
//!
//! *in* responses and weights of each axis; *out* a file of `32 + 816 axes` bytes, and what it holds; *never* a number that no
//! learner has, a flipped bit, or what was learned of other signals, another rate or another model; *source* this file is the
//! format's specification.
//!
//! | bytes | content |
//! |--:|---|
//! | 0..8 | `IMPRLRND` |
//! | 8..10 | format version, u16 |
//! | 10..12 | axes, u16 |
//! | 12..16 | [`identity`] of the loop, u32 |
//! | 16..20 | CRC-32 (ISO-HDLC) of every other byte of the file, u32 |
//! | 20..24 | rate of the learner, Hz, f32 |
//! | 24..32 | zero |
//! | 32.. | of each axis 204 words: response, 6; seconds in motion that were learned from; mean square by which rows surprise; |
//! | | shares that acted, of all and of the feedback part; weights of the preview part, 13, and of the feedback part, 12; their |
//! | | covariances U D U': D, 13 and 12, U, 78 and 66 |
//!
//! All numbers are little-endian, those of an axis f32 but for the delay. The response is two gains, two poles, the delay in
//! ticks (u32), and the natural frequency in rad a tick.

use core::fmt;

use super::{
    least_squares::{Factors, above},
    response::{RESPONSE_WORDS, Response},
    values::{FEEDBACK, Learned, PREVIEW},
};
use crate::format::{
    Channels,
    file::{CRC, checksum_around},
};

/// First bytes of every file.
const MAGIC: [u8; 8] = *b"IMPRLRND";
const VERSION: u16 = 1;
const HEADER: usize = 32;
/// Where the check sum stands.
const CHECKSUM: usize = 16;
const AXIS_WORDS: usize = RESPONSE_WORDS + 4 + 2 * (PREVIEW + FEEDBACK) + above(PREVIEW) + above(FEEDBACK);
const AXIS: usize = 4 * AXIS_WORDS;
/// No weight is larger: a feature of the size of the axis would ask for a thousand times the axis.
const LARGEST: f32 = 1e3;
/// Nor is anything learned from for longer, s: a year.
const LONGEST: f32 = 3.2e7;

/// Why what was kept is not gone on with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum NotKept {
    /// No file of this kind, or not all of it: as in flash that was never written.
    Nothing,
    /// Another version.
    Version {
        /// Version of the file.
        found: u16,
    },
    /// Damaged.
    Checksum,
    /// A number that no learner has.
    Value {
        /// Axis.
        axis: u16,
    },
    /// Of a loop with another number of axes.
    Axes {
        /// Axes of the file.
        found: u16,
    },
    /// Of other signals, another rate, or beside another model.
    Other,
    /// The loop is being measured: what is kept would be lost.
    Busy,
}

impl fmt::Display for NotKept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing was kept here: learn, then keep"),
            Self::Version { found } => {
                write!(f, "what was kept has format version {found}, this build reads {VERSION}: learn anew, then keep")
            }
            Self::Checksum => f.write_str("what was kept is damaged: learn anew, then keep"),
            Self::Value { axis } => write!(f, "axis {axis} of what was kept holds a number that no learner has: learn anew"),
            Self::Axes { found } => write!(f, "what was kept is of a loop with {found} axes: learn anew, then keep"),
            Self::Other => f.write_str("what was kept is of other signals, another rate, or beside another model: learn anew"),
            Self::Busy => f.write_str("the loop is being measured: wait until it has ended"),
        }
    }
}

impl core::error::Error for NotKept {}

/// Tells loops apart: signals, rate of the learner, Hz, and the check sum of the model that corrects before it, if there is one.
pub fn identity<'a>(signals: impl Into<Channels<'a>>, rate_hz: f32, model: Option<u32>) -> u32 {
    let signals = signals.into();
    let mut digest = CRC.digest();
    for (kind, channels) in [signals.desired, signals.measured, signals.reference].into_iter().enumerate() {
        for channel in channels {
            digest.update(&[kind as u8, channel.end as u8]);
            for text in [channel.name, channel.unit, channel.frame] {
                digest.update(text.as_bytes());
                digest.update(&[0]);
            }
        }
    }
    digest.update(&rate_hz.to_le_bytes());
    digest.update(&model.map_or([0; 5], |sum| {
        let [a, b, c, d] = sum.to_le_bytes();
        [1, a, b, c, d]
    }));
    digest.finalize()
}

/// What is kept of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeptAxis {
    /// How the loop answers.
    pub response: Response,
    /// Seconds in motion that were learned from.
    pub learned_s: f32,
    /// Mean square by which rows of the preview part surprise.
    pub noise: f32,
    /// Shares that acted, 0..=1: of all, and of the feedback part by itself.
    pub shares: [f32; 2],
    /// Weights.
    pub learned: Learned,
    /// How sure they are.
    pub covariances: Covariances,
}

/// How sure the weights of both parts are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariances {
    /// Preview part.
    pub preview: Factors<PREVIEW, { above(PREVIEW) }>,
    /// Feedback part.
    pub feedback: Factors<FEEDBACK, { above(FEEDBACK) }>,
}

/// A checked file.
#[derive(Clone, Copy, Debug)]
pub struct Kept<'a> {
    axes: &'a [[u8; AXIS]],
    /// Of the loop.
    pub identity: u32,
    /// Of the learner, Hz.
    pub rate_hz: f32,
}

impl<'a> Kept<'a> {
    /// Length of a file, bytes.
    pub const fn length(axes: usize) -> usize {
        HEADER + AXIS * axes
    }

    /// Reads a file; what lies behind it, as in a sector of flash, does not count.
    ///
    /// # Errors
    /// If there is none, or it is damaged, or a number is none that a learner has.
    pub fn read(bytes: &'a [u8]) -> Result<Self, NotKept> {
        let (header, _) = bytes.split_first_chunk::<HEADER>().ok_or(NotKept::Nothing)?;
        let half = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
        let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
        if header[..8] != MAGIC {
            return Err(NotKept::Nothing);
        }
        if half(8) != VERSION {
            return Err(NotKept::Version { found: half(8) });
        }
        let file = bytes.get(..Self::length(half(10).into())).ok_or(NotKept::Nothing)?;
        if checksum_around(file, CHECKSUM) != word(CHECKSUM) {
            return Err(NotKept::Checksum);
        }
        let (axes, _) = file.get(HEADER..).unwrap_or_default().as_chunks::<AXIS>();
        let rate_hz = f32::from_bits(word(20));
        if axes.is_empty() || !(rate_hz > 0.0 && rate_hz < 1e6) || header[24..].iter().any(|byte| *byte != 0) {
            return Err(NotKept::Axes { found: half(10) });
        }
        let kept = Self { axes, identity: word(12), rate_hz };
        match axes.iter().position(|axis| read_axis(axis).is_none()) {
            Some(axis) => Err(NotKept::Value { axis: axis as u16 }),
            None => Ok(kept),
        }
    }

    /// How many axes.
    pub fn count(&self) -> u16 {
        self.axes.len() as u16
    }

    /// Each axis.
    pub fn axes(&self) -> impl Iterator<Item = KeptAxis> + use<'a> {
        self.axes.iter().filter_map(read_axis)
    }

    /// Writes a file of so many axes to the start of `bytes`; `None` if it does not fit.
    pub fn write(
        bytes: &mut [u8],
        identity: u32,
        rate_hz: f32,
        count: usize,
        axes: impl Iterator<Item = KeptAxis>,
    ) -> Option<&[u8]> {
        let count = u16::try_from(count).ok()?;
        let file = bytes.get_mut(..Self::length(count.into()))?;
        file.fill(0);
        let (header, rest) = file.split_first_chunk_mut::<HEADER>()?;
        header[..8].copy_from_slice(&MAGIC);
        header[8..10].copy_from_slice(&VERSION.to_le_bytes());
        header[10..12].copy_from_slice(&count.to_le_bytes());
        header[12..16].copy_from_slice(&identity.to_le_bytes());
        header[20..24].copy_from_slice(&rate_hz.to_le_bytes());
        for (place, axis) in rest.as_chunks_mut::<AXIS>().0.iter_mut().zip(axes) {
            write_axis(place, &axis);
        }
        let sum = checksum_around(file, CHECKSUM);
        file.get_mut(CHECKSUM..CHECKSUM + 4)?.copy_from_slice(&sum.to_le_bytes());
        Some(file)
    }
}

// Apart, as it is large.
#[inline(never)]
fn write_axis(place: &mut [u8; AXIS], axis: &KeptAxis) {
    let KeptAxis { response, learned_s, noise, shares: [all, fed], learned, covariances } = axis;
    let Covariances { preview, feedback } = covariances;
    let first = [*learned_s, *noise, *all, *fed];
    let numbers = first.iter().chain(&learned.preview).chain(&learned.feedback);
    let numbers = numbers.chain(&preview.diagonal).chain(&feedback.diagonal).chain(&preview.upper).chain(&feedback.upper);
    let words = response.words().into_iter().chain(numbers.map(|number| number.to_bits()));
    for (place, word) in place.as_chunks_mut::<4>().0.iter_mut().zip(words) {
        *place = word.to_le_bytes();
    }
}

/// So many numbers from the front.
fn take<const N: usize>(words: &mut &[[u8; 4]]) -> Option<[f32; N]> {
    let (first, rest) = words.split_first_chunk::<N>()?;
    *words = rest;
    Some(first.map(f32::from_le_bytes))
}

fn read_axis(bytes: &[u8; AXIS]) -> Option<KeptAxis> {
    let (words, _) = bytes.as_chunks::<4>();
    let (response, mut words) = words.split_first_chunk::<RESPONSE_WORDS>()?;
    let response = Response::from_words(response.map(u32::from_le_bytes))?;
    let words = &mut words;
    let [learned_s, noise, all, fed] = take(words)?;
    let learned = Learned { preview: take(words)?, feedback: take(words)? };
    let (d_preview, d_feedback) = (take(words)?, take(words)?);
    let preview = Factors { diagonal: d_preview, upper: take(words)? };
    let feedback = Factors { diagonal: d_feedback, upper: take(words)? };
    // Written so that NaN is none. Whether a covariance is one that is learned is known with its prior (`Learner::recall`).
    let sane = learned.preview.iter().chain(&learned.feedback).all(|weight| weight.abs() <= LARGEST);
    let known = (0.0..=LONGEST).contains(&learned_s) && (0.0..f32::MAX).contains(&noise);
    let shares = [all, fed];
    let acted = shares.iter().all(|share| (0.0..=1.0).contains(share));
    let covariances = Covariances { preview, feedback };
    (sane && known && acted).then_some(KeptAxis { response, learned_s, noise, shares, learned, covariances })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Channel, EndRule};
    use proptest::prelude::*;

    fn axis(seed: f32) -> KeptAxis {
        let learned = Learned { preview: [seed; PREVIEW], feedback: [-seed; FEEDBACK] };
        let response = Response::second_order(1.0, 3.0 + seed, 0.7, 0.05, 100.0).unwrap();
        let preview = Factors { diagonal: [seed; PREVIEW], upper: [0.5 * seed; above(PREVIEW)] };
        let feedback = Factors { diagonal: [2.0 * seed; FEEDBACK], upper: [-seed; above(FEEDBACK)] };
        KeptAxis {
            response,
            learned_s: 10.0 * seed,
            noise: seed,
            shares: [0.5, 1.0],
            learned,
            covariances: Covariances { preview, feedback },
        }
    }

    #[test]
    fn every_loop_has_its_identity() {
        const ANGLE: Channel<'_> = Channel { name: "angle", unit: "rad", frame: "", end: EndRule::Hold };
        let signals = |channel| [[channel]; 3];
        let of = |[a, b, c]: &[[Channel<'_>; 1]; 3], rate, model| {
            identity(Channels { desired: a, measured: b, reference: c }, rate, model)
        };
        let found = [
            of(&signals(ANGLE), 100.0, None),
            of(&signals(ANGLE), 200.0, None),
            of(&signals(ANGLE), 100.0, Some(0)),
            of(&signals(ANGLE), 100.0, Some(1)),
            of(&signals(Channel { unit: "deg", ..ANGLE }), 100.0, None),
            of(&signals(Channel { name: "anglerad", unit: "", ..ANGLE }), 100.0, None),
        ];
        for (index, one) in found.iter().enumerate() {
            assert!(!found[..index].contains(one), "{found:?}");
        }
    }

    proptest! {
        #[test]
        fn what_is_kept_comes_back_and_a_flipped_bit_does_not(
            seeds in prop::collection::vec(0f32..3.0, 1..5), identity: u32, behind in 0usize..40, at: usize
        ) {
            let axes: Vec<KeptAxis> = seeds.into_iter().map(axis).collect();
            let mut bytes = vec![0xff; Kept::length(axes.len()) + behind];
            let length = Kept::write(&mut bytes, identity, 100.0, axes.len(), axes.iter().copied()).unwrap().len();
            let kept = Kept::read(&bytes).unwrap();
            prop_assert_eq!((kept.identity, kept.rate_hz, kept.count() as usize), (identity, 100.0, axes.len()));
            prop_assert_eq!(kept.axes().collect::<Vec<_>>(), axes);
            prop_assert!(Kept::read(&bytes[..length - 1]).is_err());
            bytes[at / 8 % length] ^= 1 << (at % 8);
            prop_assert!(Kept::read(&bytes).is_err());
        }

        /// Whole files with odd numbers in them, and bytes of any kind.
        #[test]
        fn what_is_read_is_sane(
            words in prop::collection::vec(prop_oneof![any::<u32>(), (-2f32..2.0).prop_map(f32::to_bits)], AXIS_WORDS),
            any in any::<Vec<u8>>()
        ) {
            let _ = Kept::read(&any);
            let mut bytes = [0; Kept::length(1)];
            Kept::write(&mut bytes, 1, 100.0, 1, [axis(1.0)].into_iter()).unwrap();
            for (place, word) in bytes[HEADER..].chunks_mut(4).zip(&words) {
                place.copy_from_slice(&word.to_le_bytes());
            }
            let sum = checksum_around(&bytes, CHECKSUM);
            bytes[16..20].copy_from_slice(&sum.to_le_bytes());
            if let Ok(kept) = Kept::read(&bytes) {
                let KeptAxis { response, learned, .. } = kept.axes().next().unwrap();
                prop_assert!(learned.preview.iter().chain(&learned.feedback).all(|weight| weight.is_finite()));
                let mut filter = super::super::response::Filter::default();
                let most = (0..2000).map(|_| filter.step(&response, 1.0).abs()).fold(0.0, f32::max);
                prop_assert!(most.is_finite());
            }
        }
    }
}
