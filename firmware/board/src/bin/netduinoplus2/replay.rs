//! Flies a recording again, writes the answers and keeps account of the cost.
//!
//! Only one record is in memory at a time, so the length of a flight is not limited by the 128 KiB of RAM.

use core::{fmt, hint::black_box};

use impromptu_firmware::{
    adapter::Lanes,
    model::{Model, Refusal},
    network::Scratch,
};
use impromptu_flight::{
    flight::Flight,
    replay::{Event, HEADER, Header, RECORD, RecordingError, answer},
    types::{MotorCommand, State, Tick},
};
use semihosting::{
    fs::File,
    io::{Read, Write},
};
use static_cell::StaticCell;

use crate::{
    instruments::{InstructionCounter, StackGauge},
    report::{Cost, Report},
};

/// On a boundary that suits every section of the file.
#[repr(C, align(16))]
struct Aligned<T: ?Sized>(T);

/// The model file in flash; empty if the binary was built without one.
static MODEL: &Aligned<[u8]> = &Aligned(*include_bytes!(concat!(env!("OUT_DIR"), "/model")));

/// Why a flight was given up; displayed with what to do.
pub(crate) enum ReplayError {
    /// The board does not run as it must.
    Board(&'static str),
    /// A file could not be opened, read or written.
    File(&'static str, semihosting::io::Error),
    /// The binary's model is not flown.
    Model(Refusal),
    /// The recording was flown with a model of this check sum, the binary holds another or none.
    OtherModel(u32, Option<u32>),
    /// The recording cannot be flown again, from this tick on.
    Recording(u32, RecordingError),
    /// The rotors of the settings cannot produce every moment.
    Airframe,
    /// The end says that there are as many ticks as the second number, found was the first.
    Ticks(u32, u32),
}

impl fmt::Display for ReplayError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Board(reason) => formatter.write_str(reason),
            Self::File(name, ref error) => {
                write!(formatter, "{name} in the folder where the emulator was started: {error}")
            }
            Self::Model(refusal) => write!(formatter, "the model in this binary: {refusal}"),
            Self::OtherModel(wanted, found) => {
                write!(formatter, "recording.bin was flown with the model {wanted:08x}, this binary holds ")?;
                match found {
                    Some(found) => write!(formatter, "{found:08x}")?,
                    None => formatter.write_str("none")?,
                }
                formatter.write_str(": build with IMPROMPTU_MODEL=FILE")
            }
            Self::Recording(tick, error) => write!(formatter, "recording.bin at tick {tick}: {error}"),
            Self::Airframe => formatter.write_str("recording.bin: no vehicle has its settings"),
            Self::Ticks(found, told) => {
                write!(formatter, "recording.bin has {found} ticks and says {told}: it is damaged, record the flight again")
            }
        }
    }
}

/// Flies `recording.bin` into `answers.bin`.
pub(crate) fn run() -> Result<Report<'static>, ReplayError> {
    let counter = InstructionCounter::new().map_err(ReplayError::Board)?;
    let mut cost = Cost::default();
    let stack = StackGauge::paint();
    let model = load(&counter, &mut cost)?;
    let stack_load = stack.high_water();

    let mut recording = File::open(c"recording.bin").map_err(in_recording)?;
    let (flight, clock) = start(&mut recording, model)?;
    let stack = StackGauge::paint();
    let ticks = fly(&counter, &mut recording, flight, &clock, &mut cost)?;
    Ok(Report {
        model: model.map(Into::into),
        ticks,
        cost,
        stack_load,
        stack_flight: stack.high_water(),
        stack_size: stack.size(),
    })
}

/// The model in this binary, if it holds one.
#[inline(never)]
fn load(counter: &InstructionCounter, cost: &mut Cost) -> Result<Option<&'static Model<'static>>, ReplayError> {
    static PLACE: StaticCell<Model<'static>> = StaticCell::new();
    // The compiler shall not check the model in the board's place.
    let file = black_box(&MODEL.0);
    if file.is_empty() {
        return Ok(None);
    }
    let (model, instructions) = counter.measure(|| Model::from_bytes(file));
    cost.load.add(instructions);
    Ok(Some(PLACE.init(model.map_err(ReplayError::Model)?)))
}

/// Which control ticks are ticks of the slower loops.
struct Clock {
    /// Control ticks in a reference tick.
    reference: u32,
    /// Control ticks in a sub-rate tick of the add-on.
    sub_rate: Option<u32>,
}

/// The flight stack of the recording's header, on the ground.
#[inline(never)]
fn start(
    recording: &mut File,
    model: Option<&'static Model<'static>>,
) -> Result<(&'static mut Flight<'static>, Clock), ReplayError> {
    static PLACE: StaticCell<Flight<'static>> = StaticCell::new();
    let mut header = [0; HEADER];
    recording.read_exact(&mut header).map_err(in_recording)?;
    let Header { settings, model: flown } = Header::from_bytes(&header).map_err(|error| ReplayError::Recording(0, error))?;
    let flight = PLACE.init(Flight::new(&settings).ok_or(ReplayError::Airframe)?);
    let mut clock = Clock { reference: settings.rates.position_divisor.max(1), sub_rate: None };
    if let Some(wanted) = flown {
        let model = model
            .filter(|model| model.checksum() == wanted)
            .ok_or(ReplayError::OtherModel(wanted, model.map(Model::checksum)))?;
        flight.attach(model, Lanes::NONE).map_err(ReplayError::Model)?;
        clock.sub_rate = Some(clock.reference * u32::from(model.card().timing.divisor));
    }
    Ok((flight, clock))
}

/// Makes the recorded calls; gives the number of ticks.
#[inline(never)]
fn fly(
    counter: &InstructionCounter,
    recording: &mut File,
    flight: &mut Flight<'_>,
    clock: &Clock,
    cost: &mut Cost,
) -> Result<u32, ReplayError> {
    static SCRATCH: StaticCell<Scratch> = StaticCell::new();
    let scratch = SCRATCH.init_with(Scratch::new);
    let mut answers = File::create(c"answers.bin").map_err(in_answers)?;
    let mut tick = 0;
    loop {
        let mut record = [0; RECORD];
        recording.read_exact(&mut record).map_err(in_recording)?;
        let event = Event::from_bytes(&record).map_err(|error| ReplayError::Recording(tick, error))?;
        match event {
            Event::Tick(state) => {
                let (command, instructions) = counter.measure(|| step(flight, Tick(tick), &state, scratch));
                cost.of(tick, clock.reference, clock.sub_rate).add(instructions);
                answers.write_all(&answer(&command, flight.reference())).map_err(in_answers)?;
                tick += 1;
            }
            Event::End { ticks } if ticks == tick => return Ok(tick),
            Event::End { ticks } => return Err(ReplayError::Ticks(tick, ticks)),
            call => call.prepare(flight),
        }
    }
}

/// A function of its own, so that the binary shows what a control tick can reach.
#[inline(never)]
fn step(flight: &mut Flight<'_>, tick: Tick, state: &State, scratch: &mut Scratch) -> MotorCommand {
    flight.step(tick, state, scratch)
}

fn in_recording(error: semihosting::io::Error) -> ReplayError {
    ReplayError::File("recording.bin", error)
}

fn in_answers(error: semihosting::io::Error) -> ReplayError {
    ReplayError::File("answers.bin", error)
}
