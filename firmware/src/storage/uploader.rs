//! A model on its way into a slot.
//!
//! *in* announcement, chunks and the word to commit, from whatever link; *out* acknowledgements, at last the stored model;
//! *never* a write while armed, nor a header before a model that this machine would fly; *source* the two-slot update with a
//! commit record written last.

use super::{HEADER, Header, Operation, Sequence, Slot, StorageError, Stored, stored::examine};
use crate::{
    format::{Refusal, file},
    model::Model,
    network::Scratch,
};

/// Bytes that are collected for one write to the flash: a multiple of every driver's granularity.
const BLOCK: usize = HEADER;

/// Whether the motors may turn. The flash is written only while they may not: the core of a microcontroller with one bank of
/// flash stands still until it has been erased, which takes seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arming {
    /// The motors are off.
    Disarmed,
    /// The motors may turn.
    Armed,
}

impl Arming {
    pub(super) fn permit(self) -> Result<(), StorageError> {
        if self == Self::Disarmed { Ok(()) } else { Err(StorageError::Armed) }
    }
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    Receiving { length: u32, checksum: u32, received: u32 },
    Committed,
}

/// Writes models into a spare slot.
///
/// Every message may be repeated, as by a peer whose acknowledgement was lost. An error of the flash and a refused model end the
/// upload: it is begun again, and the slot erased. What a refused chunk or an armed vehicle leaves can go on.
#[derive(Debug)]
pub struct Uploader<S> {
    slot: S,
    sequence: Sequence,
    #[cfg(feature = "signed")]
    signers: Option<super::Signers<'static>>,
    state: State,
    /// Received and not yet written, behind it erased bytes.
    block: [u8; BLOCK],
}

impl<S: Slot> Uploader<S> {
    /// For the spare slot and the number of a [`super::Survey`].
    pub fn new(slot: S, sequence: Sequence) -> Self {
        const { assert!(BLOCK.is_multiple_of(S::WRITE_SIZE), "the flash is written in words that do not make up a header") };
        Self {
            slot,
            sequence,
            #[cfg(feature = "signed")]
            signers: None,
            state: State::Idle,
            block: [0xff; BLOCK],
        }
    }

    /// From now on only models are stored that one of these keys has signed, with a version not below the floor, which never
    /// gets lower. An application that never calls this stores unsigned files, and no signed ones. The floor is [`super::floor`]
    /// of both slots, before they were given away, or higher.
    #[cfg(feature = "signed")]
    pub fn require(&mut self, signers: super::Signers<'static>) {
        let known = self.signers.map_or(0, |signers| signers.floor);
        self.signers = Some(super::Signers { floor: signers.floor.max(known), ..signers });
    }

