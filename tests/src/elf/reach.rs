//! What some roots reach in a graph of calls, and the stack that they need together.
//!
//! *in* names of roots, chains and interrupt handlers; *out* a [`Proof`] of what they reach, bytes of stack; *never* a bound
//! where one of them has none; *source* the Armv7-M architecture for the frame of an exception.

use std::collections::{BTreeMap, VecDeque};

use anyhow::{Context, Result};

use super::{graph::CallGraph, proof::Proof};

/// What the core stacks for an exception while the floating-point unit is in use (26 words), and what it may add to align the
/// frame.
pub const EXCEPTION_FRAME: u32 = 104 + 4;

impl CallGraph<'_> {
    /// All that can be reached from the functions whose names contain one of `roots`.
    ///
    /// # Errors
    /// If a root is not there.
    pub fn from_roots(&self, roots: &[&str]) -> Result<Proof<'_>> {
        self.from_roots_except(roots, &[])
    }

    /// [`CallGraph::from_roots`], without what is called by the functions with `exceptions` in their names: what those reach is
    /// to be told apart. They have no stack then, so [`Proof::stack_bytes`] is no bound.
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

    /// Most stack, bytes, along a chain of callers, each called by the one before it: from the entry of the first to the deepest
    /// point of the last.
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

    /// Most stack, bytes, of a program with interrupts: `thread` are its entries (`Reset`, `main`), `levels` the handlers of each
    /// priority in use. A handler is interrupted by those of other levels only, so one of each can be active at a time, each with
    /// its exception frame.
    ///
    /// # Errors
    /// If one of them has no bound ([`Proof::stack_bytes`]).
    pub fn nested_stack_bytes(&self, thread: &[&str], levels: &[&[&str]]) -> Result<u32> {
        self.nested_stack_bytes_except(thread, levels, &[])
    }

    /// [`CallGraph::nested_stack_bytes`] without what is called by the functions with `exceptions` in their names, which have no
    /// stack then: those that end the program, or have ended before the interrupts are on.
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
