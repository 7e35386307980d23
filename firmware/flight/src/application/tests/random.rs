//! Hosts that say anything.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;

/// A number of any kind: of a vehicle, of none, or none.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -20.0f32..20.0,
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(vec![f32::MAX, f32::MIN, f32::NAN, f32::INFINITY, 1e-44, 1e4, -1e4, 399.0]),
    ]
}

fn any_command() -> impl Strategy<Value = Command<'static>> {
    let three = || prop::array::uniform3(any_number());
    let timed = || {
        (-50i32..300, three(), three(), three(), any_number()).prop_map(|(tick, position, velocity, acceleration, yaw)| {
            TimedSetpoint { tick, position, velocity, acceleration, yaw }
        })
    };
    prop_oneof![
        3 => (0u32..1000, three()).prop_map(|(tick, rates)| {
            Command::Inertial(Inertial { tick, attitude: [0.0, 0.6, 0.8, 0.0], rates })
        }),
        3 => (0u32..1000, three(), three(), any_number()).prop_map(|(tick, position, velocity, vertical_acceleration)| {
            Command::Position(Position { tick, position, velocity, vertical_acceleration })
        }),
        4 => timed().prop_map(Command::Setpoint),
        1 => timed().prop_map(Command::Replan),
        1 => (0usize..32, any_number()).prop_map(|(index, number)| {
            let mut settings = GOOD;
            *numbers(&mut settings)[index] = number;
            Command::Settings(settings)
        }),
        1 => prop::sample::select(vec![
            Command::Learn(LearnOrder::Commission), Command::Learn(LearnOrder::Learn), Command::Learn(LearnOrder::Hold),
            Command::Learn(LearnOrder::Stop), Command::Learn(LearnOrder::Forget), Command::Learn(LearnOrder::Keep),
            Command::Learned { offset: 0 }, Command::Learned { offset: u32::MAX },
        ]),
        1 => prop::sample::select(vec![
            Command::Brake, Command::Arm, Command::Disarm, Command::Hello, Command::Lanes(Lanes::BOTH)
        ]),
    ]
}

/// Reports decode, references are finite and silence ends the flight.
fn whatever_is_said<L: Learns>(mut line: Line<L>, said: Vec<Vec<Command<'static>>>) -> Result<(), TestCaseError> {
    for commands in said {
        for command in commands {
            line.say(&command);
        }
        let (command, reference) = line.fly();
        prop_assert!(command.fractions().iter().all(|x| (0.0..=1.0).contains(x)));
        prop_assert!(reference.position.iter().chain(reference.velocity.iter()).all(|x| x.is_finite()));
    }
    if line.application.autopilot().armed() {
        prop_assert!(line.silent() <= SILENCE);
    }
    Ok(())
}

proptest! {
    #[test]
    fn whatever_is_said_reports_decode_references_are_finite_and_silence_ends_it(
        said in prop::collection::vec(prop::collection::vec(any_command(), 0..4), 1..120), learns: bool
    ) {
        if learns {
            whatever_is_said(Line::learning().arm(hover()), said)?;
        } else {
            whatever_is_said(Line::armed(hover()), said)?;
        }
    }

    #[test]
    fn settings_are_taken_whole_or_not_at_all(index in 0usize..32, number in any_number(), divisor in 0u32..9) {
        let mut settings = GOOD;
        settings.rates.position_divisor = divisor;
        *numbers(&mut settings)[index] = number;
        let (mut told, mut other) = (Line::new(), Line::new());
        told.say(&Command::Settings(settings));
        let refused = !matches!(told.outcomes[..], [Outcome::Done]);
        prop_assert!(refused || (settings.check().is_ok() && settings.rates.control_hz == 500.0));
        if !refused {
            other.application.autopilot().configure(&settings).unwrap();
        }
        for line in [&mut told, &mut other] {
            for command in hover().chain([inertial(1), position(1), Command::Arm]) {
                line.say(&command);
            }
        }
        for _ in 0..20 {
            prop_assert_eq!(told.fly(), other.fly());
        }
        prop_assert_eq!(told.silent(), SILENCE);
    }
}
