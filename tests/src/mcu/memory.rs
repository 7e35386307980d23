//! Which functions and tables of a binary an evaluation needs.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, Result};
use object::{Object, ObjectSymbol, SymbolKind};

use super::counter::Used;

/// Flash as the plugin addresses it.
const FLASH_MASK: u64 = (1 << 20) - 1;
/// Where flash starts.
const FLASH: u64 = 0x0800_0000;

/// The named pieces of a binary.
#[derive(Clone, Debug)]
pub struct Symbols {
    /// Start and size of each function in flash.
    functions: BTreeMap<u64, u64>,
    /// Start and size of each constant in flash.
    constants: BTreeMap<u64, u64>,
    /// First address behind the static memory, where the stack may grow to.
    pub stack_end: u64,
}

/// The piece that `address` lies in.
fn around(pieces: &BTreeMap<u64, u64>, address: u64) -> Option<(u64, u64)> {
    pieces.range(..=address).next_back().filter(|(start, size)| address < *start + *size).map(|(start, size)| (*start, *size))
}

impl Symbols {
    /// Reads the symbols of an ELF file.
    ///
    /// # Errors
    /// If it is none, or has no symbols.
    pub fn read(elf: &Path) -> Result<Self> {
        let bytes = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
        let file = object::File::parse(&*bytes).with_context(|| format!("{}", elf.display()))?;
        let (mut functions, mut constants, mut stack_end) = (BTreeMap::new(), BTreeMap::new(), None);
        for symbol in file.symbols() {
            // The lowest bit of a function's address says Thumb.
            let address = symbol.address() & !1;
            if symbol.name() == Ok("_stack_end") {
                stack_end = Some(address);
            }
            if symbol.size() == 0 || address & !FLASH_MASK != FLASH {
                continue;
            }
            match symbol.kind() {
                SymbolKind::Text => functions.insert(address & FLASH_MASK, symbol.size()),
                SymbolKind::Data => constants.insert(symbol.address() & FLASH_MASK, symbol.size()),
                _ => None,
            };
        }
        let stack_end = stack_end.with_context(|| format!("{}: no symbol _stack_end", elf.display()))?;
        Ok(Self { functions, constants, stack_end })
    }

    /// What of the flash was used, but for the image, which lies at `image` and is `length` bytes long.
    pub fn needed(&self, used: &Used, image: u64, length: u64) -> Needed {
        let (mut functions, mut tables) = (BTreeMap::new(), BTreeMap::new());
        let mut needed = Needed::default();
        for (start, length) in &used.executed {
            for address in (*start..start + length).step_by(2) {
                needed.path += 2;
                match around(&self.functions, address) {
                    Some((start, size)) => drop(functions.insert(start, size)),
                    None => needed.whole += 2,
                }
            }
        }
        let image = image & FLASH_MASK..(image & FLASH_MASK) + length;
        for (start, length) in &used.loaded {
            for address in *start..start + length {
                if image.contains(&address) {
                    needed.reads_image = true;
                } else if let Some((start, size)) = around(&self.constants, address) {
                    tables.insert(start, size);
                } else {
                    needed.path += 1;
                    match around(&self.functions, address) {
                        Some((start, size)) => drop(functions.insert(start, size)),
                        None => needed.whole += 1,
                    }
                }
            }
        }
        let tables: u64 = tables.values().sum();
        needed.path += tables;
        needed.whole += tables + functions.values().sum::<u64>();
        needed
    }
}

/// Flash that evaluations used, without the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needed {
    /// Bytes of the functions that ran, each whole, and of the tables that were read, likewise. What has no name counts as far as
    /// it was used.
    pub whole: u64,
    /// Bytes of the instructions that ran and of the tables that were read: a function may also serve other networks.
    pub path: u64,
    /// Whether anything was read of the image.
    pub reads_image: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_and_tables_count_whole_the_image_apart() {
        let symbols = Symbols { functions: [(0x100, 40), (0x200, 8)].into(), constants: [(0x300, 512)].into(), stack_end: 0 };
        let used =
            Used { executed: vec![(0x104, 4), (0x110, 2), (0x400, 6)], loaded: vec![(0x120, 4), (0x310, 2), (0x1000, 99)] };
        let needed = symbols.needed(&used, 0x0800_1000, 99);
        assert_eq!(needed, Needed { whole: 40 + 6 + 512, path: 6 + 6 + 4 + 512, reads_image: true });
        let needed = symbols.needed(&used, 0x0800_2000, 99);
        assert_eq!(needed, Needed { whole: 40 + 6 + 512 + 99, path: 6 + 6 + 4 + 512 + 99, reads_image: false });
    }
}
