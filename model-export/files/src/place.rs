//! What stands where a file shall be written.
//!
//! *in* the path that somebody gave; *out* the regular file, new or there, that it leads to; *never* a folder, pipe, socket or
//! device in whose place a file would be put, a link that would be replaced, or a file that may not be written; *source* POSIX.

use std::{
    fs::Metadata,
    io,
    path::{Path, PathBuf},
};

/// Links that lead to a place at most, as in Linux.
const LINKS: usize = 40;

/// Where bytes go.
#[derive(Debug)]
pub(crate) enum Place {
    /// A regular file, at the end of all links; what is there, if it is.
    File(PathBuf, Option<Metadata>),
    /// A stream that the program was started with, or nowhere: written to as it is.
    Stream(PathBuf),
}

fn refused(text: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, text.into())
}

/// Streams by name: what comes with `2>…`, `>(…)`, or goes nowhere.
fn is_stream(path: &Path) -> bool {
    ["/dev/stdout", "/dev/stderr", "/dev/null"].iter().any(|stream| path == Path::new(stream))
        || [Path::new("/dev/fd"), Path::new("/proc/self/fd")].iter().any(|folder| path.parent() == Some(folder))
}

impl Place {
    /// Follows the links of a path and looks at what is there.
    ///
    /// # Errors
    /// If that is no regular file, may not be written, or cannot be looked at.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let mut path = path.to_owned();
        for _ in 0..LINKS {
            if cfg!(unix) && is_stream(&path) {
                return Ok(Self::Stream(path));
            }
            match std::fs::symlink_metadata(&path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::File(path, None)),
                Err(error) => return Err(error),
                Ok(found) if found.is_symlink() => {
                    let target = std::fs::read_link(&path)?;
                    path = folder_of(&path).join(target);
                }
                Ok(found) if found.is_dir() => return Err(refused("is a folder, give a file")),
                Ok(found) if !found.is_file() => {
                    return Err(refused("is no regular file (a device, pipe or socket), and is left alone; give another file"));
                }
                Ok(found) if found.permissions().readonly() => {
                    return Err(io::Error::new(io::ErrorKind::PermissionDenied, "may not be written (read only)"));
                }
                Ok(found) => return Ok(Self::File(path, Some(found))),
            }
        }
        Err(refused("leads through more than 40 links"))
    }
}

/// The folder that a path is in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether a file can be put there at all: asked before minutes of work, so that a slip costs none.
///
/// # Errors
/// Why not.
pub fn check(path: &Path) -> io::Result<()> {
    match Place::of(path)? {
        Place::Stream(_) => Ok(()),
        Place::File(file, _) if folder_of(&file).is_dir() => Ok(()),
        Place::File(file, _) => Err(refused(format!("there is no folder {}", folder_of(&file).display()))),
    }
}

/// Whether two paths lead to one file, also by links, hard ones or others; a file that is not there yet is told by its folder.
pub fn same(one: &Path, other: &Path) -> bool {
    let found = |path: &Path| std::fs::metadata(path).ok();
    match (found(one), found(other)) {
        (Some(first), Some(second)) => same_file(one, &first, other, &second),
        (None, None) => {
            let place = |path: &Path| {
                let Ok(Place::File(path, _)) = Place::of(path) else { return None };
                Some((folder_of(&path).canonicalize().ok()?, path.file_name()?.to_owned()))
            };
            place(one).is_some_and(|one| Some(one) == place(other))
        }
        _ => false,
    }
}

#[cfg(unix)]
fn same_file(_: &Path, one: &Metadata, _: &Path, other: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

#[cfg(not(unix))]
fn same_file(one: &Path, _: &Metadata, other: &Path, _: &Metadata) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// Refuses an output that is one of the inputs, under whatever name. Streams are no files and may be both.
///
/// # Errors
/// Names both.
pub fn apart(output: &Path, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> io::Result<()> {
    if std::fs::metadata(output).is_ok_and(|found| !found.is_file()) {
        return Ok(());
    }
    match inputs.into_iter().find(|input| same(output, input.as_ref())) {
        Some(input) => {
            Err(refused(format!("is the same file as the input {}; give another place for the output", input.as_ref().display())))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    #[test]
    fn one_file_under_two_names_is_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("a"), "a").unwrap();
        std::fs::write(path("b"), "a").unwrap();
        std::fs::hard_link(path("a"), path("hard")).unwrap();
        std::os::unix::fs::symlink("a", path("soft")).unwrap();
        std::os::unix::fs::symlink("new", path("dangling")).unwrap();
        for name in ["a", "hard", "soft", "./a"] {
            assert!(same(&path(name), &path("a")) && apart(&path(name), [path("b"), path("a")]).is_err(), "{name}");
        }
        assert!(!same(&path("a"), &path("b")) && !same(&path("a"), &path("new")));
        assert!(same(&path("new"), &path("dangling")));
        assert!(apart(Path::new("/dev/null"), ["/dev/null"]).is_ok());
    }

    #[test]
    fn what_is_no_file_is_refused_and_links_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert!(check(folder.path()).unwrap_err().to_string().contains("is a folder"));
        assert!(check(Path::new("/dev/zero")).unwrap_err().to_string().contains("no regular file"));
        assert!(check(Path::new("/dev/stdout")).is_ok() && check(&path("new")).is_ok());
        assert!(check(&path("absent/file")).unwrap_err().to_string().contains("there is no folder"));
        std::os::unix::fs::symlink("loop", path("loop")).unwrap();
        assert!(check(&path("loop")).unwrap_err().to_string().contains("40 links"));
    }
}
