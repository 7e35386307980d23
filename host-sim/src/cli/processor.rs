//! `host-sim fly --pil`: flights through the firmware on the emulated microcontroller.

use std::path::Path;

use anyhow::{Context as _, Result, bail};
use impromptu_experiment::evaluation::per_flight;
use impromptu_firmware::adapter::Lanes;
use impromptu_flight::{learning::KEPT, link::message::LearnOrder};
use impromptu_pil::{self as pil, Board, Line, LinkKind, PilReport};
use impromptu_report::{Method, PerFlight, Row, summarise};
use impromptu_sim::{
    flights::Loop,
    learned::commissioning,
    rollout::{FlightPlan, FlightRecord},
    trajectory::Trajectory,
};
use impromptu_training::{Purpose, observer::Observer as _};
use serde::Serialize;

use super::{
    Invocation,
    learned_file::{keep, kept},
    model_file::{ModelFile, method},
    output::{number, table},
};

/// Nanoseconds of an instruction as a power of two: 125 million instructions a second, about what 168 MHz give.
const SHIFT: u32 = 3;

/// What is flown through the firmware.
pub(super) struct Flights<'a> {
    pub(super) closed_loop: &'a Loop,
    pub(super) trajectories: &'a [Trajectory],
    pub(super) speed: f64,
    pub(super) file: Option<&'a ModelFile>,
    pub(super) lanes: Lanes,
    pub(super) link: LinkKind,
    pub(super) learn: Option<Learn<'a>>,
}

/// What is done with what the microcontroller learns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Learn<'a> {
    /// File for it.
    pub(super) keep: Option<&'a Path>,
    /// File with what was learned before, which the flash holds at the start; else the responses are measured first.
    pub(super) recall: Option<&'a Path>,
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
struct Flown {
    seed: u64,
    strokes: usize,
    model: Option<String>,
    link: String,
    table: Vec<Row>,
    pil: PilReport,
}

