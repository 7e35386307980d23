//! Results and findings: data that a run fills, and their views: console table, JSON document, CSV and a self-contained HTML
//! page.
//!
//! - *in*: [`Results`], filled by an evaluation ([`summarise`] averages flights into its rows); a [`study::Study`], filled
//!   finding by finding.
//! - *out*: their JSON, and with the feature `views` [`console_table`], [`write_table_csv`], [`write_flights_csv`],
//!   [`write_html`], [`render_study`].
//! - *never*: hides a number that is not finite (it is shown as `n/a`), loads anything from elsewhere, or leaves half a file.
//! - *source*: the error metric is that of Zhou, Helwa, Schoellig, CDC 2017, table I, and of its predecessor (Li et al.,
//!   ICRA 2017): `sqrt(mean |p_d - p|²)` over the drawn part of a trajectory, and its reduction against the baseline.
//!
//! The data come first and know no view: whoever only produces or checks numbers needs no plotting. Above them are words and
//! groups, then tables and plots, and the page over all.
//!
//! | layer | modules | what they hold |
//! |---|---|---|
//! | 1 | `method`, `figure` | the ways of flying that are compared; curves over two axes as data |
//! | 2 | `results`, `study` | what flights and models came to; what a study found |
//! | 3 | `summary`, `grid` | flights averaged into rows; findings side by side |
//! | 4 | `harmless` | results and studies whose texts act on no terminal and no page |
//! | 4 | `notation`, `cases` | numbers as text; rows and flights grouped by what was flown |
//! | 5 | `csv`, `table`, `plots` | the table as CSV and on the console; SVG panels |
//! | 6 | `page` | the HTML page of results, and that of a study |

#[cfg(feature = "views")]
mod cases;
#[cfg(feature = "views")]
mod csv;
pub mod figure;
#[cfg(test)]
mod fixture;
pub mod grid;
#[cfg(feature = "views")]
mod harmless;
mod method;
#[cfg(feature = "views")]
mod notation;
#[cfg(feature = "views")]
mod page;
#[cfg(feature = "views")]
mod plots;
mod results;
pub mod study;
mod summary;
#[cfg(feature = "views")]
mod table;

#[cfg(feature = "views")]
pub use csv::{write_flights_csv, write_table_csv};
pub use figure::{Axis, Curve, Figure, Mark};
pub use method::{Family, Method};
#[cfg(feature = "views")]
pub use page::{render_html, render_study, write_html, write_page};
pub use results::{FlightTrace, LaneOutcome, Margins, ModelCard, PerFlight, Results, Row};
pub use summary::summarise;
#[cfg(feature = "views")]
pub use table::console_table;