    /// The model file within what was uploaded, if who sent it may.
    #[cfg(feature = "signed")]
    fn permitted<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], Refusal> {
        self.signers.map_or(Ok(bytes), |signers| signers.check(bytes))
    }

    #[cfg(not(feature = "signed"))]
    fn permitted<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], Refusal> {
        Ok(bytes)
    }

    /// Begins the upload of a model of `length` bytes with this check sum ([`Model::checksum`]; of a signed model
    /// [`file::checksum`] of all bytes, the trailer's too): erases the slot. Gives the
    /// offset of the next byte that is expected: if the same upload had begun before, it goes on.
    ///
    /// # Errors
    /// If armed, if the model does not fit, if one was committed, or if the flash fails.
    pub fn begin(&mut self, arming: Arming, length: u32, checksum: u32) -> Result<u32, StorageError> {
        arming.permit()?;
        match self.state {
            State::Committed => return Err(StorageError::Restart),
            State::Receiving { length: l, checksum: c, received } if (l, c) == (length, checksum) => return Ok(received),
            State::Receiving { .. } | State::Idle => {}
        }
        let capacity = u32::try_from(self.slot.capacity()).unwrap_or(u32::MAX);
        let room = capacity.saturating_sub(HEADER as u32) / BLOCK as u32 * BLOCK as u32;
        if length > room {
            return Err(StorageError::TooLong { length, room });
        }
        // Also what looks erased: an interrupted erase can leave bits that are read as set now and not later.
        self.state = State::Idle;
        self.slot.erase(0, capacity).map_err(|error| StorageError::flash(Operation::Erase, &error))?;
        self.block = [0xff; BLOCK];
        self.state = State::Receiving { length, checksum, received: 0 };
        Ok(0)
    }

    /// Takes the chunk at `offset` of the file and gives the offset of the next byte that is expected. What was received before
    /// is acknowledged and not written again.
    ///
    /// # Errors
    /// If armed, if no upload has begun, if the chunk leaves a gap or reaches beyond the end, or if the flash fails.
    pub fn write(&mut self, arming: Arming, offset: u32, bytes: &[u8]) -> Result<u32, StorageError> {
        arming.permit()?;
        let State::Receiving { length, checksum, mut received } = self.state else { return Err(StorageError::NotBegun) };
        let Some(known) = received.checked_sub(offset) else {
            return Err(StorageError::Gap { expected: received, found: offset });
        };
        let end = u64::from(offset).saturating_add(bytes.len() as u64);
        if end > u64::from(length) {
            return Err(StorageError::Overrun { end, length });
        }
        self.state = State::Idle;
        for byte in bytes.iter().skip(known as usize) {
            if let Some(place) = self.block.get_mut(received as usize % BLOCK) {
                *place = *byte;
            }
            received = received.wrapping_add(1);
            if (received as usize).is_multiple_of(BLOCK) {
                self.program(received)?;
            }
        }
        self.state = State::Receiving { length, checksum, received };
        Ok(received)
    }

    /// Checks what the flash now holds and makes it the newest model: complete, the announced check sum, [`Model::from_bytes`]
    /// with its probes on this machine in `scratch`, and `check` (signals, rate, preview of the application). Only then the
    /// header is written, and read back.
    ///
    /// The model flies from the next [`super::open`] on.
    ///
    /// # Errors
    /// If armed, if the upload is incomplete, if a check fails, or if the flash does.
    pub fn commit(
        &mut self,
        arming: Arming,
        scratch: &mut Scratch,
        check: impl FnOnce(&Model<'_>) -> Result<(), Refusal>,
    ) -> Result<Stored<'_>, StorageError> {
        arming.permit()?;
        match self.state {
            State::Idle => return Err(StorageError::NotBegun),
            State::Receiving { length, received, .. } if received < length => {
                return Err(StorageError::Incomplete { received, length });
            }
            State::Receiving { length, checksum, received } => {
                self.state = State::Idle;
                if !(received as usize).is_multiple_of(BLOCK) {
                    self.program(received)?;
                }
                self.finish(length, checksum, scratch, check)?;
                self.state = State::Committed;
            }
            State::Committed => {}
        }
        Stored::read(self.slot.bytes())
    }

    /// Writes the block whose last byte was received as number `received`.
    fn program(&mut self, received: u32) -> Result<(), StorageError> {
        let start = received.saturating_sub(1) / BLOCK as u32 * BLOCK as u32;
        let offset = start.saturating_add(HEADER as u32);
        self.slot.write(offset, &self.block).map_err(|error| StorageError::flash(Operation::WriteModel, &error))?;
        self.block = [0xff; BLOCK];
        Ok(())
    }

    fn finish(
        &mut self,
        length: u32,
        announced: u32,
        scratch: &mut Scratch,
        check: impl FnOnce(&Model<'_>) -> Result<(), Refusal>,
    ) -> Result<(), StorageError> {
        let slot = self.slot.bytes();
        let bytes = slot.get(HEADER..).and_then(|rest| rest.get(..length as usize)).ok_or(StorageError::Length { length })?;
        let computed = file::checksum(bytes);
        if computed != announced {
            return Err(StorageError::Checksum { announced, computed });
        }
        let file = self.permitted(bytes)?;
        examine(file, scratch, check)?;
        let (length, checksum) = (file.len() as u32, file::checksum(file));
        let header = Header { sequence: self.sequence, length, checksum }.to_bytes();
        self.slot.write(0, &header).map_err(|error| StorageError::flash(Operation::WriteHeader, &error))?;
        if self.slot.bytes().starts_with(&header) { Ok(()) } else { Err(StorageError::ReadBack) }
    }
}
