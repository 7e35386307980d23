//! Files that are written as a whole or not at all, one or a set.
//!
//! *in* places and bytes; *out* the bytes there, with the mode, owner and links that were there; *never* a half-written file, a
//! replaced device, a set of which some files are old and some are new after an error, Ctrl-C or SIGTERM. After SIGKILL or a
//! power cut between two renames a set can be mixed: whoever reads one ties its files together. *source* rename(2): a name goes
//! from one file to another in one step.

use std::{
    fmt, io,
    io::Write as _,
    path::{Path, PathBuf},
};

use tempfile::TempPath;

use crate::{
    interruption::{Held, hold},
    place::{Place, folder_of},
};

/// Which file of a set cannot be written, and why.
#[derive(Debug)]
pub struct ReplaceError {
    /// The file, as it was given.
    pub file: PathBuf,
    /// Why.
    pub source: io::Error,
}

impl fmt::Display for ReplaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: cannot be written", self.file.display())
    }
}

impl std::error::Error for ReplaceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.source)
    }
}

/// Writes `bytes` beside `path`, where they then take the place of what is there. A link stays, what it leads to is replaced; an
/// existing file keeps its mode and, where the system lets us, its owner. If anything fails, what was there stays.
///
/// # Errors
/// If the folder does not exist or cannot be written, or if something is there that is no regular file.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_all(&[(path, bytes)]).map_err(|error| error.source)
}

/// Writes a set of files: all are staged first, then they take their places in the order given, so that the last one tells
/// that the set is whole. If one cannot, those before it are given back what they were.
///
/// # Errors
/// Names the file that cannot be written.
pub fn replace_all(files: &[(impl AsRef<Path>, impl AsRef<[u8]>)]) -> Result<(), ReplaceError> {
    let mut staged: Vec<Staged> = Vec::new();
    let outcome = files.iter().try_for_each(|(path, bytes)| {
        let path = path.as_ref();
        let staged_here = Staged::new(path, bytes.as_ref());
        staged.extend(staged_here.map_err(|source| ReplaceError { file: path.to_owned(), source })?);
        Ok(())
    });
    // From here on an interruption waits.
    let mut held = hold();
    let outcome = outcome.and_then(|()| commit(&mut staged));
    for file in staged {
        file.forget(&mut held);
    }
    outcome
}

/// A file beside its place.
struct Staged {
    given: PathBuf,
    place: PathBuf,
    new: Option<TempPath>,
    /// Another name of what is there, to give it back.
    old: Option<PathBuf>,
    temporary: Vec<PathBuf>,
}

/// The staged files take their places, or none does.
fn commit(staged: &mut [Staged]) -> Result<(), ReplaceError> {
    for index in 0..staged.len() {
        let file = &mut staged[index];
        let Some(new) = file.new.take() else { continue };
        if let Err(error) = new.persist(&file.place) {
            let (file, source) = (file.given.clone(), error.error);
            for before in &staged[..index] {
                // What was not there is taken away again; nothing more can be done where that fails.
                let _ = match &before.old {
                    Some(old) => std::fs::rename(old, &before.place),
                    None => std::fs::remove_file(&before.place),
                };
            }
            return Err(ReplaceError { file, source });
        }
    }
    Ok(())
}

impl Staged {
    /// Writes the bytes beside their place, or into a stream, which leaves nothing to be staged.
    fn new(path: &Path, bytes: &[u8]) -> io::Result<Option<Self>> {
        let (place, found) = match Place::of(path)? {
            Place::Stream(stream) => return pour(&stream, bytes).map(|()| None),
            Place::File(place, found) => (place, found),
        };
        let mut builder = tempfile::Builder::new();
        // Hidden, and with an ending that no command reads: what a power cut leaves does no harm.
        builder.prefix(".impromptu-").suffix(".tmp");
        #[cfg(unix)]
        {
            // As any new file, within the user's mask; a temporary file would be readable by its owner only.
            use std::os::unix::fs::PermissionsExt as _;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let (mut file, new) = {
            let mut held = hold();
            let new = builder.tempfile_in(folder_of(&place))?;
            held.add(new.path());
            new.into_parts()
        };
        let mut staged = Self { given: path.to_owned(), place, temporary: vec![new.to_path_buf()], new: Some(new), old: None };
        let written = file.write_all(bytes).and_then(|()| keep(&file, found.as_ref())).and_then(|()| file.sync_all());
        if let Err(error) = written {
            staged.forget(&mut hold());
            return Err(error);
        }
        if found.is_some() {
            staged.old = staged.second_name();
        }
        Ok(Some(staged))
    }

    /// A second name for what is there; none where the file system knows no hard links.
    fn second_name(&mut self) -> Option<PathBuf> {
        let new = self.new.as_ref()?;
        let old = new.with_extension("old");
        let mut held = hold();
        std::fs::hard_link(&self.place, &old).ok()?;
        held.add(&old);
        self.temporary.push(old.clone());
        Some(old)
    }

    /// Removes what is temporary.
    fn forget(self, held: &mut Held) {
        drop(self.new);
        if let Some(old) = &self.old {
            let _ = std::fs::remove_file(old);
        }
        self.temporary.iter().for_each(|path| held.remove(path));
    }
}

/// Mode and owner of what is replaced.
fn keep(file: &std::fs::File, found: Option<&std::fs::Metadata>) -> io::Result<()> {
    let Some(found) = found else { return Ok(()) };
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        // Only root may give files away; whoever may write here may replace as well.
        let _ = fchown(file, Some(found.uid()), Some(found.gid()));
    }
    file.set_permissions(found.permissions())
}

