//! A piece of a model upload on its way to the task that may wait for the flash.
//!
//! *in* the link's model commands; *out* words for a mailbox, and back, and the outcome once carried out; *never* other bytes
//! than were sent.

use impromptu_firmware::{
    model::{Model, Refusal},
    network::Scratch,
    storage::{Arming, Slot, StorageError, Uploader},
};

use crate::link::{CHUNK, Command, Outcome, Reason, message::ModelChunk};

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
    /// Whether a command concerns the flash.
    pub fn is_made_of(command: &Command<'_>) -> bool {
        matches!(command, Command::ModelBegin { .. } | Command::ModelChunk(_) | Command::ModelCommit)
    }

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

    /// Whether this is the last piece, after which the new model waits for the restart.
    pub fn commits(&self) -> bool {
        self.words[0] & 0xff == COMMIT
    }

    /// Carries the command out, which may take seconds; the motors must be off until it returns ([`super::Application::on_byte`]
    /// sees to that). `scratch` and `check` as for [`Uploader::commit`]. A beginning of what had begun before is answered with
    /// the offset where it goes on.
    pub fn carry_out<S: Slot>(
        &self,
        uploader: &mut Uploader<S>,
        scratch: &mut Scratch,
        check: impl FnOnce(&Model<'_>) -> Result<(), Refusal>,
    ) -> Outcome {
        // The model that is checked takes enough of the stack: nothing else is on it then.
        let stored = match self.commits() {
            true => uploader.commit(Arming::Disarmed, scratch, check).map(|_| ()),
            false => self.write(uploader),
        };
        match stored {
            Ok(()) => Outcome::Done,
            Err(error) => Outcome::Refused(reason(&error)),
        }
    }

    #[inline(never)]
    fn write<S: Slot>(&self, uploader: &mut Uploader<S>) -> Result<(), StorageError> {
        self.with(|command| match command {
            Command::ModelBegin { length, checksum } => match uploader.begin(Arming::Disarmed, length, checksum)? {
                0 => Ok(()),
                expected => Err(StorageError::Gap { expected, found: 0 }),
            },
            Command::ModelChunk(chunk) => uploader.write(Arming::Disarmed, chunk.offset, chunk.bytes).map(|_| ()),
            _ => Ok(()),
        })
    }

    /// The words for a mailbox.
    pub fn words(&self) -> &[u32; WORDS] {
        &self.words
    }

    /// The upload that was put into a mailbox as these words.
    pub fn from_words(words: [u32; WORDS]) -> Self {
        Self { sequence: (words[0] >> 8) as u8, words }
    }

    /// Gives the command, whose bytes are put into `bulk`, to `handle`.
    pub fn with<T>(&self, handle: impl FnOnce(Command<'_>) -> T) -> T {
        let [head, first, second, bulk @ ..] = &self.words;
        let mut bytes = [0; CHUNK];
        for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(bulk) {
            *place = word.to_le_bytes();
        }
        handle(match head & 0xff {
            BEGIN => Command::ModelBegin { length: *first, checksum: *second },
            CHUNK_KIND => {
                let bytes = bytes.get(..*second as usize).unwrap_or_default();
                Command::ModelChunk(ModelChunk { offset: *first, bytes })
            }
            _ => Command::ModelCommit,
        })
    }
}

/// What the link says of an error of the storage.
fn reason(error: &StorageError) -> Reason {
    match *error {
        StorageError::Armed => Reason::Armed,
        StorageError::NotBegun => Reason::NoModel,
        StorageError::TooLong { room, .. } => Reason::Length { limit: room },
        StorageError::Overrun { length, .. } => Reason::Length { limit: length },
        StorageError::Gap { expected, .. } => Reason::Offset { expected },
        StorageError::Incomplete { received, .. } => Reason::Offset { expected: received },
        StorageError::Checksum { computed, .. } => Reason::Checksum { computed },
        StorageError::Refused(refusal) => Reason::Model((&refusal).into()),
        StorageError::Restart => Reason::Busy,
        _ => Reason::Storage,
    }
}

/// An outcome as words for a mailbox.
pub fn outcome_words(outcome: &Outcome) -> [u32; 2] {
    let mut bytes = [0; 8];
    // The largest has seven bytes.
    let _ = postcard::to_slice(outcome, &mut bytes);
    let [a, b, c, d, e, f, g, h] = bytes;
    [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
}

/// The outcome that was put into a mailbox as these words.
pub fn outcome_from_words(words: [u32; 2]) -> Option<Outcome> {
    let [first, second] = words.map(u32::to_le_bytes);
    let mut bytes = [0; 8];
    for (place, byte) in bytes.iter_mut().zip(first.into_iter().chain(second)) {
        *place = byte;
    }
    postcard::from_bytes(&bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::outcome::ModelFault;
    use impromptu_firmware::{
        model::file,
        storage::{self, RamFlash},
    };
    use proptest::prelude::*;

    const MODEL: &[u8] = include_bytes!("../../tests/models/int8-lane.model");

    /// The command's outcome, by way of both mailboxes.
    fn handle<S: Slot>(uploader: &mut Uploader<S>, command: Command<'_>) -> Outcome {
        let upload = Upload::from_words(*Upload::new(1, &command).unwrap().words());
        let outcome = upload.carry_out(uploader, &mut Scratch::new(), |_| Ok(()));
        assert_eq!(outcome_from_words(outcome_words(&outcome)), Some(outcome));
        outcome
    }

    #[test]
    fn an_upload_is_stored_and_every_refusal_says_where_it_goes_on() {
        let mut slots = [RamFlash::<4096>::new(), RamFlash::new()];
        let (_, mut uploader) = storage::open(&mut slots, |_| Ok(()));
        let begin = Command::ModelBegin { length: MODEL.len() as u32, checksum: file::checksum(MODEL) };
        let chunk = |offset: usize| {
            let bytes = MODEL[offset..].chunks(CHUNK).next().unwrap();
            Command::ModelChunk(ModelChunk { offset: offset as u32, bytes })
        };
        let refused = Outcome::Refused;
        assert_eq!(handle(&mut uploader, Command::ModelCommit), refused(Reason::NoModel));
        assert_eq!(
            handle(&mut uploader, Command::ModelBegin { length: 5000, checksum: 0 }),
            refused(Reason::Length { limit: 4064 })
        );
        assert_eq!(handle(&mut uploader, begin), Outcome::Done);
        assert_eq!(handle(&mut uploader, chunk(CHUNK)), refused(Reason::Offset { expected: 0 }));
        assert_eq!(handle(&mut uploader, chunk(0)), Outcome::Done);
        assert_eq!(handle(&mut uploader, begin), refused(Reason::Offset { expected: CHUNK as u32 }));
        assert_eq!(handle(&mut uploader, Command::ModelCommit), refused(Reason::Offset { expected: CHUNK as u32 }));
        for offset in (CHUNK..MODEL.len()).step_by(CHUNK) {
            assert_eq!(handle(&mut uploader, chunk(offset)), Outcome::Done);
        }
        assert_eq!(handle(&mut uploader, Command::ModelCommit), Outcome::Done);
        assert_eq!(handle(&mut uploader, begin), refused(Reason::Busy), "until the restart");
        assert_eq!(storage::open(&mut slots, |_| Ok(())).0.unwrap().file(), MODEL);
    }

    #[test]
    fn a_model_that_is_none_is_refused_as_such() {
        let mut slots = [RamFlash::<4096>::new(), RamFlash::new()];
        let (_, mut uploader) = storage::open(&mut slots, |_| Ok(()));
        let bytes = &[7; 40];
        let checksum = file::checksum(bytes);
        handle(&mut uploader, Command::ModelBegin { length: 40, checksum });
        handle(&mut uploader, Command::ModelChunk(ModelChunk { offset: 0, bytes }));
        assert_eq!(handle(&mut uploader, Command::ModelCommit), Outcome::Refused(Reason::Model(ModelFault::Damaged)));
    }

    proptest! {
        #[test]
        fn commands_come_through_the_mailbox(
            sequence in any::<u8>(), numbers in any::<[u32; 2]>(), bytes in prop::collection::vec(any::<u8>(), 0..=CHUNK)
        ) {
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
