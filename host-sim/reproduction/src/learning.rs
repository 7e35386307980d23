//! Learning in flight: what a loop makes of its error while it flies, from nothing or on top of a model that was made for another
//! one.
//!
//! *in* settings; *out* rows and a [`Study`]; *never* a flight whose motion was learned from before, but where strokes are flown
//! one after another and each is judged as it is flown; *source* ours: least squares on the responses to features, in the manner
//! of Widrow and Walach 1996 (filtered-x) and Pereida, Helwa, Schoellig 2018 (a learned map that corrects references).

mod cases;
mod machines;
mod report;
mod row;
mod seconds;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, btree_map::Entry};

use anyhow::Context as _;
use impromptu_firmware::{adapter::Lanes, model::Model};
use impromptu_report::{Figure, study::Study};
use impromptu_sim::{
    flights::Loop,
    learned::{Flown, LearningLoop, after, one_after_another, second_by_second, teaching},
    trajectory::{Trajectory, strokes},
};
use impromptu_training::{Purpose, Recipe, build, derived, observer::Observer};
use rayon::prelude::*;

use crate::robustness::draw::Ranges;
pub use cases::{Case, Start, cases};
pub use machines::Machine;
pub use row::Row;
pub use seconds::Seconds;

/// What the study covers.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Seed of everything random.
    pub seed: u64,
    /// Test strokes of each row.
    pub strokes: usize,
    /// How models are trained, for the rows that start with one.
    pub recipe: Recipe,
    /// Whether rows that start with a model are flown, for which models are trained.
    pub models: bool,
}

/// Rows of the study, and the study that shows them.
#[derive(Clone, Debug)]
pub struct Found {
    /// One row for each case, then one for each machine.
    pub rows: Vec<Row>,
    /// The same for people.
    pub study: Study,
}

/// Runs the study.
///
/// # Errors
/// If a model cannot be built or a stroke not be flown.
pub fn run(settings: &Settings, command: &str, observer: &dyn Observer) -> anyhow::Result<Found> {
    let all: Vec<Case> = cases().into_iter().filter(|case| settings.models || case.start == Start::Nothing).collect();
    let models = models(settings, &all, observer)?;
    observer.stage(&format!("{} rows of {} strokes", all.len(), settings.strokes));
    let mut rows = all.par_iter().map(|case| fly(settings, case, &models)).collect::<anyhow::Result<Vec<Row>>>()?;
    let mut study = Study::new("Learning in flight", command, settings.seed);
    report::tell(&mut study, settings, &all, &rows);
    for machine in Machine::ALL {
        let flown = machines::learned(machine, settings.strokes, derived(settings.seed, Purpose::Test))?;
        let row = Row::of_machine(machine, settings.seed, &flown);
        report::tell_machine(&mut study, machine, &row);
        rows.push(row);
    }
    observer.stage("the first minute");
    study.figures.extend(first_minutes(settings)?);
    Ok(Found { rows, study })
}

/// Strokes that each drawn vehicle flies.
const DRAW_STROKES: usize = 8;
/// Flights that a picture of the first minute averages.
const FLIGHTS: u64 = 10;

/// How the error melts, for each kind of loop in `lab`.
fn first_minutes(settings: &Settings) -> anyhow::Result<Vec<Figure>> {
    let seed = derived(settings.seed, Purpose::Test);
    let kinds = cases().into_iter().filter(|case| case.in_a_picture());
    kinds
        .map(|case| {
            let closed_loop = case.closed_loop()?;
            let strokes = |flight| strokes(seed ^ (flight + 1), 5, case.speed, closed_loop.rate_hz());
            let flights = (0..FLIGHTS).map(strokes).collect::<Result<Vec<_>, _>>()?;
            let [without, with] = second_by_second(&closed_loop, &flights, 60, seed)?;
            let centimetres =
                |points: Vec<(f64, f64)>| points.into_iter().map(|(second, error)| (second, 100.0 * error)).collect();
            let flown = format!("{} with loop {} in {}", case.vehicle, case.kind(), case.air);
            let figure = Figure::first_minute(report::SECTION, &flown, flights.len(), centimetres(without), centimetres(with));
            Ok(Figure { name: format!("first_minute_{}", case.kind()), ..figure })
        })
        .collect()
}

/// Files of the models that the cases start with, by the loop that they were made for.
fn models(settings: &Settings, all: &[Case], observer: &dyn Observer) -> anyhow::Result<BTreeMap<String, Vec<u8>>> {
    let mut models = BTreeMap::new();
    for case in all.iter().filter_map(Case::made_for) {
        let (name, closed_loop) = case?;
        if let Entry::Vacant(place) = models.entry(name) {
            observer.stage(&format!("{}: building the model", place.key()));
            place.insert(build(&settings.recipe, &closed_loop, settings.seed, &mut |_| {})?.models.int8);
        }
    }
    Ok(models)
}

fn fly(settings: &Settings, case: &Case, models: &BTreeMap<String, Vec<u8>>) -> anyhow::Result<Row> {
    let closed_loop: Loop = case.closed_loop()?;
    let bytes = case.made_for().transpose()?.and_then(|(name, _)| models.get(&name));
    let model = bytes.map(|bytes| Model::from_bytes(bytes)).transpose()?;
    let seed = derived(settings.seed, Purpose::Test);
    let rate = closed_loop.rate_hz();
    let test = strokes(seed, settings.strokes, case.speed, rate)?;
    let motion_s = match case.seconds {
        Seconds::FromFirstStroke => 0,
        Seconds::After(seconds) => seconds,
    };
    let teach = teaching(seed, motion_s, case.speed, rate)?;
    let fly = |closed_loop: &Loop, test: &[Trajectory], seed: u64| {
        let model = model.as_ref().map(|model| (model, Lanes::BOTH));
        let learned = LearningLoop { closed_loop, model, parts: case.parts, response: case.response, seed };
        match case.seconds {
            Seconds::FromFirstStroke => one_after_another(&learned, test, case.then_later_s),
            Seconds::After(seconds) => after(&learned, seconds, &teach, test),
        }
    };
    let flown = if case.draws == 0 {
        fly(&closed_loop, &test, seed)
    } else {
        let draws = (0..case.draws).into_par_iter().map(|draw| {
            let drawn = Ranges::default().mismatch(settings.seed, draw).applied(&closed_loop);
            let first = draw as usize * DRAW_STROKES;
            let own: Vec<Trajectory> = (first..first + DRAW_STROKES).map(|stroke| test[stroke % test.len()].clone()).collect();
            fly(&drawn, &own, seed.wrapping_add(first as u64))
        });
        draws.collect::<Result<Vec<Flown>, _>>().map(Flown::together)
    };
    Ok(Row::new(case, settings.seed, &flown.with_context(|| case.name())?))
}
