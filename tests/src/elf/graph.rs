//! Which function calls which.
//!
//! *in* a binary, and where indirect calls may lead; *out* every function with its calls; *never* a call to a function that is
//! not in the graph; *source* the functions as [`super::function`] walks them.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, ensure};

use super::{
    Elf,
    function::{Function, walk},
};

/// The calls of a binary.
#[derive(Clone, Debug)]
pub struct CallGraph<'a> {
    pub(super) image: &'a Elf,
    /// By their entries.
    pub(super) functions: BTreeMap<u32, Function>,
    /// Where the indirect calls of a function lead.
    pub(super) declared: BTreeMap<u32, BTreeSet<u32>>,
}

impl Elf {
    /// Walks every function.
    ///
    /// # Errors
    /// If there is none.
    pub fn call_graph(&self) -> Result<CallGraph<'_>> {
        ensure!(!self.functions.is_empty(), "no functions");
        let mut endless = BTreeSet::new();
        let functions = loop {
            let functions = self.walk_all(&endless);
            // Who only calls functions that never return, does not either; so again, until there are no more of them.
            let more = functions.iter().filter(|(_, function)| !function.returns).map(|(entry, _)| *entry).collect();
            if more == endless {
                break functions;
            }
            endless = more;
        };
        Ok(CallGraph { image: self, functions, declared: BTreeMap::new() })
    }

    fn walk_all(&self, endless: &BTreeSet<u32>) -> BTreeMap<u32, Function> {
        let mut functions = BTreeMap::new();
        let mut open: Vec<u32> = self.functions.keys().copied().collect();
        while let Some(entry) = open.pop() {
            if functions.contains_key(&entry) {
                continue;
            }
            let function = walk(self, entry, endless);
            open.extend(function.calls.keys());
            functions.insert(entry, function);
        }
        functions
    }
}

impl<'a> CallGraph<'a> {
    /// Says where the indirect calls of the functions named `caller` lead: to the functions whose names contain one of `targets`.
    ///
    /// # Errors
    /// If there is no such caller, it makes no indirect call (then the declaration is out of date), or there is no such target.
    pub fn declare(&mut self, caller: &str, targets: &[&str]) -> Result<()> {
        let callers: Vec<u32> = self.entries(caller)?.into_iter().filter(|entry| self.makes_indirect_calls(*entry)).collect();
        ensure!(!callers.is_empty(), "{caller} makes no indirect call: remove its declaration");
        let targets = targets.iter().map(|target| self.entries(target)).collect::<Result<Vec<_>>>()?.concat();
        for caller in callers {
            self.declared.entry(caller).or_default().extend(&targets);
        }
        Ok(())
    }

    fn makes_indirect_calls(&self, entry: u32) -> bool {
        self.functions.get(&entry).is_some_and(|function| !function.indirect.is_empty())
    }

    /// Entries of the functions with this name, or with this in their names.
    pub(super) fn entries(&self, name: &str) -> Result<Vec<u32>> {
        let found = self.image.find(name);
        ensure!(!found.is_empty(), "no function is called {name}: it was renamed, or inlined into its only caller");
        Ok(found)
    }

    /// What a function calls, with the depth of its stack at which it does.
    pub(super) fn calls(&self, entry: u32) -> BTreeMap<u32, u32> {
        let Some(function) = self.functions.get(&entry) else { return BTreeMap::new() };
        let mut calls = function.calls.clone();
        let depth = function.indirect.values().copied().max().unwrap_or(0);
        for target in self.declared.get(&entry).into_iter().flatten() {
            let deepest = calls.entry(*target).or_default();
            *deepest = depth.max(*deepest);
        }
        calls
    }
}
