//! The structure of the crates' sources: which file uses which, and whether that runs the way the crate's first page states.
//!
//! *in* the sources below a `src/lib.rs`; *out* arrows from file to file, circles, arrows against the stated order; *never* test
//! code, or a re-export taken for a use; *source* `use` declarations and paths, read with `syn`. A name that another file merely
//! hands on counts as an arrow to the file that defines it.
//!
//! The order stands in the documentation of each crate's root, as rows of a table:
//! `| 1 | ``math``, ``preview`` | what they hold |`, with single back ticks, the lowest layer first. A module uses lower layers
//! only, or itself.

mod module;
mod resolve;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use anyhow::{Context as _, Result};
use petgraph::{algo::tarjan_scc, graphmap::DiGraphMap};

use module::Module;

/// A crate's files and the arrows between them.
#[derive(Debug)]
pub struct Structure {
    root: Module,
    /// Names of files, as paths of modules.
    files: Vec<String>,
    /// From file to file, with the names used.
    arrows: BTreeMap<(usize, usize), BTreeSet<String>>,
}

impl Structure {
    /// Reads the crate whose root is `lib`.
    ///
    /// # Errors
    /// If a file cannot be read or is not Rust.
    pub fn read(lib: &Path) -> Result<Self> {
        let root = Module::read(lib, "crate")?;
        let mut files = Vec::new();
        root.each(&mut |module| files.push(module.path.clone()));
        let mut arrows: BTreeMap<(usize, usize), BTreeSet<String>> = BTreeMap::new();
        for (from, name) in files.iter().enumerate() {
            for used in &root.find(name).context("a file that was listed")?.uses {
                let Some(target) = resolve::file_of(&root, name, used) else { continue };
                let Some(to) = files.iter().position(|file| *file == target).filter(|to| *to != from) else { continue };
                arrows.entry((from, to)).or_default().insert(used.join("::"));
            }
        }
        Ok(Self { root, files, arrows })
    }

    /// Circles of files, each with its arrows: `a -> b (names)`.
    pub fn circles(&self) -> Vec<String> {
        let graph: DiGraphMap<usize, ()> = self.arrows.keys().map(|&(from, to)| (from, to, ())).collect();
        let circles = tarjan_scc(&graph).into_iter().filter(|circle| circle.len() > 1);
        circles
            .map(|circle| {
                let inside = self.arrows.iter().filter(|((from, to), _)| circle.contains(from) && circle.contains(to));
                inside.map(|(ends, names)| self.arrow(*ends, names)).collect::<Vec<_>>().join("\n  ")
            })
            .collect()
    }

    /// Layers that the root's documentation states, the lowest first; rows with the same number are one layer.
    pub fn layers(&self) -> Vec<Vec<String>> {
        let mut layers: BTreeMap<usize, Vec<String>> = BTreeMap::new();
        for line in self.root.documentation.lines() {
            let Some(row) = line.trim().strip_prefix('|') else { continue };
            let mut cells = row.split('|').map(str::trim);
            if let (Some(Ok(number)), Some(names)) = (cells.next().map(str::parse), cells.next()) {
                layers.entry(number).or_default().extend(names.split(',').map(|name| name.trim().trim_matches('`').to_owned()));
            }
        }
        layers.into_values().collect()
    }

    /// What contradicts the stated layers: modules that are missing or listed twice, arrows that do not run downwards.
    pub fn contradictions(&self) -> Vec<String> {
        let layers = self.layers();
        let mut found = Vec::new();
        let modules = self.root.children.iter().map(|module| module.name());
        for module in modules {
            let times = layers.iter().flatten().filter(|name| *name == module).count();
            if times != 1 {
                found.push(format!("module {module} stands in {times} layers of the crate's first page, not in one"));
            }
        }
        for name in layers.iter().flatten().filter(|name| !self.root.children.iter().any(|module| module.name() == **name)) {
            found.push(format!("the crate's first page lists {name}, which is no module"));
        }
        let height = |file: usize| {
            let top = self.files[file].split("::").nth(1)?;
            Some((layers.iter().position(|layer| layer.iter().any(|name| name == top))?, top))
        };
        for (&(from, to), names) in &self.arrows {
            if let (Some((from_layer, from_top)), Some((to_layer, to_top))) = (height(from), height(to))
                && from_top != to_top
                && to_layer >= from_layer
            {
                found.push(self.arrow((from, to), names));
            }
            // The root stands above all: nothing inside uses what is defined there.
            if to == 0 {
                found.push(self.arrow((from, to), names));
            }
        }
        found
    }

    fn arrow(&self, (from, to): (usize, usize), names: &BTreeSet<String>) -> String {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        format!("{} -> {} ({})", self.files[from], self.files[to], names.join(", "))
    }
}

/// Roots of the workspace's library crates below `top`, by the members in its Cargo.toml.
///
/// # Errors
/// If the manifest cannot be read.
pub fn libraries(top: &Path) -> Result<Vec<std::path::PathBuf>> {
    let manifest: toml::Table = toml::from_str(&fs::read_to_string(top.join("Cargo.toml"))?)?;
    let members = manifest.get("workspace").and_then(|workspace| workspace.get("members")).and_then(toml::Value::as_array);
    let members = members.context("the workspace has no list of members")?;
    let roots = members.iter().filter_map(toml::Value::as_str).map(|member| top.join(member).join("src/lib.rs"));
    Ok(roots.filter(|root| root.exists()).collect())
}
