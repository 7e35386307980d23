//! What both boards share: how they start, what their tasks do, where models lie, what motors get.
//!
//! The programs are in `src/bin/`, each for one board: they own the peripherals and give their tasks what is here. Nothing here
//! touches a register, so that the same code is checked on the host.
//!
//! | layer | modules | what they hold |
//! |--:|---|---|
//! | 1 | `vehicle` | the vehicle, its rates, its link |
//! | 1 | `slots` | where models and what was learned lie in the flash |
//! | 2 | `motor` | rotor speeds to duty cycles |
//! | 2 | `start` | the newest model that the vehicle can fly, and the loop before it is sent another |
//! | 3 | `tasks` | control, receiver, inference, storage: what each does when it runs |
#![no_std]

pub mod motor;
pub mod slots;
mod start;
mod tasks;
mod vehicle;

pub use start::{Start, fits, start};
pub use tasks::{Cost, Keeping, Tasks, Tick};
pub use vehicle::{CONTROL_HZ, CORE_HZ, CRAZYFLIE, LINK_BAUD};
