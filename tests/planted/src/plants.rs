//! The functions. Values pass through black boxes, or the compiler would calculate what can go wrong and what cannot.

use core::hint::black_box;

static TABLE: [u32; 8] = [3, 1, 4, 1, 5, 9, 2, 6];

/// Calls all of them, so that the linker keeps them.
pub(crate) fn run(number: u32) -> u32 {
    let mut sum = harmless(number);
    sum ^= bounds_check(number) ^ behind_a_table(number) ^ behind_a_tail_call(number);
    sum ^= double_precision(number) as u32 ^ recursion(number) ^ mutual_recursion(number);
    sum ^= indirect(black_box(if number == 7 { harmless } else { bounds_check }), number);
    sum ^ calculated_stack(number) ^ deep(number)
}

/// Nothing: what is checked in it, and calculated in f32, is neither a panic nor in f64.
#[inline(never)]
fn harmless(number: u32) -> u32 {
    let value = TABLE.get(number as usize).copied().unwrap_or(0);
    (black_box(value) as f32 / black_box(3.0)) as u32
}

/// A panic.
#[inline(never)]
fn bounds_check(number: u32) -> u32 {
    TABLE[black_box(number as usize)]
}

/// A panic that one entry of a table of jumps leads to.
#[inline(never)]
fn behind_a_table(number: u32) -> u32 {
    match number {
        0 => black_box(11) + number,
        1 => black_box(number) * 3,
        2 => black_box(number) ^ 0x55,
        3 => black_box(number).rotate_left(5),
        4 => black_box(13) - number,
        5 => bounds_check(number ^ black_box(1)) | 1,
        6 => black_box(number) & 0xf0,
        7 => black_box(number).reverse_bits(),
        _ => 0,
    }
}

/// A panic in a function that is not called, but jumped to.
#[inline(never)]
fn behind_a_tail_call(number: u32) -> u32 {
    bounds_check(black_box(number) ^ 3)
}

/// A division in f64.
#[inline(never)]
fn double_precision(number: u32) -> f32 {
    (f64::from(black_box(number)) / black_box(3.0_f64)) as f32
}

/// A function that calls itself, and works on the result, so that it cannot become a loop.
#[inline(never)]
fn recursion(number: u32) -> u32 {
    if number == 0 { 1 } else { black_box(recursion(black_box(number - 1))) ^ number }
}

/// Two functions that call each other.
#[inline(never)]
fn mutual_recursion(number: u32) -> u32 {
    if number == 0 { 1 } else { black_box(other_half(black_box(number - 1))) ^ number }
}

#[inline(never)]
fn other_half(number: u32) -> u32 {
    if number == 0 { 2 } else { black_box(mutual_recursion(black_box(number - 1))) + number }
}

/// A call of what a pointer says.
#[inline(never)]
fn indirect(function: fn(u32) -> u32, number: u32) -> u32 {
    black_box(function(black_box(number))) + 1
}

/// What needs an alignment that the stack does not have: the stack pointer is calculated.
#[inline(never)]
fn calculated_stack(number: u32) -> u32 {
    #[repr(align(64))]
    struct Aligned([u32; 16]);
    let aligned = black_box(Aligned([number; 16]));
    aligned.0.iter().fold(0, |sum, value| sum ^ value)
}

/// 400 bytes on the stack, below them what `shallow` takes.
#[inline(never)]
fn deep(number: u32) -> u32 {
    let values = black_box([number; 100]);
    black_box(shallow(values[3])) + values[5]
}

#[inline(never)]
fn shallow(number: u32) -> u32 {
    let values = black_box([number; 10]);
    values.iter().fold(0, |sum, value| sum ^ value)
}
