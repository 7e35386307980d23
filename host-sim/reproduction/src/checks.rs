//! What the tests of every study ask of it.

use impromptu_report::study::Study;

use crate::{extensions, lti, quadrotor};

/// Those of some rows of the paper that no number answers.
pub(crate) fn unanswered(study: &Study, rows: &[u8]) -> Vec<u8> {
    rows.iter().copied().filter(|row| !study.findings.iter().any(|finding| finding.rows.contains(row))).collect()
}

/// Asserts that each number and figure has a name of its own, numbers are finite and figures can be read. Gives the figures' names.
pub(crate) fn assert_readable(study: &Study) -> Vec<&str> {
    let figures: Vec<&str> = study.figures.iter().map(|figure| figure.name.as_str()).collect();
    let mut names: Vec<&str> = study.findings.iter().map(|finding| finding.name.as_str()).chain(figures.clone()).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
    assert!(study.findings.iter().all(|finding| finding.value.is_finite()));
    assert!(study.figures.iter().all(|figure| !figure.curves.is_empty() && figure.curves.len() <= 6));
    figures
}

/// That each study answers its rows is asserted in the tests of each.
#[test]
fn every_row_of_the_papers_promises_has_a_study() {
    let mut rows = [lti::ROWS, extensions::ROWS, quadrotor::ROWS].concat();
    rows.sort_unstable();
    rows.dedup();
    assert_eq!(rows, (1..=31).collect::<Vec<u8>>());
}
