//! Which function calls which.
//!
//! *in* a binary, and where indirect calls may lead; *out* every function with its calls; *never* a call to a function that is not in
//! the graph; *source* the functions as [`super::function`] walks them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use anyhow::{Context, Result, ensure};

use super::{
    Elf,
    function::{Function, walk},
    proof::Proof,
};

/// What the core stacks for an exception while the floating-point unit is in use (26 words), and what it may add to align the frame.
pub const EXCEPTION_FRAME: u32 = 104 + 4;

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

    /// All that can be reached from the functions whose names contain one of `roots`.
    ///
    /// # Errors
    /// If a root is not there.
    pub fn from_roots(&self, roots: &[&str]) -> Result<Proof<'_>> {
        self.from_roots_except(roots, &[])
    }

    /// [`CallGraph::from_roots`], without what is called by the functions with `exceptions` in their names: what those reach is to be
    /// told apart. They have no stack then, so [`Proof::stack_bytes`] is no bound.
    ///
    /// # Errors
    /// If a root or an exception is not there.
    pub fn from_roots_except(&self, roots: &[&str], exceptions: &[&str]) -> Result<Proof<'_>> {
        let exceptions = exceptions.iter().map(|name| self.entries(name)).collect::<Result<Vec<_>>>()?.concat();
        let roots = roots.iter().map(|root| self.entries(root)).collect::<Result<Vec<_>>>()?.concat();
        // Breadth first: the chain of callers that is shown is a shortest one.
        let mut callers: BTreeMap<u32, Option<u32>> = roots.iter().map(|root| (*root, None)).collect();
        let mut open: VecDeque<u32> = roots.iter().copied().collect();
        while let Some(entry) = open.pop_front() {
            for target in self.calls(entry).into_keys().filter(|target| !exceptions.contains(target)) {
                callers.entry(target).or_insert_with(|| {
                    open.push_back(target);
                    Some(entry)
                });
            }
        }
        Ok(Proof { graph: self, roots, callers })
    }

    /// Most stack, bytes, along a chain of callers, each called by the one before it: from the entry of the first to the deepest point of
    /// the last.
    ///
    /// # Errors
    /// If one of them does not call the next, or if the last one's stack has no bound ([`Proof::stack_bytes`]).
    pub fn stack_along(&self, chain: &[&str]) -> Result<u32> {
        let (last, _) = chain.split_last().context("an empty chain")?;
        let mut bytes = self.from_roots(&[last])?.stack_bytes()?;
        for pair in chain.windows(2) {
            let targets = self.entries(pair[1])?;
            let sites = self.entries(pair[0])?.into_iter().flat_map(|caller| self.calls(caller));
            let deepest = sites.filter(|(target, _)| targets.contains(target)).map(|(_, depth)| depth).max();
            bytes += deepest.with_context(|| format!("{} does not call {}", pair[0], pair[1]))?;
        }
        Ok(bytes)
    }

    /// Most stack, bytes, of a program with interrupts: `thread` are its entries (`Reset`, `main`), `levels` the handlers of each priority in
    /// use. A handler is interrupted by those of other levels only, so one of each can be active at a time, each with its exception frame.
    ///
    /// # Errors
    /// If one of them has no bound ([`Proof::stack_bytes`]).
    pub fn nested_stack_bytes(&self, thread: &[&str], levels: &[&[&str]]) -> Result<u32> {
        self.nested_stack_bytes_except(thread, levels, &[])
    }

    /// [`CallGraph::nested_stack_bytes`] without what is called by the functions with `exceptions` in their names, which have no stack then: those
    /// that end the program, or have ended before the interrupts are on.
    ///
    /// # Errors
    /// If one of them has no bound, or an exception is not there.
    pub fn nested_stack_bytes_except(&self, thread: &[&str], levels: &[&[&str]], exceptions: &[&str]) -> Result<u32> {
        let mut bytes = self.from_roots_except(thread, exceptions)?.stack_bytes()?;
        for handlers in levels {
            bytes += EXCEPTION_FRAME + self.from_roots_except(handlers, exceptions)?.stack_bytes()?;
        }
        Ok(bytes)
    }
}