impl Flights<'_> {
    /// Flies the baseline and, if there is one, the model over the trajectories, and prints the same table as the software would.
    pub(super) fn run(&self, invocation: &Invocation) -> Result<()> {
        if self.closed_loop.condition.command_delay_s > 0.0 {
            bail!("--pil: the firmware has no further delay to offer; leave out --extra-delay-ms");
        }
        let (seed, flight_seed) = (invocation.configuration.seed(), invocation.configuration.seed_of(Purpose::Test));
        invocation.console.note(&format!("seed {seed}; building the firmware"));
        let model = self.file.map(ModelFile::model).transpose()?;
        let recalled = self.learn.and_then(|learn| learn.recall).map(kept).transpose()?.unwrap_or_default();
        let (_emulated, mut board) = pil::start_recalling(self.file.map(ModelFile::bytes), &recalled, self.link, SHIFT)?;
        let (flies, wanted) = (board.introduce()?, model.as_ref().map(|model| model.checksum()));
        if flies != wanted {
            bail!("the firmware flies another model ({flies:08x?}) than it was given ({wanted:08x?})");
        }
        let seeds = || self.trajectories.iter().zip(flight_seed..);
        let mut plans: Vec<FlightPlan<'_>> = seeds().map(|(trajectory, seed)| FlightPlan::new(trajectory, seed)).collect();
        let flights = plans.len();
        if let Some(model) = &model {
            plans.extend(seeds().map(|(trajectory, seed)| FlightPlan::new(trajectory, seed).with(model, self.lanes)));
        }
        let of = plans.len() as u64;
        let flown = |done: usize| invocation.console.steps(done as u64, of);
        let (records, mut pil) = pil::fly(&mut board, self.closed_loop, &plans, flown).context("--pil")?;
        let errors = |records: &[FlightRecord]| records.iter().map(|record| record.rms).collect::<Vec<f64>>();
        let learned = match self.learn {
            Some(learn) => {
                let plans = plans.split_off(plans.len() - flights);
                let (records, learning) = self.learn(&mut board, learn, &plans, invocation).context("--pil --learn")?;
                pil = pil.and(learning);
                errors(&records)
            }
            None => Vec::new(),
        };
        board.end();
        invocation.console.finish();
        let errors = errors(&records);
        let (baseline, with_model) = errors.split_at(flights);
        let scored = |method, errors: &[f64]| -> Vec<PerFlight> {
            per_flight(self.closed_loop, self.trajectories, self.speed, method, errors, baseline, seed)
        };
        let mut per_flight = scored(Method::Baseline, baseline);
        if let Some(model) = &model {
            per_flight.extend(scored(method(model, self.lanes), with_model));
        }
        if self.learn.is_some() {
            per_flight.extend(scored(if model.is_some() { Method::FullLearned } else { Method::Learned }, &learned));
        }
        let flown = Flown {
            seed,
            strokes: flights,
            model: self.file.map(ModelFile::name),
            link: format!("{:?}", self.link).to_lowercase(),
            table: summarise(&per_flight),
            pil,
        };
        invocation.format.print(&flown, || text(&flown))
    }

    /// Flies plans one after another while the firmware learns; before, it measures the responses, or goes on with what its flash
    /// held.
    fn learn<L: Line>(
        &self,
        board: &mut Board<L>,
        learn: Learn<'_>,
        plans: &[FlightPlan<'_>],
        invocation: &Invocation,
    ) -> Result<(Vec<FlightRecord>, PilReport)> {
        let closed_loop = self.closed_loop;
        let mut software = pil::learner(closed_loop)?;
        let model = plans.first().and_then(|plan| plan.model).map(|(model, _)| model.checksum());
        board.disarm()?;
        let mut measured = None;
        match learn.recall {
            Some(path) => {
                software.recall(model, &kept(path)?).with_context(|| path.display().to_string())?;
                board.learn(LearnOrder::Learn)?;
            }
            None => {
                let hover = commissioning(closed_loop.rate_hz())?;
                software.add_on().commission();
                board.learn(LearnOrder::Commission)?;
                let plan = FlightPlan::new(&hover, invocation.configuration.seed_of(Purpose::Test));
                measured = Some(pil::fly_learning(board, closed_loop, &[plan], &mut software, |_| ())?.1);
                if let Some(problem) = software.progress().problem {
                    bail!("the responses were not measured: {problem}");
                }
            }
        }
        let flown = |done: usize| invocation.console.steps(done as u64, plans.len() as u64);
        let (records, mut report) = pil::fly_learning(board, closed_loop, plans, &mut software, flown)?;
        if let Some(measured) = measured {
            report = measured.and(report);
        }
        board.disarm()?;
        let learned = board.learned()?;
        report.bit_identical &= software.keep(model, &mut [0; KEPT]) == Some(&learned);
        if let Some(path) = learn.keep {
            keep(path, &learned, invocation)?;
        }
        Ok((records, report))
    }
}

fn text(flown: &Flown) -> String {
    let rows = flown.table.iter().map(|row| {
        let reduction = |value| if row.method == Method::Baseline { String::new() } else { number(value, 1) };
        [
            format!("{} {} {}", row.vehicle, row.gains, row.condition),
            row.method.name().to_owned(),
            format!("{}x", row.speed),
            number(row.rms_cm_mean, 3),
            reduction(row.reduction_mean),
            reduction(row.reduction_worst),
        ]
    });
    let flights = table(["flown by the firmware", "method", "speed", "RMS error, cm", "mean, %", "worst, %"], 2, rows);
    let PilReport { bit_identical, ticks, figures, cpu_share, cpu_share_1khz } = &flown.pil;
    let bits = if *bit_identical { "every bit is the software's" } else { "NOT the software's bits" };
    let share = |share: &f64| format!("{} %", number(100.0 * share, 1));
    let figures = [
        ("control ticks", format!("{ticks}, {bits}")),
        ("control task, worst", format!("{} instructions", figures.control_instructions_max)),
        ("inference, worst", format!("{} instructions", figures.inference_instructions_max)),
        ("tick to control task, worst", format!("{} instructions", figures.entry_instructions_max)),
        ("deadlines missed", figures.deadline_misses.to_string()),
        ("late inferences", figures.late_inferences.to_string()),
        ("processor at 168 MHz, every tick as the worst", format!("{} (1 kHz: {})", share(cpu_share), share(cpu_share_1khz))),
        ("stack, deepest", format!("{} B", figures.stack_bytes)),
        ("frames dropped", figures.dropped.to_string()),
    ];
    let figures = table(["microcontroller", ""], 1, figures.map(|(name, value)| [name.to_owned(), value]));
    format!("{} flights, seed {}, link {}\n{flights}{figures}", flown.strokes, flown.seed, flown.link)
}
