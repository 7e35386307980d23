//! The plots of the HTML page: small SVG panels drawn by `plotters`, coloured by the page's style sheet.

mod axes;
mod canvas;
mod curve;
mod curves;
mod distribution;
mod path;
mod reduction;
mod rows;
mod speed;
mod time;

pub(super) use curves::{colour_variable, draw};
pub(super) use distribution::error_distribution;
pub(super) use path::path_in_space;
pub(super) use reduction::reduction_by_method;
pub(super) use rows::colour_class;
pub(super) use speed::{methods_by_speed, reduction_by_speed};
pub(super) use time::{correction_over_time, error_over_time, position_over_time};
