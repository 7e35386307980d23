//! Lines that lose, damage, reorder and invent bytes.
//!
//! *in* the frozen messages; *out* what a receiver makes of damaged lines, judged; *never* a message that was not sent; *source*
//! proptest's draws.

use proptest::prelude::*;

use super::{
    CHUNK, Command, Commands, Counts, Direction, FRAME, Fault, Order, RECENT, Reason, Receiver, Reports, Sender, encode, frozen,
    message::{Inertial, ModelChunk, Position, TimedSetpoint},
    sender::seal,
};

/// What came, the message as text.
type Arrival = Result<(u8, Order, String), Fault>;

/// Feeds bytes; messages as text.
fn feed<D: for<'a> Direction<Message<'a>: core::fmt::Debug>>(receiver: &mut Receiver<D>, bytes: &[u8]) -> Vec<Arrival> {
    let mut outcomes = Vec::new();
    for byte in bytes {
        if let Some(result) = receiver.push(*byte) {
            outcomes.push(result.map(|received| (received.sequence, received.order, format!("{:?}", received.message))));
        }
    }
    outcomes
}

fn frame(command: &Command<'_>, sequence: u8) -> Vec<u8> {
    encode(command, sequence, &mut [0; FRAME]).unwrap().to_vec()
}

/// A frame around any payload, with its right check sum.
fn frame_around(payload: &[u8]) -> Vec<u8> {
    let mut body = [0; super::BODY];
    body[..payload.len()].copy_from_slice(payload);
    seal(&mut body, payload.len(), &mut [0; FRAME]).unwrap().to_vec()
}

/// Mostly what a vehicle can have.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![100 => -170.0f32..170.0, 1 => any::<f32>(), 1 => prop::num::f32::ANY]
}

/// Any command, if it is finite or not.
fn any_command() -> impl Strategy<Value = Command<'static>> {
    let three = || prop::array::uniform3(number());
    prop_oneof![
        prop::sample::select(frozen::commands().to_vec()),
        (any::<u32>(), three()).prop_map(|(tick, rates)| Command::Inertial(Inertial {
            tick,
            attitude: [0.0, -0.0, 1.0, 0.0],
            rates
        })),
        (any::<u32>(), three(), three(), number()).prop_map(|(tick, position, velocity, vertical_acceleration)| {
            Command::Position(Position { tick, position, velocity, vertical_acceleration })
        }),
        (any::<i32>(), three(), three(), three(), number()).prop_map(|(tick, position, velocity, acceleration, yaw)| {
            Command::Setpoint(TimedSetpoint { tick, position, velocity, acceleration, yaw })
        }),
        (any::<u32>(), 0..=CHUNK)
            .prop_map(|(offset, length)| Command::ModelChunk(ModelChunk { offset, bytes: &[0xff; CHUNK][..length] })),
    ]
}

/// Sends `count` commands through `line`, which may change each frame, and returns what came and the counts.
fn transmit(count: u32, mut line: impl FnMut(u32, Vec<u8>) -> Vec<u8>) -> (Vec<Arrival>, Counts) {
    let (mut sender, mut receiver, mut outcomes) = (Sender::new(), Receiver::<Commands>::new(), Vec::new());
    for index in 0..count {
        let command = Command::ModelBegin { length: index, checksum: !index };
        let bytes = sender.encode(&command, &mut [0; FRAME]).unwrap().1.to_vec();
        outcomes.extend(feed(&mut receiver, &line(index, bytes)));
    }
    (outcomes, *receiver.counts())
}

/// A generator for tests of many bytes.
fn random(seed: u64) -> impl FnMut() -> u32 {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u32
    }
}

#[test]
fn every_message_arrives() {
    let mut receiver = Receiver::<Commands>::new();
    for (index, command) in frozen::commands().iter().enumerate() {
        let order = if index == 0 { Order::First } else { Order::Next };
        let expected = vec![Ok((index as u8, order, format!("{command:?}")))];
        assert_eq!(feed(&mut receiver, &frame(command, index as u8)), expected);
    }
    let mut receiver = Receiver::<Reports>::new();
    for report in frozen::reports() {
        let frame = encode(&report, 0, &mut [0; FRAME]).unwrap().to_vec();
        assert!(matches!(&feed(&mut receiver, &frame)[..], [Ok((0, _, text))] if *text == format!("{report:?}")));
    }
}

