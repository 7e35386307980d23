//! What every kernel of the benchmark can do, and how it is measured.

use core::{
    hint::black_box,
    sync::atomic::{Ordering, compiler_fence},
};

use cortex_m::{asm::sev, register::msp};

/// A network, ready to be evaluated.
pub(crate) trait Kernel {
    /// Numbers of inputs and outputs.
    fn shape(&self) -> (usize, usize);

    /// Bytes of static working memory, the network's own description apart.
    fn working_memory(&self) -> usize;

    /// From `inputs` in physical units to `outputs` in physical units.
    fn evaluate(&mut self, inputs: &[f32], outputs: &mut [f32]);
}

/// Evaluates between two markers; gives the stack pointer from which the evaluation went down.
///
/// Neither inlined nor told which kernel it calls: a call is part of the price of every kernel.
#[inline(never)]
pub(crate) fn measure(kernel: &mut dyn Kernel, inputs: &[f32], outputs: &mut [f32]) -> u32 {
    let kernel = black_box(kernel);
    let stack_pointer = msp::read();
    compiler_fence(Ordering::SeqCst);
    sev();
    kernel.evaluate(inputs, outputs);
    sev();
    compiler_fence(Ordering::SeqCst);
    black_box(stack_pointer)
}
