//! How much memory a binary takes.
//!
//! *in* a binary, and the names of the statics that hold weights; *out* bytes of flash and RAM without them, and the largest
//! pieces; *never* a section that is counted twice or not at all; *source* the ELF file's section flags.

use std::fmt::Write;

use anyhow::{Result, ensure};

use super::{Elf, Piece, Section};

/// Memory that a binary takes, bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Code, constants, and the initial values of variables.
    pub flash: u32,
    /// Variables. The stack takes what is left.
    pub ram: u32,
    /// Weights in flash, not contained in `flash`.
    pub weights: u32,
    /// Each section's name and bytes.
    pub sections: Vec<(String, u32)>,
    /// Functions and statics in flash, the largest first.
    pub flash_pieces: Vec<(String, u32)>,
    /// Statics in RAM, the largest first.
    pub ram_pieces: Vec<(String, u32)>,
}

fn largest<'p>(pieces: impl Iterator<Item = &'p Piece>) -> Vec<(String, u32)> {
    // The compiler calls a constant without a name `.Lanon.`, a hash that any change of its crate changes, and a number.
    let name = |piece: &Piece| if piece.name.starts_with(".L") { "(no name)".to_owned() } else { piece.name.clone() };
    let mut pieces: Vec<(String, u32)> = pieces.map(|piece| (name(piece), size(&piece.addresses))).collect();
    pieces.sort_by(|(name, bytes), (other, others)| others.cmp(bytes).then_with(|| name.cmp(other)));
    pieces
}

fn size(addresses: &std::ops::Range<u32>) -> u32 {
    addresses.end - addresses.start
}

impl Elf {
    /// Memory that the binary takes; `weights` are parts of the names of statics, or whole names of sections, that hold a model
    /// and do not count.
    ///
    /// # Errors
    /// If there are no such weights.
    pub fn footprint(&self, weights: &[&str]) -> Result<Footprint> {
        let bytes = |counts: &dyn Fn(&Section) -> bool| -> u32 {
            self.sections.iter().filter(|section| counts(section)).map(|section| size(&section.addresses)).sum()
        };
        let in_section = |piece: &Piece, counts: fn(&Section) -> bool| {
            self.sections.iter().any(|section| counts(section) && section.addresses.contains(&piece.addresses.start))
        };
        let mut left_out = [0; 2];
        for name in weights {
            let sections: Vec<&Section> = self.sections.iter().filter(|section| section.name == *name).collect();
            let pieces: Vec<&Piece> = self.pieces.iter().filter(|piece| piece.name.contains(name)).collect();
            ensure!(!sections.is_empty() || !pieces.is_empty(), "no section or static is called {name}");
            for section in &sections {
                left_out[0] += if section.stored { size(&section.addresses) } else { 0 };
                left_out[1] += if section.written { size(&section.addresses) } else { 0 };
            }
            for piece in
                pieces.iter().filter(|piece| !sections.iter().any(|section| section.addresses.contains(&piece.addresses.start)))
            {
                left_out[0] += if in_section(piece, |section| section.stored) { size(&piece.addresses) } else { 0 };
                left_out[1] += if in_section(piece, |section| section.written) { size(&piece.addresses) } else { 0 };
            }
        }
        Ok(Footprint {
            flash: bytes(&|section| section.stored) - left_out[0],
            ram: bytes(&|section| section.written) - left_out[1],
            weights: left_out[0],
            sections: self.sections.iter().map(|section| (section.name.clone(), size(&section.addresses))).collect(),
            flash_pieces: largest(
                self.pieces.iter().filter(|piece| in_section(piece, |section| section.stored && !section.written)),
            ),
            ram_pieces: largest(self.pieces.iter().filter(|piece| in_section(piece, |section| section.written))),
        })
    }
}

impl Footprint {
    /// A table with the `count` largest pieces of each memory.
    pub fn table(&self, count: usize) -> String {
        let mut table =
            format!("{:>7} flash, without {} of weights\n{:>7} RAM, without the stack\n", self.flash, self.weights, self.ram);
        // Writing to a string does not fail.
        let mut rows = |title: &str, rows: &[(String, u32)]| {
            let _ = writeln!(table, "\n{title}");
            for (name, bytes) in rows {
                let _ = writeln!(table, "{bytes:>7} {name}");
            }
        };
        rows("sections", &self.sections);
        rows("largest in flash", &self.flash_pieces[..count.min(self.flash_pieces.len())]);
        rows("largest in RAM", &self.ram_pieces[..count.min(self.ram_pieces.len())]);
        table
    }
}
