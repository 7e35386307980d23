//! The kernels in assembly, for Cortex-M cores with the DSP extension or an FPU (M4, M7, M33): the only unsafe code of the
//! library.
//!
//! *in* slices whose lengths and alignment the safe wrappers check; *out* the bits of the [portable twin](super::portable);
//! *never* a branch that depends on data: the cycles of a layer follow from its shape; *source* the instruction timings of the
//! Cortex-M4 Technical Reference Manual, section 3.3: SMLAD, LSL, VMUL, VADD 1 cycle; n loads in a row (LDR or LDM) n + 1.
#![allow(unsafe_code)]

#[cfg(fpu)]
mod float;
#[cfg(dsp)]
mod frame;
#[cfg(dsp)]
mod integer;
#[cfg(fpu)]
mod tanh;

#[cfg(fpu)]
pub(in crate::network::kernel) use float::Float;
#[cfg(dsp)]
pub(in crate::network::kernel) use integer::Integer;
#[cfg(fpu)]
pub(in crate::network::kernel) use tanh::tanh;

/// Whether a stream lies on a word boundary, as LDM needs.
fn aligned(stream: &[[u8; 4]]) -> bool {
    stream.as_ptr().addr().is_multiple_of(4)
}

/// Tells the assembler that there are instructions for f32, which it does not conclude from the target.
#[cfg(fpu)]
macro_rules! floats {
    () => {
        ".fpu fpv4-sp-d16"
    };
}
#[cfg(fpu)]
use floats;

/// Instructions of two or three operands.
macro_rules! each {
    ($($operation:literal $a:literal $b:literal $($c:literal)?;)*) => {
        concat!($($operation, " ", $a, ", ", $b, $(", ", $c,)? "\n"),*)
    };
}
use each;
