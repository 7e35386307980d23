//! A model on its way into the vehicle's flash.
//!
//! *in* a model file; *out* a vehicle that flies it from its next start on; *never* an end before all of it is stored and checked there, unless
//! with the reason. What is lost is sent again; an upload that was interrupted goes on where it was.

use impromptu_firmware::model::file;
use impromptu_flight::link::{CHUNK, Command, Outcome, Reason, message::ModelChunk};

use crate::{board::Board, error::PilError, line::Line};

/// How often an upload is begun again.
const BEGINNINGS: usize = 3;

impl<L: Line> Board<L> {
    /// Stores a model in the vehicle's spare slot, while it is disarmed. It flies from the next start on.
    ///
    /// # Errors
    /// If the vehicle refuses it, or does not answer.
    pub fn upload(&mut self, model: &[u8]) -> Result<(), PilError> {
        let length = u32::try_from(model.len()).unwrap_or(u32::MAX);
        let begin = Command::ModelBegin { length, checksum: file::checksum(model) };
        let mut refusal = Reason::NoModel;
        for _ in 0..BEGINNINGS {
            let mut next = match self.store(&begin)? {
                Outcome::Done => 0,
                // It had begun before.
                Outcome::Refused(Reason::Offset { expected }) => expected,
                Outcome::Refused(reason) => return Err(refused(reason)),
            };
            refusal = loop {
                let rest = model.get(next as usize..).unwrap_or_default();
                let piece = match rest.chunks(CHUNK).next() {
                    Some(bytes) => Command::ModelChunk(ModelChunk { offset: next, bytes }),
                    None => Command::ModelCommit,
                };
                match self.store(&piece)? {
                    Outcome::Done => match piece {
                        Command::ModelChunk(chunk) => next += chunk.bytes.len() as u32,
                        _ => return Ok(()),
                    },
                    Outcome::Refused(Reason::Offset { expected }) => next = expected,
                    // It started again, or the flash failed.
                    Outcome::Refused(reason @ (Reason::NoModel | Reason::Storage | Reason::Checksum { .. })) => break reason,
                    Outcome::Refused(reason) => return Err(refused(reason)),
                }
            };
        }
        Err(refused(refusal))
    }
}

fn refused(reason: Reason) -> PilError {
    PilError::Refused { command: "the model", reason }
}
