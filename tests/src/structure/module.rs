//! One file of a crate: what it defines, hands on and uses.
//!
//! *in* a file; *out* its names and paths; *never* what is compiled for tests alone; *source* the syntax tree.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result};
use syn::{Attribute, Item, Meta, UseTree, Visibility, visit::Visit};

/// A name that a `use` brings into a module.
#[derive(Clone, Debug)]
pub(super) struct Import {
    /// The name here; `None` for all of them.
    pub(super) name: Option<String>,
    /// Where it comes from.
    pub(super) path: Vec<String>,
}

impl Import {
    /// Whether it brings in `name` from somewhere else; `use a::{self}` and `use a` alone lead nowhere.
    pub(super) fn brings(&self, name: &str) -> bool {
        self.name.as_deref() == Some(name) && self.path.first().is_none_or(|first| first != name)
    }
}

/// A file with its modules below it.
#[derive(Debug, Default)]
pub(super) struct Module {
    /// `crate::a::b`.
    pub(super) path: String,
    /// Documentation of the file.
    pub(super) documentation: String,
    /// Files below.
    pub(super) children: Vec<Module>,
    /// Names defined here, modules within the file included.
    pub(super) defined: BTreeSet<String>,
    /// Names that come from elsewhere.
    pub(super) imports: Vec<Import>,
    /// Paths that the code uses, re-exports left out.
    pub(super) uses: BTreeSet<Vec<String>>,
}

impl Module {
    /// Reads a file and those below it.
    pub(super) fn read(file: &Path, path: &str) -> Result<Self> {
        let text = fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        let tree = syn::parse_file(&text).with_context(|| file.display().to_string())?;
        let mut module = Self { path: path.into(), documentation: documentation(&tree.attrs), ..Self::default() };
        for item in tree.items.iter().filter(|item| !is_test(attributes(item))) {
            module.take(item, file)?;
        }
        Ok(module)
    }

    /// The last part of its path.
    pub(super) fn name(&self) -> &str {
        self.path.rsplit("::").next().unwrap_or_default()
    }

    /// Calls `act` with it and every file below it.
    pub(super) fn each(&self, act: &mut dyn FnMut(&Self)) {
        act(self);
        self.children.iter().for_each(|child| child.each(act));
    }

    /// The file of that path.
    pub(super) fn find(&self, path: &str) -> Option<&Self> {
        if self.path == path {
            return Some(self);
        }
        self.children.iter().find_map(|child| child.find(path))
    }

    fn take(&mut self, item: &Item, file: &Path) -> Result<()> {
        match item {
            Item::Mod(inner) if inner.content.is_none() => {
                let name = inner.ident.to_string();
                let child = placed(file, &inner.attrs)
                    .or_else(|| below(file, &name))
                    .with_context(|| format!("module {name} of {} has no file", file.display()))?;
                self.children.push(Self::read(&child, &format!("{}::{name}", self.path))?);
                return Ok(());
            }
            Item::Use(declaration) => {
                let mut found = Vec::new();
                flatten(&declaration.tree, &mut Vec::new(), &mut found);
                if matches!(declaration.vis, Visibility::Inherited) {
                    self.uses.extend(found.iter().map(|import| import.path.clone()));
                }
                self.imports.extend(found);
                return Ok(());
            }
            Item::Impl(_) => {}
            _ => self.defined.extend(name_of(item)),
        }
        let mut paths = Paths(BTreeSet::new());
        paths.visit_item(item);
        self.uses.extend(paths.0);
        Ok(())
    }
}

/// Paths in code that start at the crate or above the module, and `use` declarations within items.
struct Paths(BTreeSet<Vec<String>>);

impl<'a> Visit<'a> for Paths {
    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if matches!(names[0].as_str(), "crate" | "super" | "self") && names.len() > 1 {
            self.0.insert(names);
        }
        syn::visit::visit_path(self, path);
    }

    fn visit_item_use(&mut self, declaration: &'a syn::ItemUse) {
        let mut found = Vec::new();
        flatten(&declaration.tree, &mut Vec::new(), &mut found);
        self.0.extend(found.into_iter().map(|import| import.path));
    }

    fn visit_item_mod(&mut self, inner: &'a syn::ItemMod) {
        if !is_test(&inner.attrs) {
            syn::visit::visit_item_mod(self, inner);
        }
    }
}

/// The file that a `#[path]` names, beside `file`.
fn placed(file: &Path, attributes: &[Attribute]) -> Option<PathBuf> {
    let path = attributes.iter().find(|attribute| attribute.path().is_ident("path"))?;
    Some(file.parent()?.join(text_of(path)?))
}

/// The file of a module below a file.
fn below(file: &Path, name: &str) -> Option<PathBuf> {
    let folder = file.parent()?;
    let stem = file.file_stem()?.to_str()?;
    let folder = if matches!(stem, "lib" | "main" | "mod") { folder.to_owned() } else { folder.join(stem) };
    [folder.join(format!("{name}.rs")), folder.join(name).join("mod.rs")].into_iter().find(|path| path.exists())
}

/// The imports of a tree.
fn flatten(tree: &UseTree, path: &mut Vec<String>, found: &mut Vec<Import>) {
    match tree {
        UseTree::Path(inner) => {
            path.push(inner.ident.to_string());
            flatten(&inner.tree, path, found);
            path.pop();
        }
        UseTree::Name(inner) if inner.ident == "self" => {
            found.push(Import { name: path.last().cloned(), path: path.clone() });
        }
        UseTree::Name(inner) => {
            let name = inner.ident.to_string();
            found.push(Import { path: [path.as_slice(), std::slice::from_ref(&name)].concat(), name: Some(name) });
        }
        UseTree::Rename(inner) => {
            let name = inner.ident.to_string();
            let own = (name != "self").then_some(name);
            let path = path.iter().cloned().chain(own).collect();
            found.push(Import { name: Some(inner.rename.to_string()), path });
        }
        UseTree::Glob(_) => found.push(Import { name: None, path: path.clone() }),
        UseTree::Group(inner) => inner.items.iter().for_each(|tree| flatten(tree, path, found)),
    }
}

fn name_of(item: &Item) -> Option<String> {
    Some(match item {
        Item::Const(item) => item.ident.to_string(),
        Item::Enum(item) => item.ident.to_string(),
        Item::Fn(item) => item.sig.ident.to_string(),
        Item::Macro(item) => item.ident.as_ref()?.to_string(),
        Item::Mod(item) => item.ident.to_string(),
        Item::Static(item) => item.ident.to_string(),
        Item::Struct(item) => item.ident.to_string(),
        Item::Trait(item) => item.ident.to_string(),
        Item::Type(item) => item.ident.to_string(),
        Item::Union(item) => item.ident.to_string(),
        _ => return None,
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Whether `#[cfg(test)]` is among the attributes.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        _ => false,
    })
}

/// The text of documentation attributes.
fn documentation(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter(|attribute| attribute.path().is_ident("doc")).filter_map(text_of);
    lines.collect::<Vec<_>>().join("\n")
}

/// The text of an attribute of the form `#[name = "text"]`.
fn text_of(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    let syn::Expr::Lit(literal) = &pair.value else { return None };
    let syn::Lit::Str(text) = &literal.lit else { return None };
    Some(text.value())
}
