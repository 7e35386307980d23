//! A vehicle that learns, and one that cannot, at the end of the line.

use std::vec::Vec;

use super::*;
use impromptu_firmware::learning::{Kept, Phase, Problem};

use crate::{
    autopilot::FlightLearner,
    link::message::{LearnedPiece, LearningReport},
};

impl Line<FlightLearner> {
    /// A vehicle with its board's settings and a learner.
    pub(super) fn learning() -> Self {
        Self::with(Application::with(FlightLearner::new()))
    }
}

impl<L: Learns> Line<L> {
    fn order(&mut self, order: LearnOrder) -> Outcome {
        self.say(&Command::Learn(order));
        *self.outcomes.last().unwrap()
    }

    fn learner(&mut self) -> Option<LearningReport> {
        self.application.autopilot().learning()
    }

    /// What the vehicle tells of what it learned, from a byte on.
    fn piece(&mut self, offset: u32) -> Option<(usize, Vec<u8>)> {
        let mut frame = [0; FRAME];
        for byte in self.sender.encode(&Command::Learned { offset }, &mut frame).unwrap().1 {
            self.application.on_byte(*byte);
        }
        let bytes = self.application.outbox().to_vec();
        self.application.sent();
        let mut piece = None;
        for byte in bytes {
            match self.reports.push(byte).map(|report| report.unwrap().message) {
                Some(Report::Learned(LearnedPiece { length, offset: at, bytes })) if at == offset => {
                    piece = Some((length as usize, bytes.to_vec()));
                }
                Some(Report::Acknowledge { outcome, .. }) => self.outcomes.push(outcome),
                _ => {}
            }
        }
        piece
    }
}

fn refused(reason: Reason) -> Outcome {
    Outcome::Refused(reason)
}

#[test]
fn a_vehicle_without_a_learner_says_so_and_flies() {
    let mut line = Line::armed(hover());
    for order in [LearnOrder::Commission, LearnOrder::Learn, LearnOrder::Forget] {
        assert_eq!(line.order(order), refused(Reason::NoLearner));
    }
    line.say(&Command::Disarm);
    assert_eq!(line.order(LearnOrder::Keep), refused(Reason::NoLearner));
    assert_eq!((line.piece(0), line.outcomes.last()), (None, Some(&refused(Reason::NoLearner))));
    assert!(line.learner().is_none() && !line.heard.iter().any(|report| report.starts_with("Learning")));
    // Nor one whose gains are those of no loop of second order.
    let mut line = Line::learning();
    let mut settings = GOOD;
    settings.position.kp = [0.0; 3];
    line.say(&Command::Settings(settings));
    assert_eq!(line.order(LearnOrder::Learn), refused(Reason::NoLearner));
}

#[test]
fn what_was_learned_is_kept_and_told_on_the_ground_alone() {
    let mut line = Line::learning().arm(hover());
    assert_eq!(line.order(LearnOrder::Learn), Outcome::Done);
    for _ in 0..100 {
        line.fly();
    }
    assert!(line.heard.iter().any(|report| report.starts_with("Learning")), "told with the telemetry");
    assert_eq!(line.order(LearnOrder::Keep), refused(Reason::Armed));
    assert_eq!((line.piece(0), line.outcomes.last()), (None, Some(&refused(Reason::Armed))));
    line.say(&Command::Disarm);
    line.say(&Command::Learn(LearnOrder::Keep));
    // Until the flash has it, it stands still: nothing flies, and nothing else is written.
    for busy in [Command::Learn(LearnOrder::Keep), Command::Arm, Command::ModelCommit] {
        line.say(&busy);
        assert_eq!(line.outcomes.last(), Some(&refused(Reason::Busy)), "{busy:?}");
    }
    assert!(line.application.storing());
    let mut bytes = [0; KEPT];
    let sequence = line.application.take_learned(&mut bytes).unwrap();
    assert!(line.application.take_learned(&mut bytes).is_none(), "once");
    assert!(Kept::read(&bytes).is_ok());
    line.application.acknowledge(sequence, Outcome::Done);
    line.hear();
    assert_eq!((line.outcomes.last(), line.application.storing()), (Some(&Outcome::Done), false));
    let mut told = Vec::new();
    while told.len() < bytes.len() {
        let (length, piece) = line.piece(told.len() as u32).unwrap();
        assert!(length == bytes.len() && !piece.is_empty());
        told.extend(piece);
    }
    assert_eq!(told, bytes);
    assert_eq!(line.piece(1 << 30), None);
    assert_eq!(line.outcomes.last(), Some(&refused(Reason::Offset { expected: 0 })));
    let mut line = line.arm_again();
    assert_eq!(line.order(LearnOrder::Commission), Outcome::Done);
    line.say(&Command::Disarm);
    let measuring = Reason::Learner(Problem::Unknown { axis: 0 });
    assert_eq!(line.order(LearnOrder::Keep), refused(measuring), "what is kept would be lost");
}

impl<L: Learns> Line<L> {
    fn arm_again(mut self) -> Self {
        self.outcomes.clear();
        self.sender = Sender::new();
        (self.tick, self.epoch) = (0, 2);
        self.arm(hover())
    }
}

#[test]
fn the_same_settings_forget_nothing_and_others_everything() {
    let mut line = Line::learning();
    assert_eq!(line.learner().unwrap().phase, Phase::Off, "until it is told");
    assert_eq!(line.order(LearnOrder::Hold), Outcome::Done);
    line.say(&Command::Settings(GOOD));
    assert_eq!(line.learner().unwrap().phase, Phase::Holding);
    let mut other = GOOD;
    other.position.kp = [5.0; 3];
    line.say(&Command::Settings(other));
    assert_eq!(line.learner().unwrap().phase, Phase::Off);
}

#[test]
fn a_lost_position_is_a_missing_sample() {
    // A vehicle that hears no position while it moves by itself: what it learns from is what it is told, not what it last knew.
    let mut line = Line::learning().arm(hover());
    line.order(LearnOrder::Commission);
    for tick in 0..6000u32 {
        let stamp = line.epoch.wrapping_add(tick);
        line.say(&inertial(stamp));
        // Three of ten are lost.
        if tick.is_multiple_of(5) && tick / 5 % 10 > 2 {
            line.say(&position(stamp));
        }
        line.step();
    }
    let problem = line.learner().unwrap().problem;
    let why = impromptu_firmware::learning::Unfit::Missing;
    assert!(matches!(problem, Some(Problem::Unfit { why: found, .. }) if found == why), "{problem:?}");
}
