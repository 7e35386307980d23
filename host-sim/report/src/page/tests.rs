//! The page as a whole, on invented results.

use crate::{
    figure::{Axis, Curve, Figure},
    study::Study,
};
use proptest::prelude::*;
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

/// Numbers that no flight has, and that files can hold all the same.
fn insane() -> impl Strategy<Value = f64> {
    let magnitude = prop_oneof![
        Just(0.0),
        Just(5e-324),
        Just(1e-300),
        Just(1.0),
        Just(1.0 + f64::EPSILON),
        Just(1e12),
        Just(1e12 - 1e-4),
        Just(1e15),
        Just(1e155),
        Just(1e308),
        Just(f64::MAX),
        Just(f64::INFINITY),
        Just(f64::NAN),
        -5.0..5.0,
    ];
    (magnitude, any::<bool>()).prop_map(|(value, negative): (f64, bool)| if negative { -value } else { value })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn a_page_of_insane_numbers_is_made_in_bounded_time(
        values in proptest::collection::vec(insane(), 24),
        rate_hz in insane(),
        speed in insane(),
        axis_only in any::<bool>(),
    ) {
        let mut results = fixture::full();
        results.flights.truncate(2);
        let mut next = values.iter().copied().cycle();
        for trace in &mut results.flights {
            (trace.rate_hz, trace.scored) = (rate_hz, 1..7);
            for points in [&mut trace.desired, &mut trace.flown, &mut trace.reference] {
                points.truncate(8);
                points.iter_mut().flatten().for_each(|value| *value = if axis_only { values[0] } else { next.next().unwrap() });
            }
        }
        for row in &mut results.table {
            (row.speed, row.rms_cm_mean, row.reduction_mean, row.reduction_worst) = (speed, values[0], values[1], values[2]);
        }
        for flight in &mut results.per_flight {
            (flight.speed, flight.rms_cm, flight.reduction) = (speed, next.next().unwrap(), next.next().unwrap());
        }
        let started = std::time::Instant::now();
        let page = render_html(&results).unwrap();
        prop_assert!(page.ends_with("</html>") && page.len() < 4_000_000, "{} bytes", page.len());
        prop_assert!(started.elapsed().as_secs() < 10);
        let figure = |logarithmic| Figure {
            section: "s".into(),
            name: "n".into(),
            title: "t".into(),
            x: Axis { label: "x".into(), logarithmic },
            y: Axis { label: "y".into(), logarithmic },
            curves: vec![Curve::line_and_dots("c", values.chunks(2).map(|pair| (pair[0], pair[1])))],
        };
        let mut study = Study::new("t", "c", 1);
        study.draw(figure(false));
        study.draw(figure(true));
        prop_assert!(render_study(&study).unwrap().len() < 1_000_000);
    }
}
