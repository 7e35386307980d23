//! A piece of a model upload on its way to the task that may wait for the flash.
//!
//! *in* the link's model commands; *out* words for a mailbox, and back; *never* other bytes than were sent; *source* ours.

use crate::link::{CHUNK, Command, message::ModelChunk};

/// Words of an upload in a mailbox: kind, sequence and length; two numbers; the bytes.
pub const WORDS: usize = 3 + CHUNK / 4;

const BEGIN: u32 = 0;
const CHUNK_KIND: u32 = 1;
const COMMIT: u32 = 2;

/// A model command and its frame's sequence number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Upload {
    /// Sequence number of the frame, for the acknowledgement.
    pub sequence: u8,
    words: [u32; WORDS],
}

impl Upload {
    /// The upload's part of a command, if it is one.
    pub fn new(sequence: u8, command: &Command<'_>) -> Option<Self> {
        let mut words = [0; WORDS];
        let [head, first, second, bulk @ ..] = &mut words;
        let kind = match command {
            Command::ModelBegin { length, checksum } => {
                (*first, *second) = (*length, *checksum);
                BEGIN
            }
            Command::ModelChunk(chunk) => {
                (*first, *second) = (chunk.offset, chunk.bytes.len() as u32);
                let (whole, rest) = chunk.bytes.as_chunks();
                let mut last = [0; 4];
                last.iter_mut().zip(rest).for_each(|(place, byte)| *place = *byte);
                for (word, bytes) in bulk.iter_mut().zip(whole.iter().chain([&last])) {
                    *word = u32::from_le_bytes(*bytes);
                }
                CHUNK_KIND
            }
            Command::ModelCommit => COMMIT,
            _ => return None,
        };
        *head = kind | u32::from(sequence) << 8;
        Some(Self { sequence, words })
    }

    /// The words for a mailbox.
    pub fn words(&self) -> &[u32; WORDS] {
        &self.words
    }

    /// The upload that was put into a mailbox as these words.
    pub fn from_words(words: [u32; WORDS]) -> Self {
        Self { sequence: (words[0] >> 8) as u8, words }
    }

    /// Gives the command, whose bytes are put into `bulk`, to `obey`.
    pub fn with<T>(&self, obey: impl FnOnce(Command<'_>) -> T) -> T {
        let [head, first, second, bulk @ ..] = &self.words;
        let mut bytes = [0; CHUNK];
        for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(bulk) {
            *place = word.to_le_bytes();
        }
        obey(match head & 0xff {
            BEGIN => Command::ModelBegin { length: *first, checksum: *second },
            CHUNK_KIND => {
                let bytes = bytes.get(..*second as usize).unwrap_or_default();
                Command::ModelChunk(ModelChunk { offset: *first, bytes })
            }
            _ => Command::ModelCommit,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn commands_come_through_the_mailbox(sequence in any::<u8>(), numbers in any::<[u32; 2]>(), bytes in prop::collection::vec(any::<u8>(), 0..=CHUNK)) {
            let commands = [
                Command::ModelBegin { length: numbers[0], checksum: numbers[1] },
                Command::ModelChunk(ModelChunk { offset: numbers[0], bytes: &bytes }),
                Command::ModelCommit,
            ];
            for command in commands {
                let upload = Upload::new(sequence, &command).unwrap();
                let copy = Upload::from_words(*upload.words());
                prop_assert_eq!(copy.sequence, sequence);
                copy.with(|found| assert_eq!(found, command));
            }
            prop_assert_eq!(Upload::new(sequence, &Command::Arm), None);
        }
    }
}
