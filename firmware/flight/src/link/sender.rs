//! Messages to frames.
//!
//! *in* a message and a sequence number; *out* the frame's bytes, with the zero that ends it; *never* half a frame: what does not
//! fit gives none; *source* COBS of Cheshire and Baker 1999 (`cobs`), postcard (`postcard`).

use super::{BODY, CRC, PAYLOAD, VERSION, message::Message};

/// Encodes a message; `None` if it does not fit into a payload, or the frame into the output ([`super::FRAME`] bytes are enough
/// for any).
pub fn encode<'o>(message: &impl Message, sequence: u8, output: &'o mut [u8]) -> Option<&'o [u8]> {
    let mut body = [0; BODY];
    let (header, rest) = body.split_first_chunk_mut()?;
    *header = [VERSION, sequence];
    let length = postcard::to_slice(message, rest.get_mut(..PAYLOAD - 2)?).ok()?.len() + 2;
    seal(&mut body, length, output)
}

/// Puts the check sum behind the first `length` bytes, stuffs both and ends the frame.
pub(super) fn seal<'o>(body: &mut [u8; BODY], length: usize, output: &'o mut [u8]) -> Option<&'o [u8]> {
    let checksum = CRC.checksum(body.get(..length)?);
    *body.get_mut(length..)?.first_chunk_mut()? = checksum.to_le_bytes();
    let end = cobs::try_encode(body.get(..length + 4)?, output).ok()?;
    *output.get_mut(end)? = 0;
    output.get(..end + 1)
}

/// Counts the frames that it encodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sender {
    next: u8,
}

impl Sender {
    /// The first frame has sequence number 0.
    pub const fn new() -> Self {
        Self { next: 0 }
    }

    /// Encodes the next frame: its sequence number and its bytes. `None` as [`encode`]; then the number is not used up.
    pub fn encode<'o>(&mut self, message: &impl Message, output: &'o mut [u8]) -> Option<(u8, &'o [u8])> {
        let sequence = self.next;
        let frame = encode(message, sequence, output)?;
        self.next = sequence.wrapping_add(1);
        Some((sequence, frame))
    }

    /// Counts a frame that is not sent, so that the receiver notices that one is missing.
    pub fn skip(&mut self) {
        self.next = self.next.wrapping_add(1);
    }
}
