//! A model is replaced in flash whole or not at all.

mod flash;
mod models;

mod cuts;
mod damage;
#[cfg(feature = "signed")]
mod signed;
mod uploads;
