//! The programs that are flashed: where they lie, and that they fit beside the models and within the budget.

use std::{fs, path::Path};

use impromptu_tests::emulator::{BOARD, FIRMWARE, build_firmware};
use object::{
    Object as _, ObjectSection as _, ObjectSymbol as _,
    elf::{FileHeader32, PT_LOAD},
    read::elf::{ElfFile, ProgramHeader as _},
};

type Elf<'d> = ElfFile<'d, FileHeader32<object::Endianness>>;

/// Most bytes of flash and RAM, without models; the stack has its own proof.
const FLASH: u64 = 96 * 1024;
const RAM: u64 = 32 * 1024;
/// Where the slots are.
const SLOTS: u64 = 0x080C_0000;

fn size(elf: &Elf<'_>, name: &str) -> u64 {
    elf.section_by_name(name).map_or(0, |section| section.size())
}

#[test]
fn both_boards_are_within_the_budget_and_leave_the_slots_alone() {
    for bin in ["emulated", "crazyflie"] {
        let bytes = fs::read(build_firmware("impromptu-board", bin, BOARD, &[]).unwrap()).unwrap();
        let elf = Elf::parse(bytes.as_slice()).unwrap();
        let flash: u64 = [".vector_table", ".text", ".rodata", ".data"].map(|name| size(&elf, name)).iter().sum();
        let ram: u64 = [".data", ".bss", ".uninit"].map(|name| size(&elf, name)).iter().sum();
        println!("{bin}: {flash} bytes of flash, {ram} of RAM");
        assert!(flash <= FLASH && ram <= RAM, "{bin}: {flash} bytes of flash, {ram} of RAM");
        let slots = elf.section_by_name(".impromptu_slots").unwrap();
        assert_eq!((slots.address(), slots.size()), (SLOTS, 256 * 1024), "{bin}");
        assert_loads_below(&elf, SLOTS, bin);
    }
}

/// Nothing is loaded there or above.
fn assert_loads_below(elf: &Elf<'_>, end: u64, name: &str) {
    let endian = elf.endian();
    for segment in elf.elf_program_headers() {
        if segment.p_type(endian) == PT_LOAD {
            let last = u64::from(segment.p_paddr(endian)) + u64::from(segment.p_filesz(endian));
            assert!(segment.p_filesz(endian) == 0 || last <= end, "{name} loads bytes up to {last:#x}");
        }
    }
}

#[test]
fn behind_a_boot_loader_the_program_starts_with_its_vectors() {
    for (offset, start) in [("0x4000", 0x0800_4000), ("", 0x0800_0000)] {
        let bytes =
            fs::read(build_firmware("impromptu-board", "crazyflie", BOARD, &[("IMPROMPTU_FLASH_OFFSET", offset)]).unwrap());
        let bytes = bytes.unwrap();
        let elf = Elf::parse(bytes.as_slice()).unwrap();
        let vectors = elf.section_by_name(".vector_table").unwrap();
        assert_eq!(vectors.address(), start);
        let lowest = elf.sections().filter(|section| section.address() >= 0x0800_0000 && section.size() > 0);
        assert_eq!(lowest.map(|section| section.address()).min(), Some(start));
        assert_loads_below(&elf, SLOTS, "crazyflie");
        // A fault is handled by what resets the board.
        let symbol = |name| elf.symbols().find(|symbol| symbol.name() == Ok(name)).map(|symbol| symbol.address());
        assert_eq!(symbol("HardFault"), symbol("UsageFault"));
        assert!(symbol("UsageFault").is_some());
    }
    let refused = build_firmware("impromptu-board", "crazyflie", BOARD, &[("IMPROMPTU_FLASH_OFFSET", "0x4001")]).unwrap_err();
    assert!(format!("{refused:#}").contains("IMPROMPTU_FLASH_OFFSET=0x4001: not a multiple"), "{refused:#}");
}

#[test]
fn binaries_without_slots_still_lie_below_them() {
    let elf: &Path = &build_firmware("impromptu-firmware", "netduinoplus2", FIRMWARE, &[]).unwrap();
    let bytes = fs::read(elf).unwrap();
    assert_loads_below(&Elf::parse(bytes.as_slice()).unwrap(), SLOTS, "netduinoplus2");
}
