//! What the microcontroller's time is spent on, and what happens when it is short.

use impromptu_firmware::{
    adapter::{Inference, Lanes},
    guard::Trip,
    model::{DEFAULT_OUTPUTS, Model},
    network::Scratch,
};
use impromptu_flight::{
    flight::Flight,
    types::{State, Tick},
};
use impromptu_model_export::Precision;
use impromptu_pil::{self as pil, Board, CYCLES_PER_INSTRUCTION, LinkKind, PilReport};
use impromptu_sim::{
    rollout::{FlightPlan, fly_on, setpoint},
    trajectory::{Trajectory, strokes},
};
use impromptu_tests::mcu::counter;

use crate::{board::model, pil::closed_loop};

/// Instructions from the tick's interrupt to the control task, whatever else runs: twice the 14 of an empty task.
const ENTRY_BOUND: u32 = 40;
/// Largest share of the processor at 168 MHz.
const SHARE: f64 = 0.15;
/// Cycles of a control tick at 500 Hz.
const TICK_CYCLES: u64 = 336_000;

fn stroke(seconds: usize) -> Trajectory {
    let mut trajectory = strokes(1, 1, 1.0, closed_loop().rate_hz()).unwrap().remove(0);
    trajectory.samples.truncate(100 * seconds);
    trajectory.scored = 0..trajectory.samples.len();
    trajectory
}

/// Flies a stroke at 2^shift nanoseconds for an instruction.
fn fly(lanes: Option<Lanes>, shift: u32) -> PilReport {
    let file = model::file_at(2, &model::RELU, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectory = stroke(10);
    let (_emulated, mut board) = pil::start(Some(&file), LinkKind::Lockstep, shift).unwrap();
    board.introduce().unwrap();
    let plan = FlightPlan { model: lanes.map(|lanes| (&model, lanes)), ..FlightPlan::new(&trajectory, 3) };
    pil::fly(&mut board, &closed_loop(), &[plan], |_| ()).unwrap().1
}

/// At 31 million instructions a second an inference takes longer than a control tick, which interrupts it.
#[test]
fn control_is_never_delayed_by_an_inference() {
    let (alone, beside) = (fly(None, 5), fly(Some(Lanes::BOTH), 5));
    let spare = 2_000_000 / 32 - beside.figures.control_instructions_max;
    assert!(beside.figures.inference_instructions_max > spare, "the inference is interrupted: {beside:?}");
    assert_eq!(beside.figures.entry_instructions_max, alone.figures.entry_instructions_max);
    assert!(beside.figures.entry_instructions_max <= ENTRY_BOUND, "{beside:?}");
    for report in [alone, beside] {
        assert!(report.bit_identical, "{report:?}");
        assert_eq!((report.figures.deadline_misses, report.figures.late_inferences), (0, 0), "{report:?}");
    }
}

#[test]
fn a_whole_flight_takes_a_small_share_of_the_processor() {
    let file = model::file_at(2, &model::RELU, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectory = stroke(10);
    let closed_loop = closed_loop();
    let counts = tempfile::NamedTempFile::new().unwrap();
    let plugin = format!("{},out={}", counter::build().unwrap().display(), counts.path().display());
    let further = ["-plugin", &plugin];
    let elf = pil::firmware().unwrap();
    let (mut emulated, line) = pil::connect(&elf, &further, Some(&file), LinkKind::Lockstep, 3).unwrap();
    let mut board = Board::new(line, true);
    board.introduce().unwrap();
    let plan = FlightPlan::new(&trajectory, 3).with(&model, Lanes::BOTH);
    let flight = board.prepare(&closed_loop.settings, Some(Lanes::BOTH)).unwrap();
    fly_on(flight, &closed_loop.vehicle, &closed_loop.settings, &closed_loop.condition, &plan).unwrap();
    board.end();
    assert_eq!(emulated.ended().unwrap(), Some(0));
    let (entries, _) = counter::read(counts.path()).unwrap();
    // What runs between two sleeps: a control tick and what it leaves to be inferred. The last ticks are all in flight.
    let ticks = 4_000;
    let flown = &entries[entries.len() - ticks..];
    let cycles: u64 = flown.iter().map(counter::Entry::cycles_with_waits).sum();
    let instructions: u64 = flown.iter().map(|entry| entry.instructions).sum();
    let share = cycles as f64 / (ticks as u64 * TICK_CYCLES) as f64;
    let per_instruction = cycles as f64 / instructions as f64;
    println!("{:.1} % of the processor, {per_instruction:.2} cycles an instruction", 100.0 * share);
    assert!(share <= SHARE, "{share}");
    assert!(per_instruction <= CYCLES_PER_INSTRUCTION, "{per_instruction}");
}

/// Inferences that are never in time are counted, the network trips, and what is left is the baseline to the bit.
#[test]
fn late_inferences_are_counted_and_leave_the_baseline() {
    let closed_loop = closed_loop();
    let file = model::file(&model::TANH, Precision::Int8);
    let model = Model::from_bytes(&file).unwrap();
    let trajectory = stroke(12);
    let network = Lanes { network: true, feedback: false };
    let fly = |addon: bool, late_from: u32| {
        let mut flight = Flight::new(&closed_loop.settings).unwrap();
        if addon {
            flight.attach(&model, network).unwrap();
        }
        let mut scratch = Scratch::new();
        let mut commands = Vec::new();
        for tick in 0..5 * trajectory.samples.len() as u32 {
            if let Some(sample) = trajectory.samples.get(flight.next_setpoint() as usize).filter(|_| tick % 5 == 0) {
                flight.push_setpoint(&setpoint(sample));
            }
            // A vehicle that is always where it shall be, but for a hand's width.
            let desired = setpoint(&trajectory.samples[tick as usize / 5]);
            let state = State { position: desired.position.add_scalar(0.05), velocity: desired.velocity, ..State::default() };
            let (command, job) = flight.control(Tick(tick), &state);
            if let Some(job) = job {
                // A late result is that of a tick for which nobody waits any more.
                let late = i32::from(tick >= late_from) * 50;
                let Inference { tick, outputs } = job.run(model.network().unwrap(), &mut scratch);
                flight.deliver(Inference { tick: tick - late, outputs });
            }
            commands.push(command);
        }
        let adapter = flight.adapter();
        (commands, adapter.map(|adapter| (adapter.late(), adapter.trips().of(Trip::Late), adapter.correction())))
    };
    let (baseline, _) = fly(false, 0);
    let (in_time, counts) = fly(true, u32::MAX);
    assert_eq!(counts.map(|(late, trips, _)| (late, trips)), Some((0, 0)));
    let (late, counts) = fly(true, 2_000);
    let (count, trips, correction) = counts.unwrap();
    assert!(count >= 5 && trips >= 1, "{count} late, {trips} trips");
    assert_eq!(correction, [0.0; DEFAULT_OUTPUTS]);
    // Not by assert_eq: it would print thousands of commands.
    assert!(late[..2_000] == in_time[..2_000]);
    assert!(in_time[4_000..] != baseline[4_000..]);
    assert!(late[4_000..] == baseline[4_000..]);
}
