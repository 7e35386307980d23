//! Results and their views: console table, JSON document, CSV and a self-contained HTML page.
//!
//! - *in*: [`Results`], filled by an evaluation; [`summarise`] averages flights into its rows.
//! - *out*: [`console_table`], [`Results::to_json`], [`write_table_csv`], [`write_flights_csv`], [`write_html`].
//! - *never*: hides a number that is not finite (it is shown as `n/a`), loads anything from elsewhere, or leaves half a file.
//! - *source*: the error metric is that of Zhou, Helwa, Schoellig, CDC 2017, table I, and of its predecessor (Li et al.,
//!   ICRA 2017): `sqrt(mean |p_d - p|²)` over the drawn part of a trajectory, and its reduction against the baseline.

mod cases;
mod csv;
#[cfg(test)]
mod fixture;
mod method;
mod notation;
mod page;
mod plots;
mod results;
mod table;

pub use cases::summarise;
pub use csv::{write_flights_csv, write_table_csv};
pub use method::Method;
pub use page::{render_html, render_study, write_html, write_page};
pub use plots::{Axis, Curve, Figure, Mark};
pub use results::{FlightTrace, LaneOutcome, Margins, ModelCard, PerFlight, Results, Row};
pub use table::console_table;
