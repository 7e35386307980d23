//! How long is learned.
//!
//! *in* a number of seconds, or strokes one after another; *out* the JSON document's name for it; *never* a number for the other;
//! *source* none.

use serde::Serialize;

/// How long was learned before the flights that are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seconds {
    /// Seconds of motion; each judged flight begins with what these taught.
    After(u32),
    /// Strokes one after another; the first four are not judged.
    FromFirstStroke,
}

impl Seconds {
    /// In words.
    pub fn words(self) -> String {
        match self {
            Self::After(seconds) => format!("after {seconds} s"),
            Self::FromFirstStroke => "from the first stroke on".into(),
        }
    }
}

impl Serialize for Seconds {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::After(seconds) => serializer.serialize_u32(*seconds),
            Self::FromFirstStroke => serializer.serialize_str("from_first_stroke"),
        }
    }
}
