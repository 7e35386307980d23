//! Flights by the firmware beside the same flights by the software.
//!
//! *in* plans; *out* the records of both and what the microcontroller measured; *never* a comparison of anything but bits.

use impromptu_firmware::model::Model;
use impromptu_flight::{
    learning::{FlightLearning, Guess, POSITION_AGE_S},
    link::Reason,
};
use impromptu_sim::{
    flights::Loop,
    rollout::{FlightPlan, FlightRecord, fly_on},
};
use serde::Serialize;

use crate::{
    board::{Board, Figures},
    error::PilError,
    line::Line,
};

/// Clock of the microcontroller, Hz.
const CORE_HZ: f64 = 168e6;

/// Cycles of an instruction on the microcontroller, 5 flash wait states, over whole control ticks and inferences: more than the
/// cycle model has ever found (`tests/tests/processor.rs` measures it).
pub const CYCLES_PER_INSTRUCTION: f64 = 2.2;

/// What `fly --pil` says of the microcontroller.
#[derive(Clone, Debug, Serialize)]
pub struct PilReport {
    /// Whether motors and references of every tick had the software's bits.
    pub bit_identical: bool,
    /// Control ticks that were flown.
    pub ticks: u64,
    #[serde(flatten)]
    /// What the firmware measured of itself.
    pub figures: Figures,
    /// Share of the processor at 168 MHz and the flown rate, 0..1, if every tick were as expensive as the worst: instructions
    /// times [`CYCLES_PER_INSTRUCTION`].
    pub cpu_share: f64,
    /// The same with control at 1 kHz.
    pub cpu_share_1khz: f64,
}

impl PilReport {
    /// Of these flights and of later ones of the same firmware, whose figures are those of all.
    #[must_use]
    pub fn and(self, later: Self) -> Self {
        Self { bit_identical: self.bit_identical && later.bit_identical, ticks: self.ticks + later.ticks, ..later }
    }
}

/// Flies plans with the software and with the firmware; gives the firmware's records, in the plans' order.
///
/// # Errors
/// If a plan cannot be flown, or the firmware refuses or breaks off.
pub fn fly<L: Line>(
    board: &mut Board<L>,
    closed_loop: &Loop,
    plans: &[FlightPlan<'_>],
    flown: impl FnMut(usize),
) -> Result<(Vec<FlightRecord>, PilReport), PilError> {
    let recorded: Vec<FlightPlan<'_>> = plans.iter().map(recorded).collect();
    let software = closed_loop.fly(&recorded)?;
    beside(board, closed_loop, &recorded, software, flown)
}

/// A learner as the firmware has it before it has learned anything, but that it learns.
///
/// # Errors
/// If the loop's gains are not those of a loop of second order.
pub fn learner(closed_loop: &Loop) -> Result<FlightLearning, PilError> {
    let (settings, age_s) = (&closed_loop.settings, POSITION_AGE_S);
    let guesses = Guess::of(settings, age_s).ok_or(PilError::Refused { command: "to learn", reason: Reason::NoLearner })?;
    let learning = FlightLearning::new(&guesses, settings.rates.reference_hz(), age_s);
    learning.ok_or(PilError::Refused { command: "to learn", reason: Reason::NoLearner })
}

/// As [`fly`], but both learn, from one flight to the next: the software as [`learner`] gives it or as it was recalled, the
/// firmware as it was told.
///
/// # Errors
/// As [`fly`].
pub fn fly_learning<L: Line>(
    board: &mut Board<L>,
    closed_loop: &Loop,
    plans: &[FlightPlan<'_>],
    learning: &mut FlightLearning,
    flown: impl FnMut(usize),
) -> Result<(Vec<FlightRecord>, PilReport), PilError> {
    let recorded: Vec<FlightPlan<'_>> = plans.iter().map(recorded).collect();
    let software = recorded.iter().map(|plan| closed_loop.fly_learning(plan, learning)).collect::<Result<_, _>>()?;
    beside(board, closed_loop, &recorded, software, flown)
}

fn recorded<'a>(plan: &FlightPlan<'a>) -> FlightPlan<'a> {
    FlightPlan { record: true, ..plan.clone() }
}

/// Flies recorded plans with the firmware, beside what the software flew.
fn beside<L: Line>(
    board: &mut Board<L>,
    closed_loop: &Loop,
    plans: &[FlightPlan<'_>],
    mut software: Vec<FlightRecord>,
    mut flown: impl FnMut(usize),
) -> Result<(Vec<FlightRecord>, PilReport), PilError> {
    let mut records = Vec::with_capacity(plans.len());
    let (mut bit_identical, mut ticks, mut inference_hz) = (true, 0, 0.0f64);
    for (index, (plan, software)) in plans.iter().zip(&mut software).enumerate() {
        if let Some((model, lanes)) = plan.model
            && lanes.network
        {
            inference_hz = inference_hz.max(rate_of_inference(model));
        }
        let mut flight = board.prepare(&closed_loop.settings, plan.model.map(|(_, lanes)| lanes))?;
        let mut record = fly_on(&mut flight, &closed_loop.vehicle, &closed_loop.settings, &closed_loop.condition, plan)?;
        flight.check()?;
        let (here, there) = (software.recorded.take().unwrap_or_default(), record.recorded.take().unwrap_or_default());
        // The software flies in groups, as long as the longest of them.
        bit_identical &= !there.answers.is_empty() && here.answers.starts_with(&there.answers);
        ticks += plan.trajectory.samples.len() as u64 * u64::from(closed_loop.settings.rates.position_divisor);
        records.push(record);
        flown(index + 1);
    }
    let figures = board.figures();
    let share = |control_hz: f64| {
        let instructions = control_hz * f64::from(figures.control_instructions_max)
            + inference_hz * f64::from(figures.inference_instructions_max);
        instructions * CYCLES_PER_INSTRUCTION / CORE_HZ
    };
    let (cpu_share, cpu_share_1khz) = (share(closed_loop.settings.rates.control_hz.into()), share(1e3));
    Ok((records, PilReport { bit_identical, ticks, figures, cpu_share, cpu_share_1khz }))
}

/// Inferences a second.
fn rate_of_inference(model: &Model<'_>) -> f64 {
    let timing = &model.card().timing;
    f64::from(timing.reference_rate_hz) / f64::from(timing.divisor.max(1))
}
