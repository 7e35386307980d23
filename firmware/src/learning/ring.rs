//! The past of a signal.
//!
//! *in* a value a tick; *out* the one of so many ticks before; *never* a number that is not finite; *source* ours.

use crate::math::finite_or_zero;

/// The newest `N` values of a signal.
#[derive(Clone, Debug)]
pub(super) struct Ring<const N: usize> {
    values: [f32; N],
    newest: usize,
}

impl<const N: usize> Ring<N> {
    pub(super) fn filled(value: f32) -> Self {
        Self { values: [value; N], newest: 0 }
    }

    pub(super) fn push(&mut self, value: f32) {
        self.newest = (self.newest + 1) % N;
        if let Some(place) = self.values.get_mut(self.newest) {
            *place = finite_or_zero(value);
        }
    }

    /// The value of so many ticks, less than `N`, before the newest one.
    pub(super) fn past(&self, ticks: usize) -> f32 {
        let place = (self.newest + N).saturating_sub(ticks) % N;
        self.values.get(place).copied().unwrap_or(0.0)
    }
}
