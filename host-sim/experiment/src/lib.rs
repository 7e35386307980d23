//! The main job: collect flights, train, design the feedback lane, export, fly every method over unseen strokes, compare.
//!
//! *in* [`demo::DemoSettings`]; *out* models and [`impromptu_report::Results`]; *never* a choice made on the test flights;
//! *source* Zhou 2017, section V; Li 2017 (30 unseen strokes).
//!
//! How models come about is `impromptu-training`'s; how results look is `impromptu-report`'s, of which only the data are used
//! here, so that whoever checks numbers needs no plotting.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `evaluation` | flights of every method over the test strokes |
//! | 1 | `second_order` | a rough response of a loop, from its logs |
//! | 2 | `demo` | the whole run, loop by loop |
//! | 2 | `replay` | logs of any loop through the learner: what it would have left of each next flight |

pub mod demo;
pub mod evaluation;
pub mod replay;
pub mod second_order;
