//! What an instruction of an Armv7E-M core does to the flow of a program and to its stack pointer, and nothing else about it.
//!
//! *in* halfwords and their address; *out* length, [`Flow`] and [`Stack`]; *never* an instruction that writes the stack pointer
//! or the program counter passes for one that does not; *source* Armv7-M Architecture Reference Manual (DDI 0403E), chapter A5.

pub use super::condition::Condition;
use super::condition::{compares, condition, sets_flags};

/// Number of the stack pointer.
const SP: u16 = 13;
/// Number of the link register.
const LR: u16 = 14;
/// Number of the program counter.
const PC: u16 = 15;

/// Where execution goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// At the next instruction.
    Next,
    /// At the address.
    Jump(u32),
    /// At the address or at the next instruction.
    Branch(u32),
    /// At the address, then at the next instruction.
    Call(u32),
    /// At an address in a register, then at the next instruction.
    CallRegister,
    /// At an address that is computed or in a register.
    JumpRegister,
    /// At the address that is stored at this one.
    JumpLiteral(u32),
    /// At the caller.
    Return,
    /// At one of the addresses of a table, which lies at this address; the entries are halfwords, or bytes.
    Table {
        /// Where the table is.
        at: u32,
        /// Whether the entries are halfwords.
        wide: bool,
    },
    /// At the next instruction; from there on, as many instructions as this is long are conditional: true, if on the same
    /// condition as the first of them, false, if on the opposite one.
    Conditional(Condition),
    /// Nowhere: a permanently undefined instruction.
    Trap,
    /// Nowhere on this core: no instruction of it.
    Unknown,
}

/// What becomes of the stack pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stack {
    /// It stays.
    Same,
    /// It goes down by this many bytes; up, if negative.
    Down(i32),
    /// It gets a value that is not known before the program runs.
    Dynamic,
}

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Bytes.
    pub length: u32,
    /// Where execution goes on.
    pub flow: Flow,
    /// What becomes of the stack pointer.
    pub stack: Stack,
    /// Whether it may write the condition flags, also within an IT block.
    pub flags: bool,
}

/// Bits `low..low + count` of a halfword.
fn bits(half: u16, low: u32, count: u32) -> u16 {
    (half >> low) & ((1 << count) - 1)
}

/// A displacement of `bits` bits, with its sign.
fn signed(value: u32, bits: u32) -> u32 {
    (((value << (32 - bits)) as i32) >> (32 - bits)) as u32
}

/// The writeback of a base register.
fn written_back(base: u16, writes: bool, upwards: bool, bytes: u32) -> Stack {
    match (base == SP && writes, upwards) {
        (false, _) => Stack::Same,
        (true, true) => Stack::Down(-(bytes as i32)),
        (true, false) => Stack::Down(bytes as i32),
    }
}

/// The stack pointer after a calculation whose result goes to `register`.
fn calculated(register: u16) -> Stack {
    if register == SP { Stack::Dynamic } else { Stack::Same }
}

/// Decodes the instruction at `address`, which starts with the halfword `first`; `second` is the halfword after that (0 at the
/// end).
pub fn decode(address: u32, first: u16, second: u16) -> Instruction {
    let length = if first >= 0xe800 { 4 } else { 2 };
    let (flow, stack) = if length == 2 { narrow(address, first) } else { wide(address, first, second) };
    Instruction { length, flow, stack, flags: if length == 2 { compares(first) } else { sets_flags(first, second) } }
}

