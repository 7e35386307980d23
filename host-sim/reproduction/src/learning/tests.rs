//! Names of the rows.

use super::*;

/// The JSON document has the names that it promises.
#[test]
fn a_row_has_the_documented_keys() {
    let case = cases()[0];
    let flown = impromptu_sim::learned::Flown { baseline: vec![0.1], errors: vec![0.01], ..Default::default() };
    let row = serde_json::to_value(Row::new(&case, 7, &flown)).unwrap();
    for key in
        ["vehicle", "loop", "condition", "start", "seconds", "parts", "rms_cm_mean", "reduction_mean", "reduction_worst", "seed"]
    {
        assert!(row.get(key).is_some(), "{key}: {row}");
    }
    assert_eq!((&row["loop"], &row["seconds"], &row["start"]), (&"se3".into(), &"from_first_stroke".into(), &"nothing".into()));
    assert_eq!(serde_json::to_value(Seconds::After(10)).unwrap(), 10);
}
