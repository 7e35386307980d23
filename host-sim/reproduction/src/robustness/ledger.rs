//! The file of a Monte Carlo run: a header and a line for each draw, as JSON.
//!
//! *in* draws as they are flown, files of shards; *out* a file that a later run goes on with, and one file of all shards; *never*
//! draws of different settings or seeds in one file, or a name from a file that leads out of a folder, and merged shards differ
//! in no byte from a single run; *source* JSON Lines.

mod error;

use std::{
    fs::{File, OpenOptions},
    io::{BufWriter, ErrorKind, Write as _},
    ops::Range,
    path::{Path, PathBuf},
    str::FromStr,
};

use impromptu_files::{
    name::{NameError, plain},
    place, reading,
};
use serde::{Deserialize, Serialize};

use super::draw::{Draw, DrawSettings, slug};
pub use error::LedgerError;

/// Most parts of a run.
const MOST_PARTS: u32 = 100_000;

/// One of `of` parts of a run, from 1: draws `part - 1`, `part - 1 + of`, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which part, from 1.
    pub part: u32,
    /// Of how many.
    pub of: u32,
}

impl Shard {
    /// The whole run.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Numbers of its draws out of `draws`.
    pub fn draws(self, draws: u32) -> std::iter::StepBy<Range<u32>> {
        (self.part - 1..draws).step_by(self.of as usize)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if (1..=of).contains(&part) && of <= MOST_PARTS => Ok(Self { part, of }),
            _ => Err(format!("expected a part and how many there are, from 1/1 on, as 3/16, at most {MOST_PARTS}")),
        }
    }
}

/// First line of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// What is drawn and flown.
    pub settings: DrawSettings,
    /// Which part of it is in the file.
    pub shard: Shard,
}

fn at(file: &Path) -> impl Fn(std::io::Error) -> LedgerError {
    move |source| LedgerError::File { file: file.to_owned(), source }
}

/// A line of a file. These values are always representable.
fn line(value: &impl Serialize) -> Result<String, std::io::Error> {
    Ok(serde_json::to_string(value)? + "\n")
}

/// A file that draws are appended to.
#[derive(Debug)]
pub struct Ledger {
    path: PathBuf,
    file: BufWriter<File>,
    draws: usize,
}

impl Ledger {
    /// Opens a file, or makes it, and drops a last line that was cut.
    ///
    /// # Errors
    /// If it is of other settings, of another part, or damaged before its last line.
    pub fn resume(path: &Path, header: &Header) -> Result<Self, LedgerError> {
        place::check(path).map_err(at(path))?;
        let first = line(header).map_err(at(path))?;
        let bytes = match reading::read(path, reading::TABLE) {
            Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
            read => read.map_err(at(path))?,
        };
        let (kept, draws) = if first.as_bytes().starts_with(&bytes) && bytes.len() < first.len() {
            (0, 0)
        } else {
            let content = Content::of(path, &bytes)?;
            content.header.expect(header, path)?;
            (content.whole, content.lines.len())
        };
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(path).map_err(at(path))?;
        file.set_len(kept as u64).map_err(at(path))?;
        let mut ledger = Self { path: path.to_owned(), file: BufWriter::new(file), draws };
        std::io::Seek::seek(&mut ledger.file, std::io::SeekFrom::End(0)).map_err(at(path))?;
        if kept == 0 {
            ledger.file.write_all(first.as_bytes()).and_then(|()| ledger.file.flush()).map_err(at(path))?;
        }
        Ok(ledger)
    }

    /// Draws in the file.
    pub fn len(&self) -> usize {
        self.draws
    }

    /// Whether the file holds no draw.
    pub fn is_empty(&self) -> bool {
        self.draws == 0
    }

    /// Appends a draw.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn append(&mut self, draw: &Draw) -> Result<(), LedgerError> {
        let line = line(draw).map_err(at(&self.path))?;
        self.file.write_all(line.as_bytes()).map_err(at(&self.path))?;
        self.draws += 1;
        Ok(())
    }

    /// Hands everything to the operating system.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> Result<(), LedgerError> {
        self.file.flush().map_err(at(&self.path))
    }
}

impl Header {
    /// Name of the run's file, without its ending.
    ///
    /// # Errors
    /// If the loop in it is called such that no file can be.
    pub fn name(&self) -> Result<String, NameError> {
        let whole = format!("draws-{}", slug(&self.settings.nominal));
        let name = match self.shard {
            Shard::WHOLE => whole,
            Shard { part, of } => format!("{whole}-{part}-of-{of}"),
        };
        plain(&name).map(str::to_owned)
    }

    /// Nothing if a file's header is the one wanted, else the first key that differs.
    fn expect(&self, wanted: &Self, file: &Path) -> Result<(), LedgerError> {
        let differs = |key: &str, found: String, wanted: String| LedgerError::Settings {
            file: file.to_owned(),
            key: key.into(),
            found,
            wanted,
        };
        let values = |header: &Self| serde_json::to_value(&header.settings).unwrap_or_default();
        let (found, expected) = (values(self), values(wanted));
        for (key, value) in expected.as_object().into_iter().flatten() {
            if found.get(key) != Some(value) {
                return Err(differs(key, found.get(key).map(ToString::to_string).unwrap_or_default(), value.to_string()));
            }
        }
        let text = |shard: Shard| format!("{}/{}", shard.part, shard.of);
        if self.shard != wanted.shard {
            return Err(differs("shard", text(self.shard), text(wanted.shard)));
        }
        Ok(())
    }
}

