//! What the functions that a task can reach do.
//!
//! *in* the calls that can be reached from some roots; *out* panics, calculations in f64, allocations, recursion, indirect calls
//! and the deepest stack, each with the chain of callers that leads there; *never* a bound of the stack beside an unknown one;
//! *source* names in `core`, `alloc`, `compiler-builtins`, and the Run-time ABI for the Arm Architecture.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use anyhow::{Context, Result, bail};
use petgraph::{algo::tarjan_scc, graphmap::DiGraphMap};

use super::{function::Function, graph::CallGraph};

/// Parts of the names of what ends a program by a panic.
const PANICS: [&str; 14] = [
    "core::panicking::",
    "std::panicking::",
    "rust_begin_unwind",
    "rust_panic",
    "panic_fmt",
    "panic_bounds_check",
    "panic_const",
    "panic_nounwind",
    "slice_index_fail",
    "slice_error_fail",
    "len_mismatch_fail",
    "unwrap_failed",
    "expect_failed",
    "core::cell::panic_already",
];

/// Parts of the names of what takes memory from a heap.
const ALLOCATIONS: [&str; 9] = [
    "__rust_alloc",
    "__rust_realloc",
    "__rust_dealloc",
    "__rdl_",
    "__rg_",
    "__rustc::__r",
    "alloc::alloc::",
    "alloc::raw_vec::",
    "handle_alloc_error",
];

/// Something that was found, and how it is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What it is.
    pub what: String,
    /// Names of the callers, from the root to where it is.
    pub chain: Vec<String>,
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.what, self.chain.join(" -> "))
    }
}

/// The functions that can be reached from the roots.
#[derive(Clone, Debug)]
pub struct Proof<'g> {
    pub(super) graph: &'g CallGraph<'g>,
    pub(super) roots: Vec<u32>,
    /// All that is reached, each with one that calls it.
    pub(super) callers: BTreeMap<u32, Option<u32>>,
}

/// Whether a name, or its last part, is that of a panic.
fn is_panic(name: &str) -> bool {
    PANICS.iter().any(|part| name.contains(part))
}

/// Whether a name is that of a calculation in f64, or of a conversion from or to it.
fn is_double_precision(name: &str) -> bool {
    let name = name.rsplit("::").next().unwrap_or(name);
    if let Some(name) = name.strip_prefix("__aeabi_") {
        return name.starts_with('d') || name.starts_with("cd") || name.ends_with("2d");
    }
    // GCC calls f64 `df`, as in `__adddf3`, `__fixdfsi`, `__floatsidf`, `__extendsfdf2`.
    name.starts_with("__") && ["df", "df2", "df3"].iter().any(|end| name.ends_with(end))
        || ["__fixdf", "__fixunsdf", "__truncdf", "__extenddf"].iter().any(|start| name.starts_with(start))
}

/// Whether a name is that of an allocation or of its end.
fn is_allocation(name: &str) -> bool {
    ["malloc", "calloc", "realloc", "free", "memalign"].contains(&name) || ALLOCATIONS.iter().any(|part| name.contains(part))
}

