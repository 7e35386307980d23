//! The floats that laws and simulations run in.

/// f32 or f64.
pub trait Scalar: nalgebra::RealField + Copy {
    /// The nearest number to `value`.
    fn of(value: f64) -> Self;
    /// The same number in f64, exactly.
    fn wide(self) -> f64;
}

impl Scalar for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }

    fn wide(self) -> f64 {
        self.into()
    }
}

impl Scalar for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn wide(self) -> f64 {
        self
    }
}
