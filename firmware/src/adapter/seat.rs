//! A place for something that comes later.

use super::Guard;
use crate::model::Model;

/// An option that is all zeros while it is vacant, so that a static with it takes no flash: the compiler would mark an empty `Option`
/// with a byte of its own choice.
#[derive(Debug)]
#[repr(u8)]
pub(super) enum Seat<T> {
    Vacant = 0,
    Taken(T) = 1,
}

impl<T> Seat<T> {
    pub(super) fn as_ref(&self) -> Option<&T> {
        match self {
            Self::Vacant => None,
            Self::Taken(value) => Some(value),
        }
    }

    pub(super) fn as_mut(&mut self) -> Option<&mut T> {
        match self {
            Self::Vacant => None,
            Self::Taken(value) => Some(value),
        }
    }
}

/// The model that is flown, and its guard.
#[derive(Debug)]
pub(super) struct Tied<'m> {
    pub(super) model: &'m Model<'m>,
    pub(super) guard: Guard,
}

#[cfg(test)]
mod tests {
    use super::super::Adapter;
    use crate::{application::Application, flight::Flight};

    #[test]
    fn what_waits_for_a_model_is_all_zeros_and_takes_no_flash() {
        // Padding and what is not there have no value; the binary's size tells of them (tests/tests/image.rs).
        assert_eq!(Adapter::<3, 4, 2>::parked().weights(), [0.0; 2]);
        assert!(Flight::parked().adapter().is_none());
        assert!(Application::new().outbox().is_empty());
    }
}
