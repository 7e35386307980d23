//! Progress on stderr: a bar with the time left, or plain lines where stderr is no terminal.

use std::{
    io::{IsTerminal as _, Write as _},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use impromptu_files::text::line;
use impromptu_training::observer::Observer;
use indicatif::{ProgressBar, ProgressStyle};

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Where progress and messages go.
#[derive(Clone)]
pub(super) struct Console {
    quiet: bool,
    bar: Option<ProgressBar>,
    stage: Arc<Mutex<Stage>>,
}

struct Stage {
    name: String,
    line: Instant,
}

impl Console {
    /// `quiet`: nothing but errors.
    pub(super) fn new(quiet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let style = ProgressStyle::with_template("{wide_bar} {pos}/{len}, {elapsed} gone, {eta} left");
            ProgressBar::no_length().with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self { quiet, bar, stage: Arc::new(Mutex::new(Stage { name: String::new(), line: Instant::now() })) }
    }

    /// A message, unless quiet.
    pub(super) fn note(&self, text: &str) {
        if self.quiet {
            return;
        }
        let print = || {
            // A closed stderr is no reason to stop.
            let _ = writeln!(std::io::stderr(), "{}", line(text));
        };
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Observer for Console {
    fn stage(&self, text: &str) {
        self.note(text);
        if let Ok(mut stage) = self.stage.lock() {
            *stage = Stage { name: text.to_owned(), line: Instant::now() };
        }
    }

    fn steps(&self, done: u64, of: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(of);
            bar.set_position(done);
            return;
        }
        let Ok(mut stage) = self.stage.lock() else { return };
        if stage.line.elapsed() >= LINE_INTERVAL {
            stage.line = Instant::now();
            self.note(&format!("{}: {done} of {of}", stage.name));
        }
    }
}
