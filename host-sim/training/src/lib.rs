//! From flight logs to models: what `impromptu-sim` has flown, or somebody's own vehicle, becomes the file that the firmware
//! flies.
//!
//! ```text
//! training flights ──► logs ──► sound ones ──► examples ──► ridge, networks ──► candidates ──► flights choose ──► model files
//!                        └────► gates (does it make sense at all?)                                  ▲
//! dithered flights ──► identification ──► designs of the feedback lane ──► flights choose ──────────┤
//!                                 └──────► response for the guard's monitor ────────────────────────┘
//! ```
//!
//! *in* a [`Recipe`] and a loop, or logs; *out* models; *never* a choice made on the test flights; *source* Zhou 2017, sections
//! III and V.
//!
//! At the bottom are methods that know no recipe: supervised training from rows, identification and design of a feedback lane
//! from signals, channels for the diagnosis. Above them is the recipe, which decides how a model comes about, and the single
//! steps: leave out flights that broke down, hold some out, learn, describe, choose a lane, measure what the monitor needs. A
//! [`Pipeline`] does them all, whatever the logs come from; [`build()`] flies the logs first.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 0 | `gathered` | columns of a log as it is read |
//! | 1 | `supervised`, `bypass` | rows to networks; inputs past a network |
//! | 1 | `feedback_design` | identification and design of the feedback lane |
//! | 1 | `channel`, `breakdown`, `hold_out` | channels of logs; flights that teach nothing; logs that are held out |
//! | 1 | `turned` | flights turned about the vertical |
//! | 1 | `purpose`, `observer` | seeds; who watches |
//! | 1 | `agreement` | logs beside a simulated loop |
//! | 1 | `coverage` | trajectories beside what was trained on |
//! | 2 | `examples`, `gates` | rows of features from logs; the diagnosis before a training |
//! | 2 | `track` | axes of the logs of any loop, for a replay |
//! | 2 | `recipe` | everything that decides, as data |
//! | 3 | `learn` | logs to networks |
//! | 3 | `rehearsal` | training flights that a loop survives |
//! | 4 | `error`, `files`, `models` | why there are no models; files written whole; descriptions |
//! | 4 | `flown` | what was learned in flight as a network |
//! | 5 | `validation`, `lane_choice` | flights that judge; what comes of the choice of a lane |
//! | 6 | `lane` | the feedback lane, chosen in flight |
//! | 7 | `monitor` | what the guard is told of the loop |
//! | 8 | `pipeline` | from logs to a model file |
//! | 9 | `build` | from a loop to its models |

pub mod agreement;
pub mod breakdown;
pub mod build;
pub mod bypass;
pub mod channel;
pub mod coverage;
pub mod error;
pub mod examples;
pub mod feedback_design;
pub mod files;
pub mod flown;
pub mod gates;
pub mod gathered;
pub mod hold_out;
pub mod lane;
pub mod lane_choice;
pub mod learn;
pub mod models;
pub mod monitor;
pub mod observer;
pub mod pipeline;
pub mod purpose;
pub mod recipe;
pub mod rehearsal;
pub mod supervised;
pub mod track;
pub mod turned;
pub mod validation;

pub use breakdown::{Breakdown, largest_sound_error};
pub use build::{Built, Flown, ModelSet, build, minutes, training_logs};
pub use bypass::Bypass;
pub use error::BuildError;
pub use examples::Labels;
pub use files::{write_log, write_model_files};
pub use flown::{FlownError, learned_in_flight};
pub use gates::{AxisGates, check_gates};
pub use lane::{choose_lane, dithered_logs, lanes, strongest_lane};
pub use lane_choice::{LaneChoice, LaneRefusal, in_words};
pub use learn::{Candidates, Judge, LearnError, LearnSettings, Learned, Rows, learn};
pub use models::{describe, feedforward};
pub use monitor::{monitor, validated_rms};
pub use observer::Observer;
pub use pipeline::{Pipeline, Trained, smoothing};
pub use purpose::{Purpose, derived};
pub use recipe::{FlightSet, LaneRecipe, Recipe, Signal};
pub use validation::{Validation, best_in_flight};
