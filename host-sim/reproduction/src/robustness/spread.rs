//! The Monte Carlo run in numbers and as distributions.
//!
//! *in* draws; *out* findings and figures; *never* a mean without the worst beside it; *source* none.

use impromptu_report::{
    Axis, Curve, Figure,
    study::{Finding, Study},
};

use super::{draw::Draw, ledger::Content};

/// Section of the report.
pub const SECTION: &str = "Monte Carlo over vehicles";
/// Quantiles that are told: name, words, share of the draws that are worse.
const QUANTILES: [(&str, &str, f64); 3] = [
    ("median", "median vehicle", 0.5),
    ("tenth", "a tenth of the vehicles is worse", 0.1),
    ("hundredth", "a hundredth is worse", 0.01),
];

/// Lanes that fly, in names and in words, and their errors.
type Way = (&'static str, &'static str, fn(&Draw) -> &[Option<f64>]);

/// Adds what a run found to a study; `slug` begins the names.
pub fn tell(study: &mut Study, slug: &str, content: &Content) {
    let settings = &content.header.settings;
    let ways: [Way; 2] = [("network", "network lane alone", |draw| &draw.network), ("both", "both lanes", |draw| &draw.both)];
    let mut curves = Vec::new();
    for (way, words, errors) in ways {
        let flights: Vec<Vec<f64>> = content.draws.iter().map(|draw| draw.reductions(errors(draw))).collect();
        let mut means: Vec<f64> = flights
            .iter()
            .filter(|flights| !flights.is_empty())
            .map(|flights| flights.iter().sum::<f64>() / flights.len() as f64)
            .collect();
        means.sort_by(f64::total_cmp);
        let all: Vec<f64> = flights.into_iter().flatten().collect();
        if means.is_empty() {
            continue;
        }
        let mut find = |name: &str, what: &str, value: f64| {
            let text = format!("{}: reduction, {words}, {what}", settings.nominal);
            let found = Finding::new(SECTION, &format!("{slug}_draws_{way}_{name}"), &[], &text, value, "%");
            study.find(found.cell(&settings.nominal, words, what));
        };
        find("mean", &format!("mean of {} vehicles", means.len()), means.iter().sum::<f64>() / means.len() as f64);
        for (name, what, share) in QUANTILES {
            // The draw of that rank; the worst one where there are too few.
            find(name, what, means[((means.len() as f64 * share) as usize).min(means.len() - 1)]);
        }
        find("worst_vehicle", "worst vehicle", means[0]);
        find("worst_flight", "worst flight of any vehicle", all.iter().copied().fold(f64::INFINITY, f64::min));
        let worse = all.iter().filter(|reduction| **reduction < 0.0).count();
        let share = 100.0 * worse as f64 / all.len().max(1) as f64;
        find("harmed", "share of the flights that were worse than the baseline", share);
        let of = means.len() as f64;
        curves.push(Curve::line(words, means.iter().enumerate().map(|(rank, mean)| (*mean, (rank as f64 + 0.5) / of))));
    }
    let flights: usize = content.draws.iter().map(|draw| draw.both.len()).sum();
    let tripped: u32 = content.draws.iter().map(|draw| draw.tripped).sum();
    study.find(
        Finding::new(
            SECTION,
            &format!("{slug}_draws_tripped"),
            &[],
            &format!("{}: share of the flights with both lanes in which the guard tripped a lane", settings.nominal),
            100.0 * f64::from(tripped) / flights.max(1) as f64,
            "%",
        )
        .cell(&settings.nominal, "both lanes", "flights in which the guard tripped a lane"),
    );
    study.draw(Figure {
        section: SECTION.into(),
        name: format!("{slug}_draws"),
        title: format!("{}: share of the vehicles with a smaller mean reduction", settings.nominal),
        x: Axis::linear("mean reduction [%]"),
        y: Axis::linear("share of vehicles"),
        curves,
    });
}
