//! The two lanes, on or off.
//!
//! *in* the user's wish or the guard's verdict; *out* a switch for each lane; *never* a third lane; *source* the add-on's
//! structure in the crate's first page.

use serde::{Deserialize, Serialize};

/// Which lanes act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lanes {
    /// The network lane.
    pub network: bool,
    /// The feedback lane.
    pub feedback: bool,
}

impl Lanes {
    /// Both lanes.
    pub const BOTH: Self = Self { network: true, feedback: true };
    /// No lane: the loop gets the desired reference, to the bit.
    pub const NONE: Self = Self { network: false, feedback: false };
}