/// Instructions of one halfword.
fn narrow(address: u32, half: u16) -> (Flow, Stack) {
    let pc = address.wrapping_add(4);
    // Destination of the instructions that reach all registers.
    let destination = bits(half, 7, 1) << 3 | bits(half, 0, 3);
    let source = bits(half, 3, 4);
    let next = |stack| (Flow::Next, stack);
    let same = |flow| (flow, Stack::Same);
    match half >> 8 {
        0x44 | 0x46 if destination == PC => {
            same(if half >> 8 == 0x46 && source == LR { Flow::Return } else { Flow::JumpRegister })
        }
        0x44 | 0x46 => next(calculated(destination)),
        0x47 if half & 0x80 != 0 => same(Flow::CallRegister),
        0x47 => same(if source == LR { Flow::Return } else { Flow::JumpRegister }),
        0xb0 => {
            let bytes = 4 * i32::from(bits(half, 0, 7));
            next(Stack::Down(if half & 0x80 == 0 { -bytes } else { bytes }))
        }
        0xb1 | 0xb3 | 0xb9 | 0xbb => {
            same(Flow::Branch(pc.wrapping_add(u32::from(bits(half, 9, 1) << 6 | bits(half, 3, 5) << 1))))
        }
        0xb4 | 0xb5 => next(Stack::Down(4 * (half & 0x1ff).count_ones() as i32)),
        0xbc | 0xbd => {
            let flow = if half & 0x100 == 0 { Flow::Next } else { Flow::Return };
            (flow, Stack::Down(-4 * (half & 0x1ff).count_ones() as i32))
        }
        0xbf if half & 0xf != 0 => same(Flow::Conditional(condition(half))),
        0xd0..=0xdd => same(Flow::Branch(pc.wrapping_add(signed(u32::from(half & 0xff) << 1, 9)))),
        0xde => same(Flow::Trap),
        0xe0..=0xe7 => same(Flow::Jump(pc.wrapping_add(signed(u32::from(half & 0x7ff) << 1, 12)))),
        _ => next(Stack::Same),
    }
}

/// Instructions of two halfwords.
fn wide(address: u32, first: u16, second: u16) -> (Flow, Stack) {
    let next = |stack| (Flow::Next, stack);
    let destination = bits(second, 8, 4);
    match first >> 9 {
        0b111_0100 if first & 0x40 == 0 => multiple(first, second),
        0b111_0100 => dual(address, first, second),
        // Data processing. Comparisons alone may name the program counter where others name their destination.
        0b111_0101 | 0b111_1000..=0b111_1011
            if second & 0x8000 == 0 && destination == PC && (first & 0x10 == 0 || first & 0xfa00 == 0xf200) =>
        {
            (Flow::Unknown, Stack::Same)
        }
        // With a shifted register.
        0b111_0101 => next(calculated(destination)),
        // Floating-point loads and stores; VPUSH and VPOP are among them.
        0b111_0110 => next(written_back(
            bits(first, 0, 4),
            first & 0x20 != 0 && first & 0x180 != 0,
            first & 0x80 != 0,
            4 * u32::from(second & 0xff),
        )),
        0b111_1000..=0b111_1011 if second & 0x8000 != 0 => control(address, first, second),
        0b111_1000..=0b111_1011 => next(immediate(first, second)),
        0b111_1100 => single(address, first, second),
        // With registers; multiplications, some of which have a second destination.
        0b111_1101 if first & 0x100 == 0 => next(calculated(destination)),
        0b111_1101 if first & 0x80 == 0 => next(calculated(destination)),
        0b111_1101 if bits(second, 12, 4) == SP => next(Stack::Dynamic),
        0b111_1101 => next(calculated(destination)),
        // Moves from a coprocessor, which has no business with the stack pointer.
        _ => next(if first & 0x10 != 0 && second & 0x10 != 0 { calculated(bits(second, 12, 4)) } else { Stack::Same }),
    }
}

/// Branches with a long reach, and what moves special registers.
fn control(address: u32, first: u16, second: u16) -> (Flow, Stack) {
    let pc = address.wrapping_add(4);
    let [sign, j1, j2] = [bits(first, 10, 1), bits(second, 13, 1), bits(second, 11, 1)].map(u32::from);
    let far = || {
        let high = sign << 24 | (1 ^ j1 ^ sign) << 23 | (1 ^ j2 ^ sign) << 22;
        pc.wrapping_add(signed(high | u32::from(bits(first, 0, 10)) << 12 | u32::from(bits(second, 0, 11)) << 1, 25))
    };
    let same = |flow| (flow, Stack::Same);
    match second & 0x5000 {
        0x5000 => same(Flow::Call(far())),
        0x1000 => same(Flow::Jump(far())),
        0x4000 => same(Flow::Unknown),
        _ if bits(first, 7, 3) != 0b111 => {
            let high = sign << 20 | j2 << 19 | j1 << 18;
            same(Flow::Branch(
                pc.wrapping_add(signed(high | u32::from(bits(first, 0, 6)) << 12 | u32::from(bits(second, 0, 11)) << 1, 21)),
            ))
        }
        _ if first & 0xfff0 == 0xf7f0 => same(if second & 0xf000 == 0xa000 { Flow::Trap } else { Flow::Unknown }),
        // MSR to MSP, PSP, their limits, or CONTROL, which says which of the two is in use.
        _ if first & 0xffe0 == 0xf380 => {
            let special = matches!(second & 0xff, 8..=11 | 20);
            (Flow::Next, if special { Stack::Dynamic } else { Stack::Same })
        }
        _ if first & 0xffe0 == 0xf3e0 => (Flow::Next, calculated(bits(second, 8, 4))),
        _ => same(Flow::Next),
    }
}

