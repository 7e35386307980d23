//! Names of the rows, and machines.

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

/// What measures its own response learns: past friction, a resonance, and a zero for which no inverse is stable.
#[test]
fn machines_that_are_no_quadrotor_learn_from_nothing() {
    for (machine, mean, worst) in
        [(Machine::Servo, 95.0, 80.0), (Machine::TwoMass, 95.0, 90.0), (Machine::NonMinimumPhase, 90.0, 60.0)]
    {
        let flown = machines::learned(machine, 30, 1).unwrap();
        let row = Row::of_machine(machine, 1, &flown);
        println!("{machine:?}: {:.1} / {:.1} %, first {:.1?}", row.reduction_mean, row.reduction_worst, row.first_stroke);
        assert!(row.reduction_mean > mean && row.reduction_worst > worst && row.forgotten == 0, "{row:?}");
    }
}
