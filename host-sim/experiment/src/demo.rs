//! The main job, end to end: simulate, train, quantise, export, fly, compare.

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use anyhow::Context as _;
use garde::Validate;
use impromptu_report::{FlightTrace, ModelCard, PerFlight, Results, summarise};
use impromptu_sim::{condition::Condition, flight_log::FlightLog, flights::Loop, plant::Vehicle, trajectory::strokes};
use impromptu_training::{
    Purpose,
    build::{Built, build},
    derived,
    files::{write_log, write_model_files},
    observer::Observer,
    recipe::{Recipe, counted, within},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::evaluation::{evaluate, model_card, traces};

/// What the demo covers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(default, deny_unknown_fields)]
pub struct DemoSettings {
    /// Seed of everything random.
    #[garde(skip)]
    pub seed: u64,
    /// Repetitions of training and test, with seeds from `seed` on.
    #[garde(custom(within(1.0, 1000.0)))]
    pub seeds: u32,
    /// Vehicles.
    #[garde(length(min = 1, max = 64))]
    pub vehicles: Vec<String>,
    /// Position gains.
    #[garde(length(min = 1, max = 64))]
    pub gains: Vec<String>,
    /// Conditions.
    #[garde(length(min = 1, max = 64))]
    pub conditions: Vec<String>,
    /// Speeds of the test strokes.
    #[garde(length(min = 1, max = 64), inner(custom(within(0.05, 20.0))))]
    pub speeds: Vec<f64>,
    /// Test strokes.
    #[garde(custom(counted(1, 10_000)))]
    pub strokes: usize,
    /// Further delay of the whole loop at test time only, ms, flown at the first speed; 0: not flown.
    #[garde(custom(within(0.0, 500.0)))]
    pub extra_delay_ms: f64,
    /// Recipe of the models.
    #[garde(dive)]
    pub recipe: Recipe,
    /// Folder for model files and flight logs.
    #[serde(skip)]
    #[garde(skip)]
    pub out: Option<PathBuf>,
}

impl Default for DemoSettings {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        Self {
            seed: 1,
            seeds: 1,
            vehicles: names(&["crazyflie", "crazyflie-brushless"]),
            gains: names(&["stock"]),
            conditions: names(&Condition::NAMES),
            speeds: vec![1.0, 1.35, 1.7],
            strokes: 30,
            extra_delay_ms: 20.0,
            recipe: Recipe::default(),
            out: None,
        }
    }
}

/// Strokes whose flights are kept in full.
const TRACED: usize = 4;

/// What came of one loop and seed.
struct Outcome {
    flights: Vec<PerFlight>,
    card: ModelCard,
    traces: Vec<(FlightTrace, FlightLog)>,
    seconds: [f64; 2],
}

