//! Prototype.
use impromptu_host_sim::{experiment::demo::*, report};
struct Quiet;
impl Observer for Quiet {
    fn stage(&self, text: &str) {
        eprintln!("{text}");
    }
    fn steps(&self, _: u64, _: u64) {}
}
fn main() -> anyhow::Result<()> {
    let text = std::env::args().nth(1).unwrap_or_default();
    let mut settings: DemoSettings = toml::from_str(&text)?;
    settings.out = Some("/tmp/out".into());
    let results = run(&settings, &Quiet)?;
    println!("{}", report::console_table(&results));
    for m in &results.models {
        println!("{m:?}");
    }
    println!("{:?}", results.timings);
    std::fs::write("/tmp/out/results.json", results.to_json()?)?;
    report::write_html(&results, std::path::Path::new("/tmp/out/report.html"))
}
