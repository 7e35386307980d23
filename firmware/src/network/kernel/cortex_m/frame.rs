//! How the integer kernels begin and end, and where a word waits that a block needs only once: in s0-s7 (1 cycle to fetch), or,
//! without an FPU, on the stack (2 cycles).

/// Tells the assembler that there are the instructions of the DSP extension, which it concludes from an Armv7E-M target alone.
#[cfg(not(armv8m))]
macro_rules! extension {
    () => {
        ""
    };
}
#[cfg(armv8m)]
macro_rules! extension {
    () => {
        ".cpu cortex-m33"
    };
}
pub(super) use extension;

/// Parts of a kernel: `enter`, `leave`, `keep PLACE REGISTER`, `fetch REGISTER PLACE`, with places from 0 to 7.
#[cfg(fpu)]
macro_rules! frame {
    (enter) => {
        concat!($crate::network::kernel::cortex_m::floats!(), "\npush {{r4-r11, lr}}")
    };
    (leave) => {
        "pop {{r4-r11, pc}}"
    };
    (keep $place:literal $register:literal) => {
        concat!("vmov s", $place, ", ", $register)
    };
    (fetch $register:literal $place:literal) => {
        concat!("vmov ", $register, ", s", $place)
    };
}
#[cfg(not(fpu))]
macro_rules! frame {
    (enter) => {
        "push {{r4-r11, lr}}\nsub.w sp, sp, #32"
    };
    (leave) => {
        "add.w sp, sp, #32\npop {{r4-r11, pc}}"
    };
    (keep $place:literal $register:literal) => {
        concat!("str.w ", $register, ", [sp, #4 * ", $place, "]")
    };
    (fetch $register:literal $place:literal) => {
        concat!("ldr.w ", $register, ", [sp, #4 * ", $place, "]")
    };
}
pub(super) use frame;
