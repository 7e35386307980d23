//! What the emulated board can measure of itself: executed instructions and the depth of the stack.

use core::{fmt, hint::black_box};

use cortex_m_stack::{repaint_stack, stack_painted, stack_size};
use stm32f4::stm32f405::{Peripherals, TIM2};

/// Counts executed instructions with TIM2.
///
/// Under `-icount shift=0` one instruction takes one nanosecond of virtual time, and QEMU's TIM2 shows the virtual time in
/// nanoseconds: the difference of two readings is exact, and the same in every run. It wraps after 2^32 instructions.
pub(crate) struct InstructionCounter {
    timer: TIM2,
    /// Instructions between the two readings that enclose nothing.
    overhead: u32,
}

impl InstructionCounter {
    /// Takes the timer and checks it against a loop of known length.
    pub(crate) fn new() -> Result<Self, &'static str> {
        let peripherals = Peripherals::take().ok_or("the peripherals were taken before")?;
        let mut counter = Self { timer: peripherals.TIM2, overhead: 0 };
        counter.overhead = counter.measure(|| ()).1;
        // The loop of `delay` has two instructions and runs as often as its argument says; the few more are NOPs that align it.
        let short = counter.measure(|| cortex_m::asm::delay(1_000)).1;
        let long = counter.measure(|| cortex_m::asm::delay(3_000)).1;
        if (4_000..4_008).contains(&long.wrapping_sub(short)) {
            Ok(counter)
        } else {
            Err("TIM2 does not count instructions: start QEMU with `-icount shift=0,sleep=off`")
        }
    }

    /// Result of `stage` and how many instructions it took.
    ///
    /// Without the black boxes the compiler may move arithmetic out of the stage, across the readings.
    #[inline(always)]
    pub(crate) fn measure<T>(&self, stage: impl FnOnce() -> T) -> (T, u32) {
        let start = self.timer.cnt().read().bits();
        let result = black_box(stage)();
        // By reference: a large result shall not be copied within the stage.
        black_box(&result);
        let end = self.timer.cnt().read().bits();
        (result, end.wrapping_sub(start).saturating_sub(self.overhead))
    }
}

/// Instructions of one stage over all the ticks of a run.
#[derive(Default)]
pub(crate) struct StageCost {
    runs: u32,
    least: u32,
    most: u32,
    total: u64,
}

impl StageCost {
    /// Adds one run of the stage.
    pub(crate) fn add(&mut self, instructions: u32) {
        self.least = if self.runs == 0 { instructions } else { self.least.min(instructions) };
        self.most = self.most.max(instructions);
        self.total += u64::from(instructions);
        self.runs += 1;
    }

    /// Whether the stage ran at all.
    pub(crate) fn has_run(&self) -> bool {
        self.runs > 0
    }
}

/// A JSON object.
impl fmt::Display for StageCost {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{{\"runs\":{},\"least\":{},\"most\":{},\"total\":{}}}", self.runs, self.least, self.most, self.total)
    }
}

/// Measures how deep the stack gets, by painting what is free of it.
pub(crate) struct StackGauge;

impl StackGauge {
    /// Paints everything below the caller's frame.
    pub(crate) fn paint() -> Self {
        repaint_stack();
        Self
    }

    /// Bytes from the top of RAM to the deepest word that was written since the painting.
    pub(crate) fn high_water(&self) -> u32 {
        stack_size() - stack_painted()
    }

    /// Bytes that the linker left for the stack.
    pub(crate) fn size(&self) -> u32 {
        stack_size()
    }
}
