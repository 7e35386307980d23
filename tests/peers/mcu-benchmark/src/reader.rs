//! The peers' networks: words in the order in which they are read, written by `tests/src/mcu/images.rs`.

/// What is left of an image.
pub(crate) struct Reader(&'static [u8]);

/// The image is shorter than it says.
const TORN: &str = "the image of the network ends too early";

impl Reader {
    /// At the image's first byte.
    pub(crate) fn new(image: &'static [u8]) -> Self {
        Self(image)
    }

    fn bytes(&mut self, count: usize) -> Result<&'static [u8], &'static str> {
        let (head, tail) = self.0.split_at_checked(count).ok_or(TORN)?;
        self.0 = tail;
        Ok(head)
    }

    /// One number.
    pub(crate) fn word(&mut self) -> Result<i32, &'static str> {
        Ok(self.integers(1)?[0])
    }

    /// One number that counts something.
    pub(crate) fn count(&mut self) -> Result<usize, &'static str> {
        Ok(self.word()? as usize)
    }

    /// The next `count` f32.
    pub(crate) fn floats(&mut self, count: usize) -> Result<&'static [f32], &'static str> {
        bytemuck::try_cast_slice(self.bytes(4 * count)?).map_err(|_| TORN)
    }

    /// The next `count` i32.
    pub(crate) fn integers(&mut self, count: usize) -> Result<&'static [i32], &'static str> {
        bytemuck::try_cast_slice(self.bytes(4 * count)?).map_err(|_| TORN)
    }

    /// The next `count` i8; the image goes on at a multiple of four.
    pub(crate) fn small(&mut self, count: usize) -> Result<&'static [i8], &'static str> {
        let padded = self.bytes(count.next_multiple_of(4))?;
        Ok(bytemuck::cast_slice(&padded[..count]))
    }
}

/// What follows a dense layer.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Activation {
    Linear,
    Relu,
    Tanh,
}

impl Activation {
    /// By its number in images.
    pub(crate) fn numbered(number: i32) -> Result<Self, &'static str> {
        match number {
            0 => Ok(Self::Linear),
            1 => Ok(Self::Relu),
            2 => Ok(Self::Tanh),
            _ => Err("unknown activation in the image of the network"),
        }
    }
}
