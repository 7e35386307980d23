//! What the diagnosis promises.

mod any_rate;
mod generated;
mod known_systems;
mod loops;
mod over_rates;
