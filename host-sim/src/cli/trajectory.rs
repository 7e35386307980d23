//! `host-sim trajectory`: trajectories of the catalogue and of files as CSV.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use anyhow::Result;
use clap::Args;
use impromptu_sim::trajectory::{DEFAULT_RATE_HZ, KNOWN_NAMES, Motion, by_name, load};

use super::{Invocation, output, situation::speed};

/// Arguments of `trajectory`.
#[derive(Debug, Args)]
#[command(after_help = "\
The CSV has the columns t (s), x, y, z (m, world frame ENU) and yaw (rad), 100 rows a second, and can be flown again with
`fly --trajectory FILE.csv`. So can a file of polynomial segments (duration,x^0,…,x^7,y^0,…,z^0,…,yaw^0,…,yaw^7).

Examples:
  host-sim trajectory --list
  host-sim trajectory letters:HELLO --speed 1.5 --output hello.csv
  host-sim trajectory segments.csv --output table.csv")]
pub(super) struct TrajectoryCommand {
    /// Name in the catalogue, or a CSV file.
    #[arg(value_name = "NAME|FILE.csv", required_unless_present = "list")]
    trajectory: Option<String>,
    /// Lists the names of the catalogue; capitals are arguments.
    #[arg(long, conflicts_with = "trajectory")]
    list: bool,
    /// Factor on the speed.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed)]
    speed: f64,
    /// CSV file to write; stdout if not given.
    #[arg(long, value_name = "FILE.csv")]
    output: Option<PathBuf>,
}

impl TrajectoryCommand {
    pub(super) fn run(self, invocation: &Invocation) -> Result<()> {
        let Some(name) = self.trajectory else {
            return invocation.format.print(&KNOWN_NAMES, || KNOWN_NAMES.join("\n") + "\n");
        };
        if let Some(file) = &self.output {
            invocation.check_output(file, [Path::new(&name)])?;
        }
        let trajectory = find(&name)?.scaled(self.speed).sampled(DEFAULT_RATE_HZ)?;
        let mut text = String::from("t,x,y,z,yaw\n");
        for (tick, sample) in trajectory.samples[trajectory.scored.clone()].iter().enumerate() {
            let [x, y, z] = sample.position;
            writeln!(text, "{},{x},{y},{z},{}", tick as f64 / trajectory.rate_hz, sample.yaw)?;
        }
        invocation.console.note(&format!(
            "{}: {:.1} s, at most {:.2} m/s and {:.2} m/s^2",
            trajectory.name,
            trajectory.drawn_seconds(),
            trajectory.peak_speed(),
            trajectory.peak_acceleration()
        ));
        match &self.output {
            Some(file) => output::write(file, text.as_bytes()),
            None => output::print(&text),
        }
    }
}

/// The motion of a file, or of a name in the catalogue.
pub(super) fn find(name: &str) -> Result<Motion> {
    let path = Path::new(name);
    let is_file = path.is_file() || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    Ok(if is_file { load(path)? } else { by_name(name)? })
}
