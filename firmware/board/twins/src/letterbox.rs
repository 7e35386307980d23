//! A way in and out of a WebAssembly module without imports or exports of its own: the host finds 16 bytes in the module's
//! memory.
//!
//! Behind [`MARKER`] lie the address and the length of an array of u32. Before the host calls `main` it writes there the number
//! of bytes of the cases and the cases; after that it finds the number of bytes of the outputs, the outputs, and behind their
//! last word the counts (cases, different, unaligned). A failure leaves [`FAILED`] instead of a number of bytes.

use std::{
    hint::black_box,
    sync::atomic::{AtomicU32, Ordering},
};

use impromptu_twins::Memory;

/// What the host looks for.
const MARKER: [u8; 16] = *b"impromptu twins.";
/// Words of the array.
const WORDS: usize = 1 << 20;
/// Instead of the number of bytes of the outputs.
const FAILED: u32 = u32::MAX;

#[repr(C)]
struct Letterbox {
    marker: [u8; 16],
    words: &'static [AtomicU32],
}

static PLACE: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];
static LETTERBOX: Letterbox = Letterbox { marker: MARKER, words: &PLACE };

/// Runs the cases in the letterbox.
pub(crate) fn run() {
    // The compiler shall not conclude that nobody else writes there.
    let Letterbox { marker, words } = black_box(&LETTERBOX);
    black_box(marker);
    let load = |word: &AtomicU32| word.load(Ordering::Relaxed);
    let (length, words) = words.split_first().expect("the array has words");
    let bytes = load(length) as usize;
    let cases: Vec<u8> = words.iter().take(bytes.div_ceil(4)).flat_map(|word| load(word).to_le_bytes()).collect();
    let mut outputs = Outputs(Vec::new());
    let mut memory = Box::new(Memory::<{ 64 * 1024 }>::new());
    let answer = match impromptu_twins::run(&mut &cases[..], &mut outputs, &mut memory, || ()) {
        Ok(counts) => {
            let bytes = outputs.0.len() as u32;
            outputs.0.extend([counts.cases, counts.different, counts.unaligned].into_iter().flat_map(u32::to_le_bytes));
            bytes
        }
        Err(_) => FAILED,
    };
    length.store(answer, Ordering::Relaxed);
    for (word, bytes) in words.iter().zip(outputs.0.as_chunks().0) {
        word.store(u32::from_le_bytes(*bytes), Ordering::Relaxed);
    }
}

/// Bytes that grow.
struct Outputs(Vec<u8>);

impl embedded_io::ErrorType for Outputs {
    type Error = core::convert::Infallible;
}

impl embedded_io::Write for Outputs {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
