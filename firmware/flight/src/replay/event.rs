//! The calls of the flight stack as records.
//!
//! *in* calls; *out* records of a fixed size, and back; *never* a bit that is lost; *source* the table in [`super`].

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::{RECORD, RecordingError};
use impromptu_firmware::adapter::Lanes;

use crate::{
    flight::Flight,
    types::{Setpoint, State},
};

const TICK: u32 = 1;
const SETPOINT: u32 = 2;
const LANES: u32 = 3;
const DITHER: u32 = 4;
const END: u32 = 5;

/// One call of the flight stack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// [`Flight::step`] with this state; ticks count from 0.
    Tick(State),
    /// [`Flight::push_setpoint`].
    Setpoint(Setpoint),
    /// The adapter's lanes are switched.
    Lanes(Lanes),
    /// [`Flight::set_dither`], m, world ENU.
    Dither(Vector3<f32>),
    /// The flight ends.
    End {
        /// Ticks recorded.
        ticks: u32,
    },
}

impl Event {
    /// The event's record.
    pub fn to_bytes(&self) -> [u8; RECORD] {
        match self {
            Self::Tick(state) => {
                let State { position: p, velocity: v, attitude, rates: w, vertical_acceleration } = state;
                let Quaternion { coords: q } = *attitude.quaternion();
                record(
                    TICK,
                    [p.x, p.y, p.z, v.x, v.y, v.z, q.w, q.x, q.y, q.z, w.x, w.y, w.z, *vertical_acceleration].map(f32::to_bits),
                )
            }
            Self::Setpoint(setpoint) => {
                let Setpoint { position: p, velocity: v, acceleration: a, yaw } = setpoint;
                record(SETPOINT, [p.x, p.y, p.z, v.x, v.y, v.z, a.x, a.y, a.z, *yaw].map(f32::to_bits))
            }
            Self::Lanes(lanes) => record(LANES, [u32::from(lanes.network) | (u32::from(lanes.feedback) << 1)]),
            Self::Dither(offset) => record(DITHER, [offset.x, offset.y, offset.z].map(f32::to_bits)),
            Self::End { ticks } => record(END, [*ticks]),
        }
    }

    /// Reads a record.
    ///
    /// # Errors
    /// If its kind is unknown or a number is not finite.
    pub fn from_bytes(bytes: &[u8; RECORD]) -> Result<Self, RecordingError> {
        let mut words = [0; RECORD / 4];
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        let [kind, values @ ..] = words;
        let event = match kind {
            LANES => return Ok(Self::Lanes(Lanes { network: values[0] & 1 != 0, feedback: values[0] & 2 != 0 })),
            END => return Ok(Self::End { ticks: values[0] }),
            TICK | SETPOINT | DITHER => values.map(f32::from_bits),
            found => return Err(RecordingError::Kind { found }),
        };
        if !event.iter().all(|value| value.is_finite()) {
            return Err(RecordingError::NotFinite);
        }
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n] = event;
        let (first, second) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
        Ok(match kind {
            TICK => Self::Tick(State {
                position: first,
                velocity: second,
                // Normalising would change the bits.
                attitude: UnitQuaternion::new_unchecked(Quaternion::new(g, h, i, j)),
                rates: Vector3::new(k, l, m),
                vertical_acceleration: n,
            }),
            SETPOINT => {
                Self::Setpoint(Setpoint { position: first, velocity: second, acceleration: Vector3::new(g, h, i), yaw: j })
            }
            _ => Self::Dither(first),
        })
    }

    /// Makes the call again, unless it is a tick (whose answer the caller wants) or the end.
    pub fn prepare(&self, flight: &mut Flight<'_>) {
        match self {
            Self::Setpoint(setpoint) => {
                flight.push_setpoint(setpoint);
            }
            Self::Dither(offset) => flight.set_dither(*offset),
            Self::Lanes(lanes) => {
                if let Some(adapter) = flight.adapter() {
                    adapter.switch(*lanes);
                }
            }
            Self::Tick(_) | Self::End { .. } => {}
        }
    }
}

fn record<const N: usize>(kind: u32, values: [u32; N]) -> [u8; RECORD] {
    let mut bytes = [0; RECORD];
    for (place, word) in bytes.as_chunks_mut().0.iter_mut().zip(core::iter::once(kind).chain(values)) {
        *place = word.to_le_bytes();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn records_keep_every_bit_or_are_refused(kind in 0u32..7, mut words in any::<[u32; 14]>()) {
            let used = match kind { TICK => 14, SETPOINT => 10, DITHER => 3, _ => 1 };
            words[used..].fill(0);
            if kind == LANES {
                words[0] &= 3;
            }
            let bytes = record(kind, words);
            match Event::from_bytes(&bytes) {
                Ok(event) => prop_assert_eq!(event.to_bytes(), bytes),
                Err(RecordingError::Kind { found }) => prop_assert!(found == kind && !(TICK..=END).contains(&kind)),
                Err(error) => {
                    prop_assert_eq!(error, RecordingError::NotFinite);
                    prop_assert!(words.iter().any(|word| !f32::from_bits(*word).is_finite()));
                }
            }
        }
    }
}