/// Every way to flip one bit of a frame, or two.
fn flipped(frame: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let bits = frame.len() * 8;
    (0..bits).flat_map(move |first| {
        (first..bits).map(move |second| {
            let mut bytes = frame.to_vec();
            bytes[first / 8] ^= 1 << (first % 8);
            if second != first {
                bytes[second / 8] ^= 1 << (second % 8);
            }
            bytes
        })
    })
}

#[test]
fn a_frame_with_one_or_two_flipped_bits_is_refused() {
    for command in frozen::commands() {
        let good = frame(&command, 1);
        for bytes in flipped(&good) {
            let mut receiver = Receiver::<Commands>::new();
            let mut outcomes = feed(&mut receiver, &bytes);
            // The zero may be among what was flipped; then the next frame goes with this one.
            outcomes.extend(feed(&mut receiver, &[0]));
            assert!(!outcomes.is_empty() && outcomes.iter().all(Result::is_err), "{command:?}: {outcomes:?}");
            let next = feed(&mut receiver, &frame(&Command::Arm, 2));
            assert!(matches!(next[..], [Ok((2, ..))]), "{command:?}: {next:?}");
        }
    }
}

#[test]
fn lost_bytes_cost_the_frames_that_they_were_in() {
    for percent in [1, 10] {
        let (mut random, mut whole) = (random(percent), 0);
        let (outcomes, counts) = transmit(20_000, |_, bytes| {
            let kept: Vec<u8> = bytes.iter().copied().filter(|_| u64::from(random() % 100) >= percent).collect();
            whole += u32::from(kept == bytes);
            kept
        });
        let delivered: Vec<_> = outcomes.iter().flatten().collect();
        assert!(delivered.iter().all(|(sequence, _, text)| {
            let index: u32 = text.split(&[' ', ','][..]).nth(3).unwrap().parse().unwrap();
            *sequence == index as u8 && text.contains(&format!("checksum: {}", !index))
        }));
        // A frame is lost with its zero, or with the zero before it, although its own bytes all came.
        assert!(counts.received <= whole && counts.received * 100 >= whole * (100 - 2 * percent as u32), "{counts:?} of {whole}");
        assert!(counts.damaged() > 0 && counts.reordered == 0);
        let first = delivered.first().map_or(0, |(sequence, ..)| u32::from(*sequence));
        let last = 20_000 - delivered.len() as u32 - first - counts.dropped;
        assert!(last < 100, "all that is missing is counted: {counts:?}");
    }
}

#[test]
fn lost_frames_are_counted() {
    let (outcomes, counts) = transmit(1000, |index, bytes| if index % 10 == 3 { Vec::new() } else { bytes });
    assert_eq!(counts, Counts { received: 900, dropped: 100, ..Counts::default() });
    assert!(matches!(outcomes[3], Ok((4, Order::Gap { missing: 1 }, _))));
}

#[test]
fn frames_that_come_late_or_twice_are_marked_and_counted() {
    let mut held = Vec::new();
    let (outcomes, counts) = transmit(1000, |index, bytes| match index % 10 {
        3 => {
            held.clone_from(&bytes);
            Vec::new()
        }
        4 => [bytes, held.clone()].concat(),
        7 => [bytes.clone(), bytes].concat(),
        _ => bytes,
    });
    assert_eq!(counts, Counts { received: 1100, reordered: 200, dropped: 100, ..Counts::default() });
    assert!(matches!(&outcomes[3..6], [Ok((4, Order::Gap { missing: 1 }, _)), Ok((3, Order::Late, _)), Ok((5, Order::Next, _))]));
}

