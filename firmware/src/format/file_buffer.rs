//! Where a model file can lie other than in flash: memory that is read without wait states.
//!
//! At 168 MHz the STM32F4 reads flash in lines of 16 bytes with five wait states, and weights are read once: each line is a miss.
//! From RAM or the core-coupled memory every load takes its one cycle. A [`FileBuffer`] in a static whose name contains
//! `IMPROMPTU_WEIGHTS` is put by memory.x where the board wants its weights; start-up code clears it like any other static, and
//! [`FileBuffer::keep`] copies the file.
//!
//! ```
//! use impromptu_firmware::model::{Model, FileBuffer};
//! use static_cell::StaticCell;
//!
//! static IMPROMPTU_WEIGHTS: StaticCell<FileBuffer<65_536>> = StaticCell::new();
//!
//! fn load(flash: &[u8]) -> Option<Model<'static>> {
//!     let file = IMPROMPTU_WEIGHTS.init_with(FileBuffer::new).keep(flash)?;
//!     Model::from_bytes(file).ok()
//! }
//! assert!(load(b"damaged").is_none());
//! ```

/// Memory for a model file of at most `BYTES` bytes, on a boundary that suits every section.
#[derive(Debug)]
#[repr(C, align(16))]
pub struct FileBuffer<const BYTES: usize>([u8; BYTES]);

impl<const BYTES: usize> FileBuffer<BYTES> {
    /// Zeroed memory.
    pub const fn new() -> Self {
        Self([0; BYTES])
    }

    /// Copies `file` here, where it stays; nothing if it is too long. Its check sum is
    /// [`Model::from_bytes`](crate::model::Model::from_bytes)' affair.
    pub fn keep(&mut self, file: &[u8]) -> Option<&[u8]> {
        let place = self.0.get_mut(..file.len())?;
        place.copy_from_slice(file);
        Some(place)
    }

    /// Lets `read` write a file here, of the length that it returns.
    pub fn fill(&mut self, read: impl FnOnce(&mut [u8]) -> usize) -> &[u8] {
        let length = read(&mut self.0);
        self.0.get(..length).unwrap_or_default()
    }
}

impl<const BYTES: usize> Default for FileBuffer<BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_kept_on_a_boundary_of_16_bytes_and_one_that_is_too_long_is_not() {
        let mut place = FileBuffer::<5>::new();
        let kept = place.keep(b"12345").unwrap();
        assert_eq!(kept, b"12345");
        assert_eq!(kept.as_ptr().align_offset(16), 0);
        assert_eq!(place.keep(b"123456"), None);
    }
}
