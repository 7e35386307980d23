//! What the model file promises, and what the adapter does with the models that come out of it.

mod fixture;

mod batch;
mod bounds;
mod calls;
mod command_line;
mod damage;
mod description;
mod edges;
mod golden;
mod guard;
mod large;
mod precision;
mod refusals;
mod round_trip;

mod adapter;
mod add_on;
mod feedback_lane;
mod generic_loop;
