//! What the tests of every study ask of it.

use impromptu_report::study::Study;

use crate::{extensions, lti, quadrotor};

/// Those of some rows of the paper that no number answers.
pub(crate) fn unanswered(study: &Study, rows: &[u8]) -> Vec<u8> {
    rows.iter().copied().filter(|row| !study.findings.iter().any(|finding| finding.rows.contains(row))).collect()
}

/// Asserts that each number and figure has a name of its own, numbers are finite and figures can be read. Gives the figures'
/// names.
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

/// Rows of the paper's promises.
const PROMISES: std::ops::RangeInclusive<u8> = 1..=31;

#[test]
fn every_row_of_the_papers_promises_is_answered_by_a_number_and_no_number_answers_another_row() {
    let studies = [
        (&*lti::tests::QUICK, lti::ROWS),
        (&*extensions::tests::QUICK, extensions::ROWS),
        (&*quadrotor::tests::QUICK, quadrotor::ROWS),
    ];
    let missing: Vec<u8> =
        PROMISES.filter(|row| studies.iter().all(|(study, _)| !unanswered(study, &[*row]).is_empty())).collect();
    assert_eq!(missing, Vec::<u8>::new());
    for (study, rows) in studies {
        assert_eq!(unanswered(study, rows), Vec::<u8>::new(), "{}", study.title);
        let strangers = study.findings.iter().filter(|finding| finding.rows.iter().any(|row| !PROMISES.contains(row)));
        assert_eq!(strangers.map(|finding| finding.name.as_str()).collect::<Vec<_>>(), Vec::<&str>::new());
    }
}
