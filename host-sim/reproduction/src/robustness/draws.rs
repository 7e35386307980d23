//! Monte Carlo over vehicles: each draw is another vehicle in another air, flown with the model of the nominal one.
//!
//! *in* a loop, a model, ranges, a seed; *out* a [`Draw`] for each number; *never* a draw that depends on other draws, on the shard or on the
//! number of threads; *source* Tempo, Calafiore, Dabbene, "Randomized Algorithms for Analysis and Control of Uncertain Systems" (2013).

use std::path::Path;

use impromptu_firmware::model::Model;
use impromptu_sim::{
    flights::{FlightsError, Loop},
    trajectory::{Trajectory, strokes},
};
use impromptu_training::{Purpose, derived};
use rayon::prelude::*;

use super::{
    comparison::Comparison,
    draw::{Draw, DrawSettings},
    ledger::{Content, Header, Ledger, LedgerError},
};

/// Test strokes that the draws share out among them.
const STROKES: usize = 30;
/// Draws that are flown before the file is written to.
const BATCH: usize = 16;

/// Why a Monte Carlo run stopped.
#[derive(Debug, thiserror::Error)]
pub enum DrawsError {
    /// A flight could not be flown.
    #[error(transparent)]
    Flights(#[from] FlightsError),
    /// The file with what was flown before.
    #[error(transparent)]
    Ledger(#[from] LedgerError),
}

/// Flies the draws of a shard that `path` does not hold yet, writes them there as they are done, and returns all that it holds then.
///
/// # Errors
/// If the file is of other settings or damaged, or if something cannot be flown.
pub fn fly_draws(
    header: &Header,
    closed_loop: &Loop,
    model: &Model<'_>,
    path: &Path,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Content, DrawsError> {
    let mut ledger = Ledger::resume(path, header)?;
    let settings = &header.settings;
    let numbers: Vec<u32> = header.shard.draws(settings.draws).collect();
    let held = ledger.len();
    let seed = derived(settings.seed, Purpose::Test);
    let trajectories = strokes(seed, STROKES, 1.0, closed_loop.rate_hz()).map_err(FlightsError::from)?;
    for batch in numbers.get(held..).unwrap_or_default().chunks(BATCH) {
        let flown: Vec<Draw> = batch
            .par_iter()
            .map(|&draw| fly_draw(settings, closed_loop, model, &trajectories, seed, draw))
            .collect::<Result<_, _>>()?;
        for draw in &flown {
            ledger.append(draw)?;
        }
        ledger.flush()?;
        progress(ledger.len() as u64, numbers.len() as u64);
    }
    drop(ledger);
    Ok(Content::read(path)?)
}

fn fly_draw(
    settings: &DrawSettings,
    closed_loop: &Loop,
    model: &Model<'_>,
    trajectories: &[Trajectory],
    seed: u64,
    draw: u32,
) -> Result<Draw, FlightsError> {
    let mismatch = settings.mismatch(draw);
    let first = draw as usize * settings.strokes;
    let flights: Vec<(&Trajectory, u64)> = (first..first + settings.strokes)
        .map(|flight| (&trajectories[flight % trajectories.len()], seed.wrapping_add(flight as u64)))
        .collect();
    let flown = Comparison::of(&mismatch.applied(closed_loop), model, &flights)?;
    let told = |errors: &[f64]| errors.iter().map(|error| error.is_finite().then_some(*error)).collect();
    Ok(Draw {
        draw,
        mismatch,
        baseline: told(&flown.baseline),
        network: told(&flown.network),
        both: told(&flown.both),
        tripped: flown.tripped as u32,
        trips: flown.trips,
    })
}
