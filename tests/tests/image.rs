//! The programs that are flashed: where they lie, and that they fit, stack included, beside the models and within the budget.

use std::{fmt::Write as _, fs, path::Path};

use impromptu_tests::{
    elf::graph::CallGraph,
    emulator::{self, BOARD, FIRMWARE, build_firmware},
    golden,
};
use object::{
    Object as _, ObjectSection as _, ObjectSymbol as _,
    elf::{FileHeader32, PT_LOAD},
    read::elf::{ElfFile, ProgramHeader as _},
};

type Elf<'d> = ElfFile<'d, FileHeader32<object::Endianness>>;

/// Most bytes of flash and RAM, without models.
const FLASH: u32 = 96 * 1024;
const RAM: u32 = 32 * 1024;
/// What learning in flight may take on top: code; learner, hand-over of what is kept, and stack where responses are measured.
const LEARNING: [u32; 2] = [40 * 1024, 17 * 1024];
const GOLDEN: &str = "image.txt";
/// Where the slots are.
const SLOTS: u64 = 0x080A_0000;

/// A program that is flashed, and what of it runs when.
struct Image {
    bin: &'static str,
    /// Handlers by priority, lowest first. Of one level the deepest counts: none interrupts another.
    levels: [&'static [&'static str]; 3],
    /// Most bytes of flash and RAM.
    most: [u32; 2],
    /// Memory that stands for flash.
    flash: &'static [&'static str],
    /// What ends the program, and is not followed: on the real board nothing but a reset.
    ends: &'static [&'static str],
}

const IMAGES: [Image; 2] = [
    Image { bin: "crazyflie", levels: [&["DCMI", "CRYP"], &["SysTick"], &["USART3"]], most: [FLASH, RAM], flash: &[], ends: &[] },
    // Its queue of received bytes is larger by 1.5 KB: the host sends without a baud rate. Its panics print, and what talks to
    // the host has some. It learns, which the other board does not.
    Image {
        bin: "emulated",
        levels: [&["DCMI", "CRYP"], &["SysTick"], &["USART1"]],
        most: [FLASH + LEARNING[0], RAM + 1536 + LEARNING[1]],
        flash: &["IMPROMPTU_WEIGHTS", "::learned::MEMORY"],
        ends: &["rust_begin_unwind"],
    },
];

/// What runs before the interrupts are on, and has ended when they are.
const START: &str = "impromptu_board::start::start";

impl Image {
    /// Most bytes of stack until the interrupts are on, and from then on, with a task of each priority at its deepest.
    fn stack(&self, graph: &CallGraph<'_>) -> [u32; 2] {
        let running = [self.ends, &[START]].concat();
        let starting = graph.nested_stack_bytes_except(&["Reset"], &[], self.ends);
        [starting, graph.nested_stack_bytes_except(&["Reset"], &self.levels, &running)].map(Result::unwrap)
    }

    fn read(&self) -> impromptu_tests::elf::Elf {
        crate::elf::read(&build_firmware("impromptu-board", self.bin, BOARD, &[]).unwrap())
    }
}

/// Most stack that the emulated board can use, bytes.
pub(crate) fn emulated_stack() -> u32 {
    let elf = IMAGES[1].read();
    let stack = IMAGES[1].stack(&elf.call_graph().unwrap());
    stack[0].max(stack[1])
}

/// Flash, and RAM with the deepest stack, of the whole firmware without models.
#[test]
fn both_boards_are_within_the_budget_stack_included() {
    let compiler = emulator::compiler().unwrap();
    let mut text = format!(
        "Bytes of the programs that are flashed, without models, and of their deepest stacks; {}=1 rewrites this table.\n\
         compiler: {compiler}\n",
        golden::UPDATE_VARIABLE
    );
    for image in &IMAGES {
        let elf = image.read();
        let graph = elf.call_graph().unwrap();
        let footprint = elf.footprint(&[&[".impromptu_slots"], image.flash].concat()).unwrap();
        let [starting, running] = image.stack(&graph);
        let total = footprint.ram + starting.max(running);
        writeln!(text, "\n{}\n{:>7} flash\n{:>7} RAM with the stack", image.bin, footprint.flash, total).unwrap();
        writeln!(text, "{:>7} RAM without\n{starting:>7} stack of the start\n{running:>7} stack in flight", footprint.ram)
            .unwrap();
        for root in ["Reset"].iter().chain(image.levels.iter().copied().flatten()) {
            let path = graph.from_roots_except(&[root], image.ends).unwrap().stack_path().unwrap();
            writeln!(text, "\n{:>7} {root}", path.iter().map(|(_, bytes)| bytes).sum::<u32>()).unwrap();
            path.iter().for_each(|(name, bytes)| writeln!(text, "{bytes:>7}   {name}").unwrap());
        }
        assert!(footprint.flash <= image.most[0] && total <= image.most[1], "over budget:\n{text}");
    }
    golden::compare(GOLDEN, &text).unwrap();
}

/// Statics begin with zeros: what one begins with otherwise lies in flash too, as large as it is, be it for one number.
#[test]
fn flash_holds_no_image_of_a_large_static() {
    for Image { bin, .. } in IMAGES {
        let bytes = fs::read(build_firmware("impromptu-board", bin, BOARD, &[]).unwrap()).unwrap();
        let elf = Elf::parse(bytes.as_slice()).unwrap();
        let size = elf.section_by_name(".data").map_or(0, |section| section.size());
        assert!(size <= 64, "{bin}: {size} bytes; arm-none-eabi-nm --size-sort shows which");
    }
}

#[test]
fn both_boards_leave_the_slots_alone() {
    for Image { bin, .. } in IMAGES {
        let bytes = fs::read(build_firmware("impromptu-board", bin, BOARD, &[]).unwrap()).unwrap();
        let elf = Elf::parse(bytes.as_slice()).unwrap();
        let slots = elf.section_by_name(".impromptu_slots").unwrap();
        assert_eq!((slots.address(), slots.size()), (SLOTS, 384 * 1024), "{bin}");
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
    let elf: &Path = &build_firmware("impromptu-board", "netduinoplus2", FIRMWARE, &[]).unwrap();
    let bytes = fs::read(elf).unwrap();
    assert_loads_below(&Elf::parse(bytes.as_slice()).unwrap(), SLOTS, "netduinoplus2");
}
