//! Why a model file is not flown.
//!
//! *in* what a check found; *out* a sentence that names it and says what to do; *never* a refusal without what was found;
//! *source* the checks at load.

use core::fmt;

use super::limits::OLDEST;

/// The reason, with the name of what is wrong. `Display` also says what to do.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Refusal {
    /// Fewer bytes than a header.
    TooShort {
        /// Bytes found.
        found: usize,
    },
    /// The first eight bytes are not the format's.
    NotAModel,
    /// Another format version.
    Version {
        /// Version in the file.
        found: u16,
        /// Newest version that this build reads.
        expected: u16,
    },
    /// The header's lengths and the number of bytes disagree.
    Length {
        /// Bytes that the header announces.
        expected: u64,
        /// Bytes found.
        found: usize,
    },
    /// The check sum is wrong: a damaged file.
    Checksum {
        /// Check sum in the file.
        stored: u32,
        /// Check sum of the bytes.
        computed: u32,
    },
    /// The card cannot be decoded: it is damaged, or a list inside of one of its fields is longer than this build holds.
    Card,
    /// A count or shape is impossible or beyond this build's fixed sizes.
    Shape {
        /// The field.
        what: &'static str,
        /// Value in the file.
        found: u32,
        /// Largest (or only) value that is possible.
        limit: u32,
    },
    /// A section has another length than its shape asks for.
    SectionLength {
        /// The section.
        what: &'static str,
        /// Bytes that the shape asks for.
        expected: u32,
        /// Bytes in the file.
        found: u32,
    },
    /// A section does not start at a multiple of 16 bytes.
    SectionAlignment {
        /// The section.
        what: &'static str,
    },
    /// A section lies outside of the blob.
    SectionRange {
        /// The section.
        what: &'static str,
    },
    /// A number is NaN or infinite.
    NotFinite {
        /// The field or section.
        what: &'static str,
    },
    /// A number is outside of its meaningful range.
    Value {
        /// The field.
        what: &'static str,
    },
    /// An index names a channel or output that the model does not have.
    Index {
        /// The field.
        what: &'static str,
        /// The index.
        found: u8,
    },
    /// An index that may occur only once.
    Duplicate {
        /// The field.
        what: &'static str,
        /// The index.
        found: u8,
    },
    /// An integer layer could overflow its accumulator.
    Overflow {
        /// Layer, from 0.
        layer: u8,
    },
    /// A probe gave other bits than the file says: this machine would fly another network.
    Probe {
        /// Index of the probe; `u8::MAX` for the feedback lane's.
        index: u8,
    },
    /// A network without a single probe: nothing would show that this machine computes what was meant.
    NoProbes,
    /// A probe inside of the envelope gives an output that the stored bounds exclude.
    Bounds {
        /// Index of the output.
        output: u8,
    },
    /// All that the network gives inside of the envelope lies beyond the output's limit.
    Limit {
        /// Index of the output.
        output: u8,
    },
    /// The application stores signed models only, and behind this one is no signature.
    Unsigned,
    /// None of the application's keys has signed this model with this version: another key, or a byte is not what was signed.
    Signature,
    /// A model is stored whose signed version is higher.
    Downgrade {
        /// Version of this model.
        found: u32,
        /// Lowest version that is stored.
        floor: u32,
    },
    /// The signal tables of the model and of the application differ.
    Signal {
        /// `desired`, `measured` or `reference`.
        signal: &'static str,
        /// First channel that differs.
        channel: u8,
    },
    /// The application's preview is shorter than the model's window.
    Preview {
        /// Samples that the model needs.
        needed: u32,
        /// Samples that the application keeps.
        available: u32,
    },
    /// The application runs its references at another rate.
    Rate {
        /// Rate of the model, Hz.
        model: f32,
        /// Rate of the application, Hz.
        application: f32,
    },
    /// The application's bounds of the correction are none.
    Cap {
        /// What of them.
        what: &'static str,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooShort { found } => write!(f, "{found} bytes are too few for a model file: export it again"),
            Self::NotAModel => {
                write!(f, "not a model file (its first bytes are not IMPROMPT): give the file that model-export wrote")
            }
            Self::Version { found, expected } => {
                write!(
                    f,
                    "format version {found}, this build reads {OLDEST} to {expected}: export the model with the matching \
                     model-export"
                )
            }
            Self::Length { expected, found } => {
                write!(
                    f,
                    "the header announces {expected} bytes, the file has {found}: it is truncated or has trailing bytes, \
                     copy it again"
                )
            }
            Self::Checksum { stored, computed } => {
                write!(f, "check sum {stored:08x} in the file, {computed:08x} computed: the file is damaged, copy it again")
            }
            Self::Card => write!(
                f,
                "the model card cannot be decoded: it is damaged, or made for a build that holds longer lists; \
                 export the model again with this build's model-export"
            ),
            Self::Shape { what, found, limit } => write!(f, "{what} is {found}, possible is {limit}: train a model that fits"),
            Self::SectionLength { what, expected, found } => {
                write!(f, "section {what} has {found} bytes, its shape asks for {expected}: export the model again")
            }
            Self::SectionAlignment { what } => write!(f, "section {what} is not aligned to 16 bytes: export the model again"),
            Self::SectionRange { what } => write!(f, "section {what} lies outside of the file: export the model again"),
            Self::NotFinite { what } => {
                write!(f, "{what} holds a number that is not finite: the training diverged or the file was edited")
            }
            Self::Value { what } => {
                write!(f, "{what} is out of its meaningful range")?;
                if let Some(range) = super::ranges::named(what) {
                    write!(f, ", {} to {}", range.least, range.most)?;
                }
                write!(f, ": correct it in the description and export again")
            }
            Self::NoProbes => write!(
                f,
                "the network has no probes, by which a machine sees that it computes the same bits: export the model again, \
                 model-export always writes them"
            ),
            Self::Index { what, found } => write!(f, "{what} names index {found}, which the model does not have"),
            Self::Duplicate { what, found } => {
                write!(f, "{what} names index {found} twice: correct it in the description and export again")
            }
            Self::Overflow { layer } => {
                write!(f, "layer {layer} could overflow its 32-bit accumulator: calibrate and export again")
            }
            Self::Probe { index: u8::MAX } => {
                write!(f, "the feedback lane's probe gives other bits on this machine: do not fly, report it")
            }
            Self::Probe { index } => write!(f, "probe {index} gives other bits on this machine: do not fly, report it"),
            Self::Bounds { output } => {
                write!(f, "a probe breaks the bounds that the file states of output {output}: export the model again")
            }
            Self::Limit { output } => {
                write!(
                    f,
                    "whatever comes in, the network's output {output} lies beyond its limit and would only be clamped: \
                     raise the limit, or make it 0 to switch the output off"
                )
            }
            Self::Unsigned => {
                write!(f, "the model is not signed, and only signed ones are stored here: sign it with model-export sign")
            }
            Self::Signature => write!(
                f,
                "none of the keys that are trusted here has signed the model as it arrived: \
                 sign it with the right key, or copy it again"
            ),
            Self::Downgrade { found, floor } => write!(
                f,
                "the model's signed version is {found}, lower than {floor} is not stored here: \
                 sign the model that shall fly with a higher --model-version"
            ),
            Self::Signal { signal, channel } => {
                write!(
                    f,
                    "channel {channel} of the {signal} signal differs from the application's in name, unit, frame or end rule"
                )
            }
            Self::Preview { needed, available } => {
                write!(f, "the model looks at {needed} samples, the preview keeps {available}")
            }
            Self::Rate { model, application } => {
                write!(f, "trained for references at {model} Hz, the application runs {application} Hz")
            }
            Self::Cap { what } => write!(
                f,
                "the application's bounds of the correction are not complete ({what}): give each reference channel a limit and a \
                 rate that the vehicle or machine bears"
            ),
        }
    }
}

impl core::error::Error for Refusal {}
