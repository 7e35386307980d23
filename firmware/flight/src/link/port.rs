//! The link over any byte port.
//!
//! *in/out* messages, through the traits of `embedded-io`, which boards and hosts implement; *never* half a frame, unless the
//! port fails in the middle of it; *source* `embedded-io`.

use core::fmt;

use embedded_io::{Read, Write};

use super::{Direction, FRAME, Fault, Message, Received, Receiver, Sender};

/// Why a message is not sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SendError<E> {
    /// It is longer than a payload: a name or a piece of a model is too long.
    Length,
    /// The port failed.
    Port(E),
}

impl<E: fmt::Debug> fmt::Display for SendError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length => write!(f, "the message is longer than a frame: shorten its names or bytes"),
            Self::Port(error) => write!(f, "the port failed ({error:?}): check the cable, or whether the other side still runs"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for SendError<E> {}

/// Sends one message and returns the sequence number of its frame.
///
/// # Errors
/// If the message is too long or the port fails.
pub fn send<W: Write>(port: &mut W, sender: &mut Sender, message: &impl Message) -> Result<u8, SendError<W::Error>> {
    let mut frame = [0; FRAME];
    let (sequence, frame) = sender.encode(message, &mut frame).ok_or(SendError::Length)?;
    port.write_all(frame).map_err(SendError::Port)?;
    port.flush().map_err(SendError::Port)?;
    Ok(sequence)
}

/// Reads once, gives every message and fault that this completes to `deliver`, and returns the number of bytes read (0: the port
/// is closed). Waits as the port's `read` does.
///
/// # Errors
/// If the port fails.
pub fn receive<D: Direction, const N: usize, R: Read>(
    port: &mut R,
    receiver: &mut Receiver<D, N>,
    mut deliver: impl FnMut(Result<Received<D::Message<'_>>, Fault>),
) -> Result<usize, R::Error> {
    let mut bytes = [0; 64];
    let count = port.read(&mut bytes)?;
    for byte in bytes.iter().take(count) {
        if let Some(result) = receiver.push(*byte) {
            deliver(result);
        }
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Command, Commands, frozen};

    #[test]
    fn what_is_sent_through_a_port_is_received_from_it() {
        let (mut line, mut sender) = ([0; 4096], Sender::new());
        let mut port = &mut line[..];
        let sent = frozen::commands().map(|command| send(&mut port, &mut sender, &command).unwrap());
        let free = port.len();
        let used = line.len() - free;
        let (mut port, mut receiver, mut received) = (&line[..used], Receiver::<Commands>::new(), Vec::new());
        while receive(&mut port, &mut receiver, |result| {
            let Received { sequence, message, .. } = result.unwrap();
            assert_eq!(message, frozen::commands()[received.len()]);
            received.push(sequence);
        })
        .unwrap()
            > 0
        {}
        assert_eq!(received, sent);
    }

    #[test]
    fn a_full_port_and_a_long_message_are_errors() {
        let mut sender = Sender::new();
        let chunk = Command::ModelChunk(crate::link::message::ModelChunk { offset: 0, bytes: &[1; 300] });
        assert_eq!(send(&mut &mut [0; 400][..], &mut sender, &chunk), Err(SendError::Length));
        assert!(matches!(send(&mut &mut [0; 4][..], &mut sender, &Command::Arm), Err(SendError::Port(_))));
    }
}
