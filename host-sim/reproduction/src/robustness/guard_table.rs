//! The guard's trips, and the harm until hand-over, as a table.
//!
//! *in* outcomes of flights by kind; *out* findings and words; *never* a time without the number of flights that it is of;
//! *source* none.

use impromptu_firmware::guard::Trips;
use impromptu_report::study::{Asked, Finding, Study};
use impromptu_sim::flights::Loop;

use super::{
    comparison::{by_reason, trips_text},
    draw::{name, slug_of},
    handover::{HARM_FACTOR, HARM_MORE, KINDS, LOST, Outcome, WINDOW_S},
    settings::Settings,
};

const SECTION: &str = "Guard: trips";

/// What is flown and counted, in words.
pub(super) fn explain(study: &mut Study, settings: &Settings) {
    study.note(
        SECTION,
        &format!(
            "{} flights of each kind a loop, three strokes to a hover, each with both lanes and without the add-on under the \
             same seed (drawn from seed {}). What differs is drawn uniformly for each flight. A trip in a nominal flight is a \
             false one.",
            settings.guard_flights, settings.seed
        ),
    );
    study.note(
        SECTION,
        &format!(
            "Harm begins where the RMS error over {WINDOW_S} s is more than {HARM_FACTOR} times the baseline's and {} cm more. \
             It is over with the hand-over: nothing of the feedback lane acts any more, or a lane trips; where that was so \
             before, the time is 0. The harm until then is the largest RMS error over {WINDOW_S} s less the baseline's. Only the \
             first harm of a flight counts; where there is no hand-over after it, the rest of the flight does. Where the \
             baseline is more than {LOST} m off, it is lost, and no harm is counted.",
            100.0 * HARM_MORE
        ),
    );
}

/// Adds the outcomes of each of [`KINDS`].
pub(super) fn tell(study: &mut Study, closed_loop: &Loop, flown: &[Vec<Outcome>]) {
    let (slug, loop_name) = (slug_of(closed_loop), name(closed_loop));
    for (kind, outcomes) in KINDS.iter().zip(flown) {
        let healthy = kind.name == KINDS[0].name;
        let mut find = |name: &str, what: &str, value: f64, unit: &str| {
            let text = format!("{loop_name}, {}: {what}", kind.what);
            let found = Finding::new(SECTION, &format!("{slug}_guard_{}_{name}", kind.name), &[], &text, value, unit);
            let found = found.cell(&loop_name, kind.what, what);
            study.find(if healthy && name.ends_with("_trips") { found.asked(Asked::AtMost(0.0)) } else { found });
        };
        let by_lane = |lane: usize| outcomes.iter().map(|outcome| f64::from(outcome.trips.by_lane()[lane])).sum::<f64>();
        let tripped = outcomes.iter().filter(|outcome| outcome.trips != Trips::NONE).count();
        let lost = outcomes.iter().filter(|outcome| outcome.lost).count();
        let harms: Vec<_> = outcomes.iter().filter_map(|outcome| outcome.harm).collect();
        let times: Vec<f64> = harms.iter().filter_map(|harm| harm.until_handover).collect();
        let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        find("flights", "flights", outcomes.len() as f64, "");
        find("network_trips", "trips of the network lane", by_lane(0), "");
        find("feedback_trips", "trips of the feedback lane", by_lane(1), "");
        find("tripped", "flights with trips", tripped as f64, "");
        find("lost", "flights in which the baseline is lost", lost as f64, "");
        find("harmed", "flights with harm", harms.len() as f64, "");
        find("handed_over", "of them handed over", times.len() as f64, "");
        if !times.is_empty() {
            find("handover_mean", "to hand-over, mean", times.iter().sum::<f64>() / times.len() as f64, "s");
            find("handover_worst", "to hand-over, worst", worst(&mut times.iter().copied()), "s");
        }
        if !harms.is_empty() {
            find("harm", "harm until then, worst", 100.0 * worst(&mut harms.iter().map(|harm| harm.largest)), "cm");
        }
        let reasons = trips_text(&by_reason(outcomes.iter().map(|outcome| &outcome.trips)));
        if !reasons.is_empty() {
            study.note(SECTION, &format!("{loop_name}, {}: trips of both lanes together: {reasons}.", kind.what));
        }
    }
}
