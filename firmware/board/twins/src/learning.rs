//! A learner beside a loop that was recorded: what it is told and what it corrects, tick by tick.

use embedded_io::{Read, Write};
use impromptu_firmware::learning::{AHEAD, BEHIND, Learner, Limits, Measured, Parts, Response};

use crate::case::{Failure, read_words, write_words};

/// Ticks of the desired trajectory that are held.
const HELD: usize = 128;
const _: () = assert!((AHEAD + BEHIND) as usize + 2 <= HELD);

/// Of a loop with 2.55 rad/s at 100 Hz.
fn learner() -> Option<Learner> {
    let response = Response::second_order(1.0, 2.55, 0.78, 0.08, 100.0)?;
    Learner::new(response, 100.0, 0.024, Limits { scale: 1.0, correction: 2.0, feedback: 0.3, rate: 40.0 })
}

/// So many ticks: reads the desired trajectory of the first [`AHEAD`] ticks and then, at each one, what is desired [`AHEAD`]
/// ticks later, what is measured and its rate of change; writes the correction.
#[inline(never)]
pub(crate) fn run(ticks: u32, cases: &mut impl Read, answers: &mut impl Write, mark: &impl Fn()) -> Result<(), Failure> {
    // Not moved out of a `Result`: the smallest machine has no room for a second one.
    let Some(learner) = &mut learner() else { return Err(Failure("a learner is refused")) };
    let mut desired = [0.0; HELD];
    let mut words = [0; AHEAD as usize];
    read_words(cases, &mut words)?;
    for (place, word) in desired.iter_mut().zip(words) {
        *place = f32::from_bits(word);
    }
    let first = desired[0];
    learner.start(first);
    for tick in 0..ticks as i32 {
        let mut words = [0; 3];
        read_words(cases, &mut words)?;
        let [ahead, value, rate] = words.map(f32::from_bits);
        if let Some(place) = desired.get_mut((tick + AHEAD) as usize % HELD) {
            *place = ahead;
        }
        let at = |offset: i32| match usize::try_from(tick + offset) {
            Ok(tick) => desired.get(tick % HELD).copied().unwrap_or(first),
            Err(_) => first,
        };
        mark();
        let correction = learner.step(at, Some(Measured { value, rate: Some(rate) }), Parts::BOTH, Parts::BOTH);
        mark();
        write_words(answers, &[correction.to_bits()])?;
    }
    Ok(())
}
