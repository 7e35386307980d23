//! The program `host-sim`: from a trajectory to a trained model, its flights and a report.
//!
//! What it does is in the crates below it: `impromptu-sim` flies, `impromptu-training` makes models, `impromptu-diagnosis` judges
//! logs, `impromptu-pil` reaches the emulated board, `impromptu-experiment` is the main job, `impromptu-reproduction` the paper,
//! and `impromptu-report` shows results. Here are only arguments, files and words.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `cli` | the command line: a module for each command |

pub mod cli;
