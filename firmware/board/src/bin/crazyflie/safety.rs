//! What happens when nothing else happens: the ways to a reset, which turns the motors off.
//!
//! - in: panics, faults, control ticks
//! - out: a reset of the microcontroller. It is safe code, needs no working stack frame, and makes each pin an input at once
//! - never: another attempt to turn the motors off with code that has just failed

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use stm32f4xx_hal::{pac::IWDG, prelude::*, watchdog::IndependentWatchdog};

/// Control ticks from the last acknowledgement of an upload to the restart: what is said about it has left by then.
const RESTART_TICKS: u32 = 50;

/// A panic resets. The message is lost: formatting it takes time and 10 KB of flash.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}

/// Stands for the handler of hard faults (`--defsym` in build.rs), which cortex-m-rt would have be unsafe; usage faults alone are
/// not enabled. A fault while this handler is entered, as of a stack that overflowed, locks the core up, and the watchdog resets
/// it.
#[exception]
fn UsageFault() -> ! {
    SCB::sys_reset()
}

/// The independent watchdog, fed by the control task alone. Its clock is good to -50 %, +50 %.
pub(crate) struct Watchdog {
    watchdog: IndependentWatchdog,
    armed: bool,
}

impl Watchdog {
    /// Longer than the core stands still when 128 KB are erased (at most 4 s, DS8626 table 40), with a clock that is fast.
    const DISARMED_MS: u32 = 20_000;
    /// The vehicle falls for less than a centimetre.
    const ARMED_MS: u32 = 20;

    pub(crate) fn start(peripheral: IWDG) -> Self {
        let mut watchdog = IndependentWatchdog::new(peripheral);
        watchdog.start(Self::DISARMED_MS.millis());
        Self { watchdog, armed: false }
    }

    /// From the next feeding on the new patience counts.
    pub(crate) fn feed(&mut self, armed: bool) {
        if armed != self.armed {
            self.armed = armed;
            self.watchdog.start(if armed { Self::ARMED_MS } else { Self::DISARMED_MS }.millis());
        }
        self.watchdog.feed();
    }
}

/// The restart with a new model.
#[derive(Default)]
pub(crate) struct Restart {
    ticks: u32,
}

impl Restart {
    pub(crate) fn tick(&mut self, due: bool) {
        if due {
            self.ticks += 1;
            if self.ticks > RESTART_TICKS {
                SCB::sys_reset();
            }
        }
    }
}