/// What a file holds.
#[derive(Debug)]
pub struct Content {
    /// First line.
    pub header: Header,
    /// Draws, in their order.
    pub draws: Vec<Draw>,
    lines: Vec<String>,
    /// Bytes up to the end of the last whole line.
    whole: usize,
}

impl Content {
    /// Reads a file; a last line that was cut is left out.
    ///
    /// # Errors
    /// If it cannot be read or is damaged before its last line.
    pub fn read(path: &Path) -> Result<Self, LedgerError> {
        Self::of(path, &reading::read(path, reading::TABLE).map_err(at(path))?)
    }

    fn of(path: &Path, bytes: &[u8]) -> Result<Self, LedgerError> {
        let damaged =
            |line: usize, reason: &dyn ToString| LedgerError::Damaged { file: path.to_owned(), line, reason: reason.to_string() };
        let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
        let text = std::str::from_utf8(&bytes[..whole]).map_err(|error| damaged(1, &error))?;
        let mut lines = text.lines();
        let header: Header = match lines.next() {
            Some(first) => serde_json::from_str(first).map_err(|error| damaged(1, &error))?,
            None => return Err(damaged(1, &"there is no header")),
        };
        header.name().map_err(|error| damaged(1, &format!("`nominal`: {error}")))?;
        if let Some(fault) = header.settings.ranges.fault() {
            return Err(damaged(1, &fault));
        }
        let Shard { part, of } = header.shard;
        if !(1..=of).contains(&part) || of > MOST_PARTS {
            return Err(damaged(1, &format!("there is no part {part} of {of}")));
        }
        let (mut draws, mut kept) = (Vec::new(), Vec::new());
        let mut numbers = header.shard.draws(header.settings.draws);
        for (number, text) in (2..).zip(lines) {
            let draw: Draw = serde_json::from_str(text).map_err(|error| damaged(number, &error))?;
            match numbers.next() {
                Some(expected) if expected == draw.draw => {}
                Some(expected) => return Err(damaged(number, &format!("draw {expected} is expected, {} found", draw.draw))),
                None => return Err(damaged(number, &format!("draw {} is one too many", draw.draw))),
            }
            draws.push(draw);
            kept.push(text.to_owned());
        }
        Ok(Self { header, draws, lines: kept, whole })
    }
}

/// Merges the files of all parts of a run: the bytes of the file that a single run writes, and what is in it.
///
/// # Errors
/// Files of different runs, parts that are there twice, not at all or not to their end.
pub fn merge(paths: &[PathBuf]) -> Result<(Vec<u8>, Content), LedgerError> {
    let mut parts: Vec<(PathBuf, Content)> = Vec::new();
    for path in paths {
        let content = Content::read(path)?;
        if let Some((_, first)) = parts.first() {
            let shard = Shard { of: first.header.shard.of, ..content.header.shard };
            content.header.expect(&Header { settings: first.header.settings.clone(), shard }, path)?;
        }
        let part = content.header.shard.part;
        if let Some((first, _)) = parts.iter().find(|(_, other)| other.header.shard.part == part) {
            return Err(LedgerError::Duplicate { part, first: first.clone(), second: path.clone() });
        }
        parts.push((path.clone(), content));
    }
    let Some(Header { settings, shard }) = parts.first().map(|(_, content)| content.header.clone()) else {
        return Err(LedgerError::Nothing);
    };
    let missing: Vec<String> = (1..=shard.of)
        .filter(|part| !parts.iter().any(|(_, content)| content.header.shard.part == *part))
        .map(|part| part.to_string())
        .collect();
    if !missing.is_empty() {
        return Err(LedgerError::Missing { of: shard.of, missing: missing.join(", ") });
    }
    let mut rows: Vec<(Draw, String)> = Vec::new();
    for (path, content) in parts {
        let Shard { part, of } = content.header.shard;
        let (found, wanted) = (content.draws.len(), content.header.shard.draws(settings.draws).count());
        if found < wanted {
            return Err(LedgerError::Incomplete { file: path, part, of, found, wanted });
        }
        rows.extend(content.draws.into_iter().zip(content.lines));
    }
    rows.sort_by_key(|(draw, _)| draw.draw);
    let header = Header { settings, shard: Shard::WHOLE };
    let mut text = line(&header).map_err(at(Path::new("merged")))?;
    let (draws, lines): (Vec<Draw>, Vec<String>) = rows.into_iter().unzip();
    for row in &lines {
        text.push_str(row);
        text.push('\n');
    }
    let whole = text.len();
    Ok((text.into_bytes(), Content { header, draws, lines, whole }))
}
