//! What the receivers of the link must survive: any bytes, and frames that are whole but for their message.
//!
//! *in* bytes; *out* how many messages were delivered; *never* a panic, a message whose number is not finite, or one that does
//! not arrive again when it is sent again: that is what the fuzz target and the test on stable Rust look for.

use impromptu_flight::link::{Commands, Direction, FRAME, Message, Reason, Receiver, Reports, encode};
use serde::{Serialize, Serializer, ser::SerializeTuple};

/// Separates the messages that are put into frames: a byte which few numbers have.
pub const SEPARATOR: u8 = 0xff;

/// Receives the bytes as they are, then each piece between two separators as the message of a frame whose header and check sum
/// are right.
pub fn survive(bytes: &[u8]) -> usize {
    let mut frame = [0; FRAME];
    let pieces = bytes.split(|byte| *byte == SEPARATOR).enumerate();
    let framed: Vec<u8> =
        pieces.filter_map(|(index, piece)| Some(encode(&Raw(piece), index as u8, &mut frame)?.to_vec())).flatten().collect();
    [bytes, &framed].map(|bytes| receive::<Commands>(bytes) + receive::<Reports>(bytes)).iter().sum()
}

/// Any bytes in the place of a message.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    /// As a tuple, of which postcard writes nothing but the elements.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl Message for Raw<'_> {
    fn check(&self) -> Result<(), Reason> {
        Ok(())
    }

    fn opens(&self) -> bool {
        false
    }
}

fn receive<D: Direction>(bytes: &[u8]) -> usize {
    let (mut receiver, mut delivered) = (Receiver::<D>::new(), 0);
    for byte in bytes {
        if let Some(Ok(received)) = receiver.push(*byte) {
            delivered += 1;
            again::<D>(&received.message, received.sequence);
        }
    }
    let counts = receiver.counts();
    assert_eq!(counts.received as usize, delivered);
    assert!(counts.damaged() as usize + delivered <= bytes.len());
    delivered
}

/// Sends a message that arrived.
fn again<D: Direction>(message: &impl Message, sequence: u8) {
    let (mut first, mut second) = ([0; FRAME], [0; FRAME]);
    let Some(frame) = encode(message, sequence, &mut first) else { panic!("what arrived in a frame does not fit into one") };
    let mut receiver = Receiver::<D>::new();
    let arrived = frame.iter().filter(|byte| {
        receiver.push(**byte).is_some_and(|result| {
            let Ok(received) = result else { panic!("what was delivered is refused") };
            encode(&received.message, received.sequence, &mut second) == Some(frame)
        })
    });
    assert_eq!(arrived.count(), 1, "a message changed on its way");
}
