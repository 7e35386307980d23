//! Models, and what was learned, in the flash of a binary that is not running yet, as the firmware would leave them.
//!
//! *in* an ELF file with a segment for the slots, and what each slot shall hold; *out* the ELF file that an emulator loads;
//! *never* a byte outside of that segment; *source* ELF-32; `firmware/board/src/slots.rs` and `memory.x` for the segment.

use anyhow::{Context as _, Result, ensure};
use impromptu_firmware::{
    model::file,
    storage::{Header, Sequence},
};
use object::{
    LittleEndian,
    elf::{FileHeader32, PT_LOAD, ProgramHeader32},
    pod::bytes_of,
    read::elf::{FileHeader as _, ProgramHeader as _},
};

/// Bytes of a slot.
pub(super) const SLOT: usize = 128 * 1024;
/// Slots, in the order of the flash: what was learned, models.
pub(super) const SLOTS: usize = 3;

/// What an upload with number 0 leaves in a slot.
pub(super) fn slot(model: &[u8]) -> Vec<u8> {
    let header = Header { sequence: Sequence(0), length: model.len() as u32, checksum: file::checksum(model) };
    [&header.to_bytes()[..], model].concat()
}

/// The binary with these slots in its flash.
pub(super) fn flash(elf: &[u8], slots: &[Vec<u8>; SLOTS]) -> Result<Vec<u8>> {
    let endian = LittleEndian;
    let header = FileHeader32::<LittleEndian>::parse(elf).context("not an ELF file")?;
    let segments = header.program_headers(endian, elf).context("an ELF file without segments")?;
    // The only one of which nothing is loaded that has the size of the slots.
    let index = segments
        .iter()
        .position(|segment| {
            segment.p_type(endian) == PT_LOAD && segment.p_filesz(endian) == 0 && segment.p_memsz(endian) as usize == SLOTS * SLOT
        })
        .context("the binary keeps no flash for models")?;
    let mut image = Vec::new();
    for (slot, index) in slots.iter().zip(1..) {
        ensure!(slot.len() <= SLOT, "{} bytes do not fit into a slot of {SLOT}", slot.len());
        image.extend(slot);
        // As erased flash.
        image.resize(index * SLOT, 0xff);
    }
    let mut segment = segments[index];
    segment.p_offset.set(endian, u32::try_from(elf.len())?);
    segment.p_filesz.set(endian, image.len() as u32);
    let start = header.e_phoff(endian) as usize + index * size_of::<ProgramHeader32<LittleEndian>>();
    let mut flashed = elf.to_vec();
    let place = flashed.get_mut(start..).and_then(|rest| rest.get_mut(..bytes_of(&segment).len()));
    place.context("an ELF file that ends early")?.copy_from_slice(bytes_of(&segment));
    flashed.extend(image);
    Ok(flashed)
}