/// Runs the demo.
///
/// # Errors
/// Unknown names, or anything that fails on the way.
pub fn run(settings: &DemoSettings, observer: &dyn Observer) -> anyhow::Result<Results> {
    let started = Instant::now();
    let cases = cases(settings)?;
    let trainings = settings.recipe.weight_decays.len();
    let epochs = ((settings.recipe.network.epochs + 1) * trainings + settings.recipe.fine_tuning.epochs + 1) as u64;
    let tests = settings.speeds.len() as u64 + 1;
    let (done, of) = (AtomicU64::new(0), cases.len() as u64 * (epochs + 3 * tests));
    let advance = |steps: u64| observer.steps(done.fetch_add(steps, Ordering::Relaxed) + steps, of);
    let outcomes: Vec<Outcome> = cases
        .par_iter()
        .enumerate()
        .map(|(index, (closed_loop, seed))| {
            let name = format!("{} {} {} seed {seed}", closed_loop.vehicle.name, closed_loop.gains, closed_loop.condition.name);
            observer.stage(&format!("{name}: collecting, training, designing the feedback lane"));
            let begin = Instant::now();
            let built = build(&settings.recipe, closed_loop, *seed, &mut |_| advance(1)).with_context(|| name.clone())?;
            let trained = begin.elapsed().as_secs_f64();
            observer.stage(&format!("{name}: trained on {}", built.flown));
            if !built.learned.broken.is_empty() {
                observer.stage(&format!("{name}: {} training flights broke down, left out", built.learned.broken.len()));
            }
            observer.stage(&match &built.lane {
                Ok(choice) => format!("{name}: feedback lane {}", choice.design),
                Err(reason) => format!("{name}: written without feedback lane: {reason}"),
            });
            let flights = test(settings, closed_loop, &built, *seed, &|| advance(3)).with_context(|| name.clone())?;
            let test_seed = derived(*seed, Purpose::Test);
            let traced = if index == 0 || closed_loop.condition.name == "lab" && *seed == settings.seed { TRACED } else { 0 };
            let speed = settings.speeds.first().copied().unwrap_or(1.0);
            let trajectories = strokes(test_seed, traced, speed, closed_loop.rate_hz())?;
            if let Some(out) = &settings.out {
                write_models(out, closed_loop, &built, *seed)?;
            }
            Ok(Outcome {
                flights,
                card: model_card(&built, closed_loop)?,
                traces: traces(&built, closed_loop, &trajectories, speed, test_seed)?,
                seconds: [trained, begin.elapsed().as_secs_f64() - trained],
            })
        })
        .collect::<anyhow::Result<_>>()?;
    let mut results = Results {
        title: "Impromptu: references corrected by a learned add-on".into(),
        command: "cargo run --release".into(),
        seed: settings.seed,
        software_version: env!("CARGO_PKG_VERSION").into(),
        table: Vec::new(),
        flights: Vec::new(),
        per_flight: Vec::new(),
        models: Vec::new(),
        timings: Vec::new(),
        conditions: Vec::new(),
        notes: Vec::new(),
    };
    let mut seconds = [0.0; 2];
    for outcome in outcomes {
        results.per_flight.extend(outcome.flights);
        results.models.push(outcome.card);
        seconds = [seconds[0] + outcome.seconds[0], seconds[1] + outcome.seconds[1]];
        for (trace, log) in outcome.traces {
            if let Some(out) = &settings.out {
                let name = format!(
                    "{}-{}-{}-stroke{}-{}.csv",
                    trace.vehicle,
                    trace.gains,
                    trace.condition,
                    trace.trajectory.rsplit(':').next().unwrap_or("0"),
                    trace.method.name()
                );
                write_log(&log, &folder(out, "logs")?.join(name))?;
            }
            results.flights.push(trace);
        }
    }
    results.table = summarise(&results.per_flight);
    results.timings = vec![
        ("collecting, training, lane design, export (sum over loops)".into(), seconds[0]),
        ("test flights (sum over loops)".into(), seconds[1]),
        ("the whole run".into(), started.elapsed().as_secs_f64()),
    ];
    Ok(results)
}

/// Every loop that the settings name, with each seed.
fn cases(settings: &DemoSettings) -> anyhow::Result<Vec<(Loop, u64)>> {
    let mut cases = Vec::new();
    for seed in (0..u64::from(settings.seeds.max(1))).map(|index| settings.seed.wrapping_add(index)) {
        for vehicle in &settings.vehicles {
            let vehicle = Vehicle::named(vehicle)?;
            for gains in &settings.gains {
                for condition in &settings.conditions {
                    let condition = Condition::named(condition).with_context(|| {
                        format!("no condition is named `{condition}`; known names: {}", Condition::NAMES.join(", "))
                    })?;
                    cases.push((Loop::new(vehicle.clone(), gains, condition)?, seed));
                }
            }
        }
    }
    Ok(cases)
}

/// Test flights at every speed, and at the first one with more delay.
fn test(
    settings: &DemoSettings,
    closed_loop: &Loop,
    built: &Built,
    seed: u64,
    advance: &dyn Fn(),
) -> anyhow::Result<Vec<PerFlight>> {
    let test_seed = derived(seed, Purpose::Test);
    let mut flights = Vec::new();
    for &speed in &settings.speeds {
        let trajectories = strokes(test_seed, settings.strokes, speed, closed_loop.rate_hz())?;
        flights.extend(evaluate(built, closed_loop, &trajectories, speed, test_seed, seed)?);
        advance();
    }
    if let (Some(&speed), true) = (settings.speeds.first(), settings.extra_delay_ms > 0.0) {
        let late = closed_loop.delayed(settings.extra_delay_ms / 1e3);
        let trajectories = strokes(test_seed, settings.strokes, speed, closed_loop.rate_hz())?;
        flights.extend(evaluate(built, &late, &trajectories, speed, test_seed, seed)?);
    }
    advance();
    Ok(flights)
}

fn folder(out: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let folder = out.join(name);
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    Ok(folder)
}

/// The flashed model of a loop, with the float network, its description and the calibration rows beside it.
fn write_models(out: &Path, closed_loop: &Loop, built: &Built, seed: u64) -> anyhow::Result<()> {
    let name = format!("{}-{}-{}-seed{seed}", closed_loop.vehicle.name, closed_loop.gains, closed_loop.condition.name);
    write_model_files(&folder(out, "models")?, &name, &built.learned, &built.models.description, &built.models.int8)?;
    Ok(())
}
