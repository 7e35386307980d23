//! Bytes to messages.
//!
//! *in* one byte at a time, from a line that loses, flips and invents them; *out* whole messages and faults, each once; *never*
//! more than one frame lost to whatever came before it, or a wait; *source* COBS (Cheshire and Baker 1999), by `cobs`.

use core::marker::PhantomData;

use cobs::{DecodeResult, DecoderState};

use super::{BODY, CRC, Counts, Fault, Message, Reason, VERSION, message::Direction};

/// Where a frame stands among those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The first one that was received, or one which opens a conversation.
    First,
    /// The successor of the youngest.
    Next,
    /// Younger than the successor of the youngest.
    Gap {
        /// Frames between them.
        missing: u8,
    },
    /// One of the last [`RECENT`]: a copy, or overtaken. What it says may be out of date.
    Late,
}

/// So far behind the youngest a frame is late; 64 ms of a flight at 500 Hz. All other numbers are ahead: after any silence the
/// line is understood again from the next frame on, or, if what was lost comes within these many of a multiple of 256, that much
/// later.
pub const RECENT: u8 = 32;

/// A message that arrived as it was sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<M> {
    /// Sequence number of its frame.
    pub sequence: u8,
    /// Where it stands among those before it.
    pub order: Order,
    /// The message: each number finite, each attitude of unit length.
    pub message: M,
}

/// Receiver of one direction; `N` bytes ([`BODY`] for any message) hold a payload and its check sum.
#[derive(Debug)]
pub struct Receiver<D, const N: usize = BODY> {
    body: [u8; N],
    /// Bytes in `body`; more than `N` when the rest of the frame is skipped.
    length: usize,
    stuffing: DecoderState,
    youngest: Option<u8>,
    counts: Counts,
    direction: PhantomData<D>,
}

impl<D, const N: usize> Receiver<D, N> {
    /// A receiver that has received nothing. A line that was listened to in the middle of a frame costs that frame.
    pub const fn new() -> Self {
        Self {
            body: [0; N],
            length: 0,
            stuffing: DecoderState::Idle,
            youngest: None,
            counts: Counts {
                received: 0,
                stuffing: 0,
                short: 0,
                long: 0,
                checksum: 0,
                version: 0,
                message: 0,
                reordered: 0,
                dropped: 0,
            },
            direction: PhantomData,
        }
    }

    /// Frames since the start, by what became of them.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }
}

impl<D, const N: usize> Default for Receiver<D, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<D: Direction, const N: usize> Receiver<D, N> {
    /// Takes one byte; some bytes complete a message or a fault.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<Received<D::Message<'_>>, Fault>> {
        match self.stuffing.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.length = 0;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                let place = self.body.get_mut(self.length);
                let first_too_many = place.is_none() && self.length == N;
                if let Some(place) = place {
                    *place = byte;
                }
                self.length = self.length.saturating_add(1);
                first_too_many.then(|| Err(self.refuse(Fault::Long)))
            }
            // The fault was told when it was noticed.
            Ok(DecodeResult::DataComplete) | Err(_) if self.length > N => None,
            Ok(DecodeResult::DataComplete) => Some(self.complete()),
            Err(_) => Some(Err(self.refuse(Fault::Stuffing))),
        }
    }

    fn refuse(&mut self, fault: Fault) -> Fault {
        self.counts.count(&fault);
        fault
    }

    // Apart from the bytes that complete nothing, which need none of its stack.
    #[inline(never)]
    fn complete(&mut self) -> Result<Received<D::Message<'_>>, Fault> {
        let Self { body, length, youngest, counts, .. } = self;
        let received = open(body.get(..*length).unwrap_or_default()).and_then(|(sequence, bytes)| {
            let message = read::<D>(bytes);
            if message.as_ref().is_ok_and(Message::opens) {
                *youngest = None;
            }
            let order = place(youngest, sequence);
            match order {
                Order::Gap { missing } => counts.dropped = counts.dropped.saturating_add(u32::from(missing)),
                Order::Late => counts.reordered = counts.reordered.saturating_add(1),
                Order::First | Order::Next => {}
            }
            match message {
                Ok(message) => Ok(Received { sequence, order, message }),
                Err(reason) => Err(Fault::Message { sequence, reason }),
            }
        });
        match &received {
            Ok(_) => counts.received = counts.received.saturating_add(1),
            Err(fault) => counts.count(fault),
        }
        received
    }
}

/// The sequence number and the message's bytes of a body.
fn open(body: &[u8]) -> Result<(u8, &[u8]), Fault> {
    let (payload, checksum) = body.split_last_chunk().ok_or(Fault::Short)?;
    if CRC.checksum(payload) != u32::from_le_bytes(*checksum) {
        return Err(Fault::Checksum);
    }
    match payload {
        [VERSION, sequence, message @ ..] => Ok((*sequence, message)),
        [found, _, ..] => Err(Fault::Version { found: *found }),
        _ => Err(Fault::Short),
    }
}

/// The message, if the bytes are one and nothing else.
fn read<D: Direction>(bytes: &[u8]) -> Result<D::Message<'_>, Reason> {
    match postcard::take_from_bytes::<D::Message<'_>>(bytes) {
        Ok((message, [])) => message.check().map(|()| message),
        _ => Err(Reason::Undecodable),
    }
}

fn place(youngest: &mut Option<u8>, sequence: u8) -> Order {
    let order = match youngest.map(|youngest| sequence.wrapping_sub(youngest)) {
        None => Order::First,
        Some(1) => Order::Next,
        Some(ahead) if ahead > 1 && ahead <= u8::MAX - (RECENT - 1) => Order::Gap { missing: ahead - 1 },
        Some(_) => return Order::Late,
    };
    *youngest = Some(sequence);
    order
}
