//! Reads the request, lets the kernel work, writes the answer.
//!
//! `request.bin`: u32 kernel, u32 number of the network's image, u32 place of the weights (0 flash, 1 RAM), u32 rows, then the
//! inputs of each row in f32; `answer.bin`: u32 stack pointer of the caller, u32 bytes of working memory, u32 address of the
//! image, then the outputs of each row in f32. Little-endian.

use core::hint::black_box;

use impromptu_firmware::model::FileBuffer;
use semihosting::{
    fs::File,
    io::{Read, Write},
};
use static_cell::StaticCell;

use crate::{engine, kernel::measure};

/// Most inputs or outputs of a network.
const MAX_NUMBERS: usize = 64;
/// Bytes for weights in RAM: as much as the real chip's core-coupled memory has.
const RAM_WEIGHTS: usize = 64 * 1024;

/// On a boundary that suits every section of a model file.
#[repr(C, align(16))]
struct Aligned<T: ?Sized>(T);

include!(concat!(env!("OUT_DIR"), "/images.rs"));

/// The name puts it where memory.x puts weights.
static IMPROMPTU_WEIGHTS: StaticCell<FileBuffer<RAM_WEIGHTS>> = StaticCell::new();

/// Answers the request in the folder where the emulator was started.
pub(crate) fn run() -> Result<(), &'static str> {
    let mut request = File::open(c"request.bin").map_err(|_| "cannot open request.bin")?;
    let mut header = [0; 16];
    request.read_exact(&mut header).map_err(|_| "request.bin has no header")?;
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    // The compiler shall not evaluate an embedded network in the board's place.
    let range = IMAGES.get(word(4) as usize).ok_or("no such image in this binary")?.clone();
    let flash: &'static [u8] = black_box(BYTES).0.get(range).ok_or("an image out of range")?;
    let image = if word(8) == 1 {
        IMPROMPTU_WEIGHTS.init_with(FileBuffer::new).keep(flash).ok_or("the weights do not fit into the RAM for weights")?
    } else {
        flash
    };
    let kernel = match word(0) {
        0 => engine::load(image)?,
        #[cfg(peers)]
        1 => crate::plain::load(image)?,
        #[cfg(peers)]
        2 => crate::embedded_nn::load_float(image)?,
        #[cfg(peers)]
        3 => crate::embedded_nn::load_integer(image)?,
        #[cfg(peers)]
        4 => crate::microflow::load(image)?,
        _ => return Err("no such kernel in this binary"),
    };

    let (inputs, outputs) = kernel.shape();
    let (mut row, mut result) = ([0.0f32; MAX_NUMBERS], [0.0f32; MAX_NUMBERS]);
    let row = row.get_mut(..inputs).ok_or("too many inputs")?;
    let result = result.get_mut(..outputs).ok_or("too many outputs")?;
    let mut answer = File::create(c"answer.bin").map_err(|_| "cannot create answer.bin")?;
    let working_memory = kernel.working_memory() as u32;
    for index in 0..word(12) {
        for value in row.iter_mut() {
            let mut bytes = [0; 4];
            request.read_exact(&mut bytes).map_err(|_| "request.bin ends too early")?;
            *value = f32::from_le_bytes(bytes);
        }
        let stack_pointer = measure(kernel, row, result);
        if index == 0 {
            put(&mut answer, stack_pointer)?;
            put(&mut answer, working_memory)?;
            put(&mut answer, image.as_ptr().addr() as u32)?;
        }
        for value in result.iter() {
            put(&mut answer, value.to_bits())?;
        }
    }
    Ok(())
}

fn put(answer: &mut File, word: u32) -> Result<(), &'static str> {
    answer.write_all(&word.to_le_bytes()).map_err(|_| "cannot write answer.bin")
}
