//! What the emulated board can measure of itself: executed instructions, delay of a tick, depth of the stack.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_stack::{repaint_stack, stack_painted, stack_size};
use impromptu_board::{CONTROL_HZ, CORE_HZ, Cost};

/// Ticks of SysTick from one control tick to the next.
const RELOAD: u32 = CORE_HZ / CONTROL_HZ - 1;

/// A 32-bit timer of the microcontroller.
pub(crate) trait Timer {
    /// Its reading.
    fn count(&self) -> u32;
}

impl Timer for stm32f4::stm32f405::TIM2 {
    fn count(&self) -> u32 {
        self.cnt().read().bits()
    }
}

impl Timer for stm32f4::stm32f405::TIM5 {
    fn count(&self) -> u32 {
        self.cnt().read().bits()
    }
}

/// Counts executed instructions with one of the 32-bit timers.
///
/// Under `-icount shift=N` an instruction takes 2^N nanoseconds of virtual time, and QEMU's timers 2 to 5 show the virtual time
/// in nanoseconds: the difference of two readings is exact, and the same in every run.
pub(crate) struct Counter<T> {
    timer: T,
    /// Nanoseconds of an instruction.
    nanoseconds: u32,
}

impl<T: Timer> Counter<T> {
    /// Takes a timer and learns what an instruction takes from a loop of known length.
    pub(crate) fn new(timer: T) -> Self {
        let mut counter = Self { timer, nanoseconds: 1 };
        // The loop of `delay` has two instructions and runs as often as its argument says.
        let short = counter.measure(|| cortex_m::asm::delay(1_000)).1;
        let long = counter.measure(|| cortex_m::asm::delay(3_000)).1;
        // Without `-icount` the counts mean nothing, but nothing fails.
        counter.nanoseconds = ((long.wrapping_sub(short) + 2_000) / 4_000).max(1);
        counter
    }

    /// Instructions since the present control tick was due.
    pub(crate) fn since_tick(&self) -> u32 {
        // At most 336,000 ticks: no overflow in 64 bits, and the quotient is small.
        let nanoseconds = u64::from(RELOAD - SYST::get_current()) * 1_000 / u64::from(CORE_HZ / 1_000_000);
        nanoseconds as u32 / self.nanoseconds
    }
}

impl<T: Timer> Cost for Counter<T> {
    fn now(&self) -> u32 {
        self.timer.count()
    }

    fn since(&self, start: u32) -> u32 {
        self.now().wrapping_sub(start) / self.nanoseconds
    }
}

/// Starts the control tick.
pub(crate) fn start_tick(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RELOAD);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Paints what is free of the stack.
pub(crate) fn paint_stack() {
    repaint_stack();
}

/// Bytes from the top of RAM to the deepest word that was written since the painting.
pub(crate) fn stack_high_water() -> u32 {
    stack_size() - stack_painted()
}
