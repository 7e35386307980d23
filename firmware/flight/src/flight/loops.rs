//! The loops of a vehicle, ready to be closed.
//!
//! *in* settings; *out* position loop, attitude loop and mixer; *never* of settings that no vehicle has; *source*
//! [`crate::control`].

use core::num::NonZeroU32;

use crate::{
    control::{AttitudeLoop, Mixer, PositionLoop},
    settings::{Rates, Settings},
};

/// The loops of a vehicle.
#[derive(Debug)]
pub(super) struct Loops {
    pub(super) rates: Rates,
    pub(super) position_divisor: NonZeroU32,
    pub(super) position: PositionLoop,
    pub(super) attitude: AttitudeLoop,
    pub(super) mixer: Mixer,
}

impl Loops {
    /// `None` if no vehicle has these settings.
    pub(super) fn new(settings: &Settings) -> Option<Self> {
        settings.check().ok()?;
        Some(Self {
            rates: settings.rates,
            position_divisor: NonZeroU32::new(settings.rates.position_divisor).unwrap_or(NonZeroU32::MIN),
            position: PositionLoop::new(settings.position, settings.airframe.mass, settings.rates.reference_hz()),
            attitude: AttitudeLoop::new(settings.attitude, settings.airframe.inertia),
            mixer: Mixer::new(&settings.airframe)?,
        })
    }
}