/// Writes to a stream of the program as it is.
fn pour(stream: &Path, bytes: &[u8]) -> io::Result<()> {
    let write = |out: &mut dyn io::Write| out.write_all(bytes).and_then(|()| out.flush());
    match stream.to_str() {
        Some("/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1") => write(&mut io::stdout().lock()),
        Some("/dev/stderr" | "/dev/fd/2" | "/proc/self/fd/2") => write(&mut io::stderr().lock()),
        _ => write(&mut std::fs::OpenOptions::new().append(true).open(stream)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_or_leaves_alone_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        replace(&path, b"one").unwrap();
        replace(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        let occupied = folder.path().join("folder");
        std::fs::create_dir_all(occupied.join("inside")).unwrap();
        assert!(replace(&occupied, b"three").is_err());
        assert!(replace(&folder.path().join("absent").join("file"), b"four").is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_set_is_all_old_or_all_new() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        replace_all(&[(path("a"), "1"), (path("b"), "1")]).unwrap();
        std::fs::create_dir(path("c")).unwrap();
        let error = replace_all(&[(path("a"), "2"), (path("b"), "2"), (path("c"), "2")]).unwrap_err();
        assert_eq!(error.file, path("c"));
        assert_eq!((std::fs::read(path("a")).unwrap(), std::fs::read(path("b")).unwrap()), (b"1".to_vec(), b"1".to_vec()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    /// The last rename of a set fails after the others went well: they are given back.
    #[test]
    fn a_failure_at_the_very_end_gives_back_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        replace(&path("a"), b"1").unwrap();
        let mut staged: Vec<Staged> =
            ["a", "new", "late"].iter().filter_map(|name| Staged::new(&path(name), b"2").unwrap()).collect();
        std::fs::create_dir_all(path("late").join("inside")).unwrap();
        assert_eq!(commit(&mut staged).unwrap_err().file, path("late"));
        staged.into_iter().for_each(|file| file.forget(&mut hold()));
        assert_eq!(std::fs::read(path("a")).unwrap(), b"1");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "a and the folder");
    }

    #[cfg(unix)]
    #[test]
    fn mode_and_links_stay() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("elsewhere")).unwrap();
        std::fs::write(path("elsewhere/target"), "old").unwrap();
        std::fs::set_permissions(path("elsewhere/target"), std::fs::Permissions::from_mode(0o640)).unwrap();
        symlink("elsewhere/target", path("link")).unwrap();
        symlink("link", path("twice")).unwrap();
        replace(&path("twice"), b"new").unwrap();
        assert_eq!(std::fs::read(path("elsewhere/target")).unwrap(), b"new");
        assert_eq!(std::fs::metadata(path("elsewhere/target")).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(std::fs::symlink_metadata(path("link")).unwrap().is_symlink());
        assert!(std::fs::symlink_metadata(path("twice")).unwrap().is_symlink());
        std::fs::set_permissions(path("elsewhere/target"), std::fs::Permissions::from_mode(0o440)).unwrap();
        assert_eq!(replace(&path("link"), b"no").unwrap_err().kind(), io::ErrorKind::PermissionDenied);
        // A link to what is not there yet makes it, and stays a link.
        symlink("elsewhere/made", path("dangling")).unwrap();
        replace(&path("dangling"), b"made").unwrap();
        assert_eq!(std::fs::read(path("elsewhere/made")).unwrap(), b"made");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_stays_what_it_is() {
        use std::os::unix::fs::FileTypeExt as _;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(replace(&pipe, b"x").unwrap_err().to_string().contains("no regular file"));
        assert!(std::fs::metadata(&pipe).unwrap().file_type().is_fifo());
        replace(Path::new("/dev/null"), b"x").unwrap();
        assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }
}
