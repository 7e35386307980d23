//! The file that defines what a path names.
//!
//! *in* a module and a path that it uses; *out* the defining file; *never* a file of another crate; *source* Rust's rules for
//! paths, as far as they matter here: `crate`, `self`, `super`, modules, items, names that a `use` brings in.

use super::module::{Import, Module};

/// More steps than any chain of re-exports has: two globs that hand on each other's names would never end.
const DEPTH: usize = 16;

/// The path of the file that defines what `path`, used in the file `from`, names; `None` if it is not of this crate.
pub(super) fn file_of(root: &Module, from: &str, path: &[String]) -> Option<String> {
    resolve(root, from, path, DEPTH)
}

fn resolve(root: &Module, from: &str, path: &[String], depth: usize) -> Option<String> {
    let depth = depth.checked_sub(1)?;
    let mut here = root.find(from)?;
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => (here, rest) = (root, &path[1..]),
        "self" => rest = &path[1..],
        "super" => {}
        // A path in edition 2018 starts with a name of this module, or with a crate.
        first if knows(here, first) => {}
        _ => return None,
    }
    while rest.first().is_some_and(|name| name == "super") {
        here = root.find(here.path.rsplit_once("::")?.0)?;
        rest = &rest[1..];
    }
    let Some((name, after)) = rest.split_first() else { return Some(here.path.clone()) };
    if let Some(child) = here.children.iter().find(|child| child.name() == name) {
        let inside: Vec<String> = std::iter::once("self".to_owned()).chain(after.iter().cloned()).collect();
        return resolve(root, &child.path, &inside, depth);
    }
    if here.defined.contains(name) {
        return Some(here.path.clone());
    }
    // What the module imports by that name, else what it imports whole.
    let whole = |import: &Import, rest: &[String]| import.path.iter().chain(rest).cloned().collect::<Vec<_>>();
    if let Some(import) = here.imports.iter().find(|import| import.brings(name)) {
        return resolve(root, &here.path, &whole(import, after), depth);
    }
    let globs = here.imports.iter().filter(|import| import.name.is_none());
    globs.map(|import| whole(import, rest)).find_map(|path| resolve(root, &here.path, &path, depth))
}

/// Whether a module knows a name by itself.
fn knows(module: &Module, name: &str) -> bool {
    module.children.iter().any(|child| child.name() == name)
        || module.defined.contains(name)
        || module.imports.iter().any(|import| import.brings(name))
}
