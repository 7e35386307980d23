//! What the board measures of itself: cycles of the core, delay of a tick, depth of the stack.

use cortex_m::peripheral::{DCB, DWT, SYST, syst::SystClkSource};
use cortex_m_stack::{repaint_stack, stack_painted, stack_size};
use impromptu_board::{CONTROL_HZ, CORE_HZ, Cost};

/// Cycles from one control tick to the next.
const RELOAD: u32 = CORE_HZ / CONTROL_HZ - 1;

/// The core's counter of cycles.
pub(crate) struct Cycles;

impl Cost for Cycles {
    fn now(&self) -> u32 {
        DWT::cycle_count()
    }

    fn since(&self, start: u32) -> u32 {
        self.now().wrapping_sub(start)
    }
}

/// Starts the counter.
pub(crate) fn start_cycles(mut debug: DCB, mut watch: DWT) {
    debug.enable_trace();
    watch.enable_cycle_counter();
}

/// Starts the control tick.
pub(crate) fn start_tick(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(RELOAD);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Cycles since the present control tick was due.
pub(crate) fn since_tick() -> u32 {
    RELOAD - SYST::get_current()
}

/// Paints what is free of the stack.
pub(crate) fn paint_stack() {
    repaint_stack();
}

/// Bytes from the top of RAM to the deepest word that was written since the painting.
pub(crate) fn stack_high_water() -> u32 {
    stack_size() - stack_painted()
}