#[test]
fn after_any_number_of_lost_frames_commands_are_understood_again_within_few() {
    let order = |lost: u32, after: u32| {
        let (mut sender, mut receiver, mut last) = (Sender::new(), Receiver::<Commands>::new(), Vec::new());
        for index in 0..=lost + after {
            let bytes = sender.encode(&Command::Arm, &mut [0; FRAME]).unwrap().1.to_vec();
            if index == 0 || index > lost {
                last = feed(&mut receiver, &bytes);
            }
        }
        last.remove(0).unwrap().1
    };
    for lost in 0..600 {
        let first = order(lost, 1);
        // As far as one byte tells: the number may be one of the last.
        let recent = (lost + 1) % 256 > 255 - u32::from(RECENT) + 1 || (lost + 1) % 256 == 0;
        assert_eq!(first == Order::Late, recent, "{lost} lost: {first:?}");
        assert_ne!(order(lost, u32::from(RECENT) + 1), Order::Late, "{lost} lost");
    }
    // As long ago as can be, still a copy.
    let mut receiver = Receiver::<Commands>::new();
    let sent: Vec<u8> = (0..RECENT).flat_map(|sequence| frame(&Command::Arm, sequence)).collect();
    feed(&mut receiver, &sent);
    assert!(matches!(feed(&mut receiver, &frame(&Command::Arm, 0))[..], [Ok((0, Order::Late, _))]));
}

#[test]
fn a_hello_starts_the_count_anew() {
    let mut receiver = Receiver::<Commands>::new();
    feed(&mut receiver, &frame(&Command::Arm, 200));
    let bytes = [frame(&Command::Hello, 0), frame(&Command::Arm, 1)].concat();
    assert!(matches!(feed(&mut receiver, &bytes)[..], [Ok((0, Order::First, _)), Ok((1, Order::Next, _))]));
    assert_eq!(*receiver.counts(), Counts { received: 3, ..Counts::default() });
}

#[test]
fn half_frames_cost_one_frame() {
    let (half, whole) = (frame(&frozen::commands()[3], 0), frame(&Command::Arm, 1));
    for end in 1..half.len() - 1 {
        let mut receiver = Receiver::<Commands>::new();
        let outcomes = feed(&mut receiver, &[&half[..end], &whole, &whole].concat());
        assert!(matches!(outcomes[..], [Err(_), Ok((1, ..))]), "{end} bytes: {outcomes:?}");
        let mut receiver = Receiver::<Commands>::new();
        let outcomes = feed(&mut receiver, &[&half[end..], &whole].concat());
        assert!(matches!(outcomes[..], [Err(_), Ok((1, ..))]), "from byte {end}: {outcomes:?}");
    }
}

#[test]
fn a_flood_without_a_zero_is_one_fault() {
    let mut receiver = Receiver::<Commands>::new();
    assert_eq!(feed(&mut receiver, &[0x55; 10_000]), [Err(Fault::Long)]);
    let outcomes = feed(&mut receiver, &[vec![0], frame(&Command::Disarm, 9)].concat());
    assert!(matches!(outcomes[..], [Ok((9, ..))]));
    assert!(feed(&mut receiver, &[0; 1000]).is_empty(), "zeros alone are no frames");
}

#[test]
fn a_million_bytes_of_garbage_deliver_nothing() {
    let (mut random, mut receiver) = (random(3), Receiver::<Commands>::new());
    let garbage: Vec<u8> = (0..1_000_000).map(|_| (random() >> 8) as u8).collect();
    assert!(feed(&mut receiver, &garbage).iter().all(Result::is_err));
    assert!(receiver.counts().damaged() > 3000);
    let outcomes = feed(&mut receiver, &[vec![0], frame(&Command::Disarm, 9)].concat());
    assert!(matches!(outcomes.last(), Some(Ok((9, ..)))));
}

