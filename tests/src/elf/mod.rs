//! What can be proven of a binary without running it: which functions a task can reach, and how much stack that takes.
//!
//! ```text
//! ELF ──► Elf ──► CallGraph ──► Proof: panics, f64, allocations, recursion, indirect calls, stack
//!          └────► Footprint: flash and RAM
//! ```
//!
//! The instructions are decoded by [`instruction`], about 300 lines that know the flow and the stack pointer only. Of the
//! decoders on the registry, `yaxpeax-arm` 0.5 knows no floating-point instruction (VPUSH is one), `unarm` no Thumb-2, and
//! `capstone` needs a C compiler. Each function is walked along its flow ([`function`]), so tables and literals within it are
//! never taken for code, and each call is known with the depth of the stack at which it is made.

mod condition;
pub mod footprint;
pub mod function;
pub mod graph;
pub mod instruction;
pub mod proof;
pub mod reach;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    ops::Range,
    path::Path,
};

use anyhow::{Context, Result, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use self::instruction::{Instruction, decode};

/// A function of the binary: all the names of one address.
#[derive(Clone, Debug)]
pub struct Symbol {
    /// The names, without the hashes of the compiler; the first one is shown.
    pub names: Vec<String>,
    /// Address behind the function.
    pub end: u32,
}

/// An ELF file for a Cortex-M.
#[derive(Clone, Debug)]
pub struct Elf {
    /// Executable sections: where they start, and their bytes.
    code: Vec<(u32, Vec<u8>)>,
    /// By their address.
    functions: BTreeMap<u32, Symbol>,
    /// From each address on: whether it is code.
    mapping: BTreeMap<u32, bool>,
    /// What the linker placed.
    sections: Vec<Section>,
    /// Every symbol with a size, in the order of addresses.
    pieces: Vec<Piece>,
    /// Functions whose jumps to addresses in registers stay within them.
    labelled: BTreeSet<u32>,
}

/// A section that takes memory on the target.
#[derive(Clone, Debug)]
struct Section {
    name: String,
    addresses: Range<u32>,
    /// Whether it has bytes in the file, which then are in flash.
    stored: bool,
    /// Whether the program writes to it.
    written: bool,
}

/// A function or a static.
#[derive(Clone, Debug)]
struct Piece {
    name: String,
    addresses: Range<u32>,
}

impl Elf {
    /// Reads a file.
    ///
    /// # Errors
    /// If it is no ELF file for 32-bit Arm, or has lost its symbols.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&bytes).with_context(|| path.display().to_string())
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        ensure!(file.architecture() == object::Architecture::Arm, "a binary for {:?}, not for Arm", file.architecture());
        let (mut code, mut sections) = (Vec::new(), Vec::new());
        for section in file.sections() {
            let object::SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            let (allocated, written) =
                (sh_flags & u64::from(object::elf::SHF_ALLOC) != 0, sh_flags & u64::from(object::elf::SHF_WRITE) != 0);
            if !allocated || section.size() == 0 {
                continue;
            }
            let start = u32::try_from(section.address())?;
            if section.kind() == SectionKind::Text {
                code.push((start, section.data()?.to_vec()));
            }
            let stored = !matches!(section.kind(), SectionKind::UninitializedData);
            let addresses = start..start + u32::try_from(section.size())?;
            sections.push(Section { name: section.name()?.to_owned(), addresses, stored, written });
        }
        let (mut mapping, mut pieces) = (BTreeMap::new(), Vec::new());
        let mut found: BTreeMap<u32, (Vec<String>, u32)> = BTreeMap::new();
        for symbol in file.symbols() {
            let (name, address, size) = (symbol.name()?, u32::try_from(symbol.address())?, u32::try_from(symbol.size())?);
            // `$t`, `$d.7`: what begins here (ELF for the Arm Architecture, 4.5.5).
            match name.as_bytes() {
                [b'$', kind @ (b't' | b'd'), rest @ ..] if rest.first().is_none_or(|dot| *dot == b'.') => {
                    mapping.insert(address, *kind == b't');
                    continue;
                }
                _ => {}
            }
            // The lowest bit of a function's address says Thumb.
            let function = symbol.kind() == SymbolKind::Text && address & 1 == 1;
            let address = if function { address - 1 } else { address };
            let name = format!("{:#}", rustc_demangle::demangle(name));
            if size > 0 {
                pieces.push(Piece { name: name.clone(), addresses: address..address + size });
            }
            if function {
                let (names, longest) = found.entry(address).or_default();
                *longest = size.max(*longest);
                // A weak alias like `SysTick` stands beside the function that it is an alias of, whose symbol has a size.
                if size > 0 { names.insert(0, name) } else { names.push(name) }
            }
        }
        ensure!(!found.is_empty() && !mapping.is_empty(), "no symbols of functions: it was stripped");
        pieces.sort_by_key(|piece| piece.addresses.start);
        let mut image = Self { code, functions: BTreeMap::new(), mapping, sections, pieces, labelled: BTreeSet::new() };
        let starts: Vec<u32> = found.keys().copied().collect();
        for (index, (start, (names, size))) in found.into_iter().enumerate() {
            // Assembly often tells no size: it ends where the next function starts.
            let end = if size > 0 { start + size } else { image.limit(start, starts.get(index + 1).copied()) };
            image.functions.insert(start, Symbol { names, end });
        }
        Ok(image)
    }

    /// Where a function without size ends.
    fn limit(&self, start: u32, next: Option<u32>) -> u32 {
        let section = self.code.iter().find(|(base, bytes)| (*base..base + bytes.len() as u32).contains(&start));
        let end = section.map_or(start, |(base, bytes)| base + bytes.len() as u32);
        next.map_or(end, |next| next.min(end))
    }

    /// The function that starts at an address or goes around it, with where it starts.
    pub fn function(&self, address: u32) -> Option<(u32, &Symbol)> {
        let (start, symbol) = self.functions.range(..=address).next_back()?;
        (address < symbol.end).then_some((*start, symbol))
    }

    /// Addresses of the functions one of whose names contains `name`; of those alone whose name it is, if there are any.
    pub fn find(&self, name: &str) -> Vec<u32> {
        let matching = |test: &dyn Fn(&str) -> bool| -> Vec<u32> {
            let those = self.functions.iter().filter(|(_, symbol)| symbol.names.iter().any(|name| test(name)));
            those.map(|(start, _)| *start).collect()
        };
        let exact = matching(&|found| found == name);
        if exact.is_empty() { matching(&|found| found.contains(name)) } else { exact }
    }

    /// The name of what is at an address.
    pub fn name(&self, address: u32) -> String {
        match self.function(address) {
            Some((start, symbol)) if start == address => symbol.names[0].clone(),
            Some((start, symbol)) => format!("{}+{:#x}", symbol.names[0], address - start),
            None => format!("{address:#010x}"),
        }
    }

    /// Whether an address is code.
    fn is_code(&self, address: u32) -> bool {
        self.mapping.range(..=address).next_back().is_some_and(|(_, code)| *code)
    }

    /// Where the data at an address ends.
    fn end_of_data(&self, address: u32) -> Option<u32> {
        self.mapping.range(address..).find(|(_, code)| **code).map(|(end, _)| *end)
    }

    /// Says that the functions with `name` in their names jump, where they jump to an address in a register, to labels of their
    /// own, whose addresses are in tables between their instructions.
    ///
    /// # Errors
    /// If there is no such function, or one has no such tables.
    pub fn declare_labels(&mut self, name: &str) -> Result<()> {
        let found = self.find(name);
        ensure!(!found.is_empty(), "no function is called {name}");
        for start in found {
            self.labelled.insert(start);
            let end = self.functions[&start].end;
            ensure!(!self.labels(start, end).is_empty(), "{} has no table of its own labels", self.name(start));
        }
        Ok(())
    }

    /// Addresses within a declared function that are in its data.
    fn labels(&self, start: u32, end: u32) -> Vec<u32> {
        if !self.labelled.contains(&start) {
            return Vec::new();
        }
        let words = (start.next_multiple_of(4)..end).step_by(4).filter(|at| !self.is_code(*at));
        let words = words.filter_map(|at| self.bytes(at).map(u32::from_le_bytes));
        words.filter(|word| word & 1 == 1 && (start..end).contains(word)).map(|word| word - 1).collect()
    }

    /// Bytes of an executable section.
    fn bytes<const N: usize>(&self, address: u32) -> Option<[u8; N]> {
        let (base, bytes) = self.code.iter().find(|(base, bytes)| (*base..base + bytes.len() as u32).contains(&address))?;
        let start = (address - base) as usize;
        bytes.get(start..start + N)?.try_into().ok()
    }

    /// The instruction at an address.
    ///
    /// # Errors
    /// If there is data, or nothing.
    pub fn instruction(&self, address: u32) -> Result<Instruction> {
        if !self.is_code(address) {
            bail!("data at {}", self.name(address));
        }
        let first = self.bytes(address).with_context(|| format!("nothing at {address:#010x}"))?;
        let second = self.bytes(address + 2).unwrap_or_default();
        Ok(decode(address, u16::from_le_bytes(first), u16::from_le_bytes(second)))
    }
}
