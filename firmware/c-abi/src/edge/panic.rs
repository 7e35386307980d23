//! What a panic does on the microcontroller: it keeps a program from being linked.

use core::panic::PanicInfo;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        /// Defined nowhere: a program of which no part can panic does not need it, another one is not linked.
        fn impromptu_can_panic() -> !;
    }
    // SAFETY: never called in a program that was linked, unless that defines the function itself.
    unsafe { impromptu_can_panic() }
}
