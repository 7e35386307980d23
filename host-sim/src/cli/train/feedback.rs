//! The feedback lane of a model that is trained from files.

use impromptu_model_export::{ExportError, description::LaneDescription};
use impromptu_sim::{flight_log::FlightLog, flights::Loop, trajectory::Trajectory};
use impromptu_training::{LaneChoice, Purpose, Recipe, choose_lane};

use super::super::Invocation;

/// Designs lanes from `logs` and chooses one by flights of `closed_loop` over the `validation` trajectories, or says why there is none.
pub(super) fn choose(
    invocation: &Invocation,
    recipe: &Recipe,
    closed_loop: Option<&Loop>,
    logs: &[FlightLog],
    validation: &[Trajectory],
    encode: &(dyn Fn(&LaneDescription) -> Result<Vec<u8>, ExportError> + Sync),
) -> Result<LaneChoice, String> {
    let Some(closed_loop) = closed_loop else {
        return Err("it is chosen by simulated flights, and no vehicle was given; give --vehicle".into());
    };
    let flight_seed = invocation.configuration.seed_of(Purpose::Validation);
    choose_lane(recipe, closed_loop, logs, validation, flight_seed, encode).map_err(|reason| reason.to_string())
}