/// Data processing with a constant.
fn immediate(first: u16, second: u16) -> Stack {
    let (base, destination) = (bits(first, 0, 4), bits(second, 8, 4));
    if destination != SP {
        return Stack::Same;
    }
    let code = bits(first, 10, 1) << 11 | bits(second, 12, 3) << 8 | bits(second, 0, 8);
    let (value, adds, subtracts) = match first & 0x200 {
        0 => (expanded(code), bits(first, 5, 4) == 8, bits(first, 5, 4) == 13),
        _ => (u32::from(code), bits(first, 4, 5) == 0, bits(first, 4, 5) == 10),
    };
    match (base == SP, adds, subtracts) {
        (true, true, _) => Stack::Down((value as i32).wrapping_neg()),
        (true, _, true) => Stack::Down(value as i32),
        _ => Stack::Dynamic,
    }
}

/// The 32 bits that a constant of 12 bits stands for.
fn expanded(code: u16) -> u32 {
    let byte = u32::from(code & 0xff);
    match code >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (byte | 0x80).rotate_right(u32::from(code >> 7)),
    }
}

/// Loads and stores of several registers.
fn multiple(first: u16, second: u16) -> (Flow, Stack) {
    let (base, loads) = (bits(first, 0, 4), first & 0x10 != 0);
    let upwards = match bits(first, 7, 2) {
        1 => true,
        2 => false,
        _ => return (Flow::Unknown, Stack::Same),
    };
    let flow = match (loads && second & 0x8000 != 0, base) {
        (false, _) => Flow::Next,
        (true, SP) => Flow::Return,
        (true, _) => Flow::JumpRegister,
    };
    let stack = written_back(base, first & 0x20 != 0, upwards, 4 * second.count_ones());
    (flow, if loads && second & (1 << SP) != 0 { Stack::Dynamic } else { stack })
}

/// Loads and stores of two registers, exclusive ones, and jumps by a table.
fn dual(address: u32, first: u16, second: u16) -> (Flow, Stack) {
    let (base, loads, writes) = (bits(first, 0, 4), first & 0x10 != 0, first & 0x20 != 0);
    if first & 0x120 == 0 {
        return match (first & 0xfff0 == 0xe8d0, bits(second, 5, 3)) {
            (true, 0) if base == PC => (Flow::Table { at: address.wrapping_add(4), wide: second & 0x10 != 0 }, Stack::Same),
            (true, 0) => (Flow::JumpRegister, Stack::Same),
            _ => (Flow::Next, if loads { calculated(bits(second, 12, 4)) } else { Stack::Same }),
        };
    }
    let into_sp = loads && (bits(second, 12, 4) == SP || bits(second, 8, 4) == SP);
    let stack = written_back(base, writes, first & 0x80 != 0, 4 * u32::from(second & 0xff));
    (Flow::Next, if into_sp { Stack::Dynamic } else { stack })
}

/// Loads and stores of one register.
fn single(address: u32, first: u16, second: u16) -> (Flow, Stack) {
    let (base, register) = (bits(first, 0, 4), bits(second, 12, 4));
    let (loads, word) = (first & 0x10 != 0, bits(first, 5, 2) == 2);
    let literal = loads && base == PC;
    let writes = !literal && first & 0x80 == 0 && second & 0x900 == 0x900;
    let stack = written_back(base, writes, second & 0x200 != 0, u32::from(second & 0xff));
    if !(loads && word && register == PC) {
        return (Flow::Next, if loads && register == SP { Stack::Dynamic } else { stack });
    }
    if literal {
        let offset = u32::from(second & 0xfff);
        let pc = address.wrapping_add(4) & !3;
        let at = if first & 0x80 != 0 { pc.wrapping_add(offset) } else { pc.wrapping_sub(offset) };
        return (Flow::JumpLiteral(at), Stack::Same);
    }
    (if base == SP && writes { Flow::Return } else { Flow::JumpRegister }, stack)
}