impl Proof<'_> {
    /// Names of all that can be reached.
    pub fn reached(&self) -> BTreeSet<String> {
        self.callers.keys().map(|entry| self.graph.image.name(*entry)).collect()
    }

    /// Panics that can be reached.
    pub fn panics(&self) -> Vec<Finding> {
        self.named(is_panic)
    }

    /// Calculations in f64, which this core does in software.
    pub fn double_precision(&self) -> Vec<Finding> {
        self.named(is_double_precision)
    }

    /// Uses of a heap.
    pub fn allocations(&self) -> Vec<Finding> {
        self.named(is_allocation)
    }

    /// Functions that call themselves, directly or not: the names of each such circle.
    pub fn recursion(&self) -> Vec<Vec<String>> {
        let circles = tarjan_scc(&self.calls()).into_iter();
        let circles = circles.filter(|circle| circle.len() > 1 || self.graph.calls(circle[0]).contains_key(&circle[0]));
        circles.map(|circle| circle.into_iter().map(|entry| self.graph.image.name(entry)).collect()).collect()
    }

    /// Indirect calls of functions for which no targets were declared ([`CallGraph::declare`]).
    pub fn indirect(&self) -> Vec<Finding> {
        let undeclared = self.functions().filter(|(entry, _)| !self.graph.declared.contains_key(entry));
        let finding =
            |(entry, at): (u32, &u32)| Finding { what: format!("indirect call at {at:#010x}"), chain: self.chain(entry) };
        undeclared.flat_map(|(entry, function)| function.indirect.keys().map(move |at| (entry, at))).map(finding).collect()
    }

    /// What could not be followed. All else is proven only if there is none.
    pub fn flaws(&self) -> Vec<Finding> {
        let all = self.functions().flat_map(|(entry, function)| function.flaws.iter().map(move |flaw| (entry, flaw)));
        all.map(|(entry, flaw)| Finding { what: flaw.to_string(), chain: self.chain(entry) }).collect()
    }

    /// Most stack, bytes, that one of the roots needs, with all that it calls.
    ///
    /// # Errors
    /// If it has no bound: recursion, an indirect call that was not declared, a stack pointer that is calculated. They are named.
    pub fn stack_bytes(&self) -> Result<u32> {
        Ok(self.deepest()?.0)
    }

    /// The path with the deepest stack: each function's name with the bytes of stack at its call of the next; the last with its
    /// frame.
    ///
    /// # Errors
    /// Those of [`Proof::stack_bytes`].
    pub fn stack_path(&self) -> Result<Vec<(String, u32)>> {
        Ok(self.deepest()?.1)
    }

    fn deepest(&self) -> Result<(u32, Vec<(String, u32)>)> {
        let unknown: Vec<String> = self.flaws().iter().chain(&self.indirect()).map(Finding::to_string).collect();
        if !unknown.is_empty() {
            bail!("the stack has no bound:\n{}", unknown.join("\n"));
        }
        let calls = self.calls();
        let mut bytes: BTreeMap<u32, (u32, Option<u32>)> = BTreeMap::new();
        // Strongly connected components come out callees first.
        for circle in tarjan_scc(&calls) {
            let [entry] = circle[..] else { bail!("the stack has no bound: {} is recursive", self.graph.image.name(circle[0])) };
            let function = self.graph.functions.get(&entry).context("a function outside of the graph")?;
            let mut deepest = (function.frame, None);
            for (target, depth) in self.reached_calls(entry) {
                let below = bytes.get(&target);
                let (below, _) =
                    below.with_context(|| format!("the stack has no bound: {} calls itself", self.graph.image.name(entry)))?;
                if depth + below > deepest.0 {
                    deepest = (depth + below, Some(target));
                }
            }
            bytes.insert(entry, deepest);
        }
        let root = self.roots.iter().copied().max_by_key(|root| bytes[root].0).context("no roots")?;
        let (mut path, mut entry) = (Vec::new(), Some(root));
        while let Some(at) = entry {
            let (total, next) = bytes[&at];
            path.push((self.graph.image.name(at), total - next.map_or(0, |next| bytes[&next].0)));
            entry = next;
        }
        Ok((bytes[&root].0, path))
    }

    fn functions(&self) -> impl Iterator<Item = (u32, &Function)> {
        self.callers.keys().filter_map(|entry| Some((*entry, self.graph.functions.get(entry)?)))
    }

    fn reached_calls(&self, entry: u32) -> impl Iterator<Item = (u32, u32)> {
        self.graph.calls(entry).into_iter().filter(|(target, _)| self.callers.contains_key(target))
    }

    fn calls(&self) -> DiGraphMap<u32, ()> {
        let mut calls = DiGraphMap::new();
        for entry in self.callers.keys() {
            calls.add_node(*entry);
            for (target, _) in self.reached_calls(*entry) {
                calls.add_edge(*entry, target, ());
            }
        }
        calls
    }

    /// Functions with such a name. What they call in turn under such names is no news.
    fn named(&self, matches: impl Fn(&str) -> bool) -> Vec<Finding> {
        let matches = |entry: u32| {
            let symbol = self.graph.image.function(entry).filter(|(start, _)| *start == entry);
            symbol.is_some_and(|(_, symbol)| symbol.names.iter().any(|name| matches(name)))
        };
        let found = self.callers.iter().filter(|(entry, caller)| matches(**entry) && !caller.is_some_and(&matches));
        found.map(|(entry, _)| Finding { what: self.graph.image.name(*entry), chain: self.chain(*entry) }).collect()
    }

    /// Names from a root to `entry`.
    fn chain(&self, entry: u32) -> Vec<String> {
        let mut chain = vec![self.graph.image.name(entry)];
        let mut at = entry;
        while let Some(Some(caller)) = self.callers.get(&at) {
            chain.push(self.graph.image.name(*caller));
            at = *caller;
        }
        chain.reverse();
        chain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart() {
        let double = [
            "__aeabi_dadd",
            "__aeabi_cdcmple",
            "__aeabi_f2d",
            "__aeabi_d2iz",
            "__muldf3",
            "__floatsidf",
            "__fixdfsi",
            "__extendsfdf2",
        ];
        assert!(double.into_iter().all(is_double_precision) && is_double_precision("compiler_builtins::float::add::__adddf3"));
        let others = ["__aeabi_fadd", "__aeabi_uldivmod", "__aeabi_memcpy4", "__addsf3", "__udivmoddi4", "pdf", "model::df2"];
        assert!(!others.into_iter().any(is_double_precision));
        let heap = ["malloc", "__rust_alloc", "__rustc::__rust_alloc", "__rustc::__rdl_alloc", "alloc::raw_vec::handle_error"];
        assert!(heap.into_iter().all(is_allocation));
        assert!(!["free_fall", "flight::allocate", "__rustc::rust_begin_unwind"].into_iter().any(is_allocation));
        let panics = [
            "__rustc::rust_begin_unwind",
            "core::panicking::panic_fmt",
            "core::option::unwrap_failed",
            "core::slice::index::slice_index_fail",
        ];
        assert!(panics.into_iter().all(is_panic) && !is_panic("core::fmt::write"));
    }
}
