//! The loop's response to corrections, checked: what [`crate::format::MonitorLayout`] points to.
//!
//! *in* a layout and the blob; *out* responses whose lengths are the layout's; *never* a divisor of 0; *source* the monitor that
//! `model-export` writes.

use heapless::Vec;

use crate::format::{Blob, DEFAULT_AXES, Floats, MonitorAxis, MonitorLayout, Refusal};

/// A checked monitor.
#[derive(Debug)]
pub struct Monitor<'a, const A: usize = DEFAULT_AXES> {
    divisor: u16,
    taps: usize,
    validated_rms: f32,
    axes: Vec<(MonitorAxis, Floats<'a>), A>,
}

impl<'a, const A: usize> Monitor<'a, A> {
    /// Checks the sections of a layout against the blob.
    ///
    /// # Errors
    /// With the section that is wrong.
    pub fn new(layout: &MonitorLayout<A>, blob: &Blob<'a>) -> Result<Self, Refusal> {
        let taps = usize::from(layout.taps);
        let mut axes = Vec::new();
        for axis in &layout.axes {
            let response = blob.floats(axis.taps, axis.inputs.len() * taps, "monitor taps")?;
            let _ = axes.push((axis.clone(), response));
        }
        Ok(Self { divisor: layout.divisor.max(1), taps, validated_rms: layout.validated_rms, axes })
    }

    /// Reference ticks in a monitor tick.
    pub fn divisor(&self) -> u16 {
        self.divisor
    }

    /// Monitor ticks that a response lasts.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// RMS of the error that validation flights showed with the add-on.
    pub fn validated_rms(&self) -> f32 {
        self.validated_rms
    }

    /// The axes with their responses, input by input.
    pub fn axes(&self) -> &[(MonitorAxis, Floats<'a>)] {
        &self.axes
    }
}
