//! The page as a whole, on invented results.

use std::fs;

use super::*;
use crate::fixture;

/// The page's body as XML: a stricter reading than a browser's.
fn body(page: &str) -> &str {
    let start = page.find("<body>").unwrap();
    &page[start..page.find("</body>").unwrap() + "</body>".len()]
}

/// Set `REPORT_PREVIEW=FILE.html` to keep the page and look at it.
#[test]
fn the_page_of_a_whole_run_is_complete_small_and_well_formed() {
    let results = fixture::full();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("report.html");
    write_html(&results, &path).unwrap();
    let page = fs::read_to_string(&path).unwrap();
    if let Some(preview) = std::env::var_os("REPORT_PREVIEW") {
        fs::write(preview, &page).unwrap();
    }
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "a partial file is left");
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    let document = roxmltree::Document::parse(body(&page)).unwrap();
    let count = |name: &str| document.descendants().filter(|node| node.has_tag_name(name)).count();
    // Two vehicles, four conditions: by method, by flight, by speed; six paths; 3 + 2 + 3 panels of one flight.
    let svg = ("http://www.w3.org/2000/svg", "svg");
    assert_eq!(document.descendants().filter(|node| node.has_tag_name(svg)).count(), 3 * 8 + 6 + 8);
    assert_eq!((count("table"), count("tbody")), (3, 4));
    for heading in document.descendants().filter(|node| node.has_tag_name("th")) {
        assert!(heading.has_attribute("scope"));
    }
}

#[test]
fn nothing_is_loaded_from_elsewhere() {
    let page = render_html(&fixture::full()).unwrap().replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for forbidden in ["http:", "https:", "//", "url(", "@import", "<script", "<link", "src=", "href="] {
        assert!(!page.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn names_cannot_inject_markup() {
    let evil = "<script>alert(\"1\")</script>&'\"><img src=x>";
    let mut results = fixture::full();
    results.flights.truncate(2);
    for trace in &mut results.flights {
        trace.trajectory = evil.to_owned();
    }
    for row in &mut results.table {
        row.condition = evil.to_owned();
        row.vehicle = evil.to_owned();
    }
    results.title = evil.to_owned();
    results.models[0].name = evil.to_owned();
    results.notes[0] = evil.to_owned();
    let page = render_html(&results).unwrap();
    assert!(!page.contains("<script") && !page.contains("<img"));
    roxmltree::Document::parse(body(&page)).unwrap();
}

#[test]
fn numbers_that_are_not_finite_are_shown_as_not_available() {
    let mut results = fixture::full();
    for row in &mut results.table {
        (row.rms_cm_mean, row.reduction_mean, row.reduction_worst) = (f64::NAN, f64::INFINITY, f64::NEG_INFINITY);
        row.speed = f64::NAN;
    }
    for flight in &mut results.per_flight {
        flight.rms_cm = f64::NAN;
    }
    for trace in &mut results.flights {
        trace.flown.fill([f64::NAN; 3]);
        trace.desired.truncate(3);
        trace.scored = std::ops::Range { start: 5, end: 1 };
        trace.rate_hz = f64::NAN;
    }
    let page = render_html(&results).unwrap();
    assert!(page.contains("n/a") && !page.contains("NaN") && !page.contains("inf<"));
    roxmltree::Document::parse(body(&page)).unwrap();
}

#[test]
fn nothing_flown_is_a_page_too() {
    let page = render_html(&fixture::empty()).unwrap();
    assert!(page.contains("Nothing was flown"));
    roxmltree::Document::parse(body(&page)).unwrap();
}

#[test]
fn a_failed_write_leaves_the_old_file_and_names_it() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("report.html");
    // A folder cannot be replaced by a file.
    fs::create_dir(&path).unwrap();
    let message = format!("{:#}", write_html(&fixture::small(), &path).unwrap_err());
    assert!(message.contains("report.html"), "{message}");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
}
