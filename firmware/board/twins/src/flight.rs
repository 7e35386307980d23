//! A recorded flight of the quadrotor loop with its add-on, flown again.

use embedded_io::{Read, Write};
use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_flight::{
    flight::Flight,
    replay::{Event, HEADER, Header, RECORD, answer},
    types::Tick,
};

use crate::case::{ENDED, Failure, Memory, UNWRITTEN, read_file};

const RECORDING: Failure = Failure("a recording is refused");

/// Loads the model of so many bytes and makes the recorded calls.
#[inline(never)]
pub(crate) fn run<const WORDS: usize>(
    length: usize,
    cases: &mut impl Read,
    answers: &mut impl Write,
    memory: &mut Memory<WORDS>,
) -> Result<(), Failure> {
    let file = read_file(cases, &mut memory.bulk, length)?;
    let mut place = Model::EMPTY;
    let model = Model::load_into(&mut place, file, &mut memory.scratch).map_err(|_| Failure("a model file is refused"))?;
    let mut header = [0; HEADER];
    cases.read_exact(&mut header).map_err(|_| ENDED)?;
    let Header { settings, .. } = Header::from_bytes(&header).map_err(|_| RECORDING)?;
    let mut flight = Flight::new(&settings).ok_or(RECORDING)?;
    flight.attach(model, Lanes::NONE).map_err(|_| Failure("a model does not fit its flight"))?;
    let mut tick = 0;
    loop {
        let mut record = [0; RECORD];
        cases.read_exact(&mut record).map_err(|_| ENDED)?;
        match Event::from_bytes(&record).map_err(|_| RECORDING)? {
            Event::Tick(state) => {
                let command = flight.step(Tick(tick), &state, &mut memory.scratch);
                answers.write_all(&answer(&command, flight.reference())).map_err(|_| UNWRITTEN)?;
                tick += 1;
            }
            Event::End { ticks } if ticks == tick => return Ok(()),
            Event::End { .. } => return Err(RECORDING),
            call => call.prepare(&mut flight),
        }
    }
}