#[test]
fn whole_frames_with_a_wrong_content_are_refused_by_reason() {
    let message = |sequence, reason| Err(Fault::Message { sequence, reason });
    let [hello, inertial, ..] = frozen::commands().map(|command| {
        let mut body = [0; FRAME];
        let length = cobs::decode(&frame(&command, 3), &mut body).unwrap().frame_size();
        body[..length - 4].to_vec()
    });
    let mut nan = inertial.clone();
    nan[5..9].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut long = inertial.clone();
    long[5..9].copy_from_slice(&0.6f32.to_le_bytes());
    let cases: [(Vec<u8>, Result<u8, Fault>); 9] = [
        (hello.clone(), Ok(3)),
        (vec![2, 3, 0], Err(Fault::Version { found: 2 })),
        ([hello, vec![0]].concat(), message(3, Reason::Undecodable)),
        (vec![1, 4, 13], message(4, Reason::Undecodable)),
        (vec![1, 4], message(4, Reason::Undecodable)),
        (vec![1], Err(Fault::Short)),
        (vec![], Err(Fault::Short)),
        (nan, message(3, Reason::NotFinite)),
        (long, message(3, Reason::Attitude)),
    ];
    for (payload, expected) in cases {
        let outcomes = feed(&mut Receiver::<Commands>::new(), &frame_around(&payload));
        let [outcome] = &outcomes[..] else { panic!("{outcomes:?}") };
        assert_eq!(outcome.clone().map(|(sequence, ..)| sequence), expected, "{payload:?}");
    }
    let chunk = Command::ModelChunk(ModelChunk { offset: 0, bytes: &[7; 200] });
    let expected = [Err(Fault::Message { sequence: 5, reason: Reason::Length { limit: 192 } })];
    assert_eq!(feed(&mut Receiver::<Commands>::new(), &frame(&chunk, 5)), expected);
}

proptest! {
    #[test]
    fn messages_keep_every_bit(
        (command, sequence) in (any_command(), any::<u8>()),
        before in prop::collection::vec(any::<u8>(), 0..40),
    ) {
        let mut receiver = Receiver::<Commands>::new();
        feed(&mut receiver, &before);
        feed(&mut receiver, &[0]);
        let delivered = receiver.counts().received;
        let mut found = None;
        for byte in frame(&command, sequence) {
            match receiver.push(byte) {
                None => {}
                // Every number's bits, not only its value: -0 is not 0.
                Some(Ok(received)) => found = Some(frame(&received.message, received.sequence)),
                Some(Err(fault)) => {
                    let refused = matches!(fault, Fault::Message { sequence: s, reason: Reason::NotFinite | Reason::Range { .. } }
                        if s == sequence);
                    prop_assert!(refused, "{}", fault);
                }
            }
        }
        prop_assert_eq!(delivered, 0);
        match super::Message::check(&command) {
            Ok(()) => prop_assert_eq!(found, Some(frame(&command, sequence))),
            Err(_) => prop_assert_eq!(found, None),
        }
    }

    #[test]
    fn any_bytes_deliver_nothing_and_cost_no_later_frame(
        bytes in prop::collection::vec(prop_oneof![any::<u8>(), 0u8..4], 0..600)
    ) {
        let mut receiver = Receiver::<Commands>::new();
        prop_assert!(feed(&mut receiver, &bytes).iter().all(Result::is_err));
        feed(&mut receiver, &[0]);
        prop_assert!(matches!(feed(&mut receiver, &frame(&Command::Arm, 1))[..], [Ok((1, ..))]));
    }

    #[test]
    fn any_payload_is_a_valid_message_or_refused(
        mut payload in prop::collection::vec(any::<u8>(), 2..=super::PAYLOAD), kind in 0u8..14
    ) {
        payload[0] = super::VERSION;
        if let Some(place) = payload.get_mut(2) {
            *place = kind;
        }
        let mut outcomes = feed(&mut Receiver::<Commands>::new(), &frame_around(&payload));
        outcomes.extend(feed(&mut Receiver::<Reports>::new(), &frame_around(&payload)));
        prop_assert_eq!(outcomes.len(), 2);
        for outcome in outcomes {
            match outcome {
                Ok((_, _, text)) => prop_assert!(!text.contains("NaN") && !text.contains("inf"), "{}", text),
                Err(fault) => prop_assert!(matches!(fault, Fault::Message { .. }), "{}", fault),
            }
        }
    }
}
