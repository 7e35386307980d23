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

    /// Bytes of the functions that were executed, each counted whole, and of the tables that were read, likewise; and whether anything
    /// was read of the image, which lies at `image` and is `length` bytes long. What has no name counts as far as it was used.
    pub fn needed(&self, used: &Used, image: u64, length: u64) -> (u64, bool) {
        let (mut whole, mut nameless, mut reads_image) = (BTreeMap::new(), 0, false);
        for (start, length) in &used.executed {
            for address in (*start..start + length).step_by(2) {
                match around(&self.functions, address) {
                    Some((start, size)) => drop(whole.insert(start, size)),
                    None => nameless += 2,
                }
            }
        }
        let image = image & FLASH_MASK..(image & FLASH_MASK) + length;
        for (start, length) in &used.loaded {
            for address in *start..start + length {
                if image.contains(&address) {
                    reads_image = true;
                } else if let Some((start, size)) = around(&self.functions, address).or(around(&self.constants, address)) {
                    whole.insert(start, size);
                } else {
                    nameless += 1;
                }
            }
        }
        (whole.values().sum::<u64>() + nameless, reads_image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_and_tables_count_whole_the_image_apart() {
        let symbols = Symbols { functions: [(0x100, 40), (0x200, 8)].into(), constants: [(0x300, 512)].into(), stack_end: 0 };
        let used =
            Used { executed: vec![(0x104, 4), (0x110, 2), (0x400, 6)], loaded: vec![(0x120, 4), (0x310, 2), (0x1000, 99)] };
        assert_eq!(symbols.needed(&used, 0x0800_1000, 99), (40 + 6 + 512, true));
        assert_eq!(symbols.needed(&used, 0x0800_2000, 99), (40 + 6 + 512 + 99, false));
    }
}
