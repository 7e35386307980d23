//! What the diagnosis promises.

mod generated;
mod known_systems;
mod loops;
