//! Why lanes trip, and how often they did.
//!
//! *in* the guard's decisions; *out* counts by reason and by lane; *never* another index for a reason in a later version;
//! *source* the judges of the guard.

/// Why a lane is off although it is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[repr(u8)]
pub enum Trip {
    /// Features outside of the training envelope (network lane).
    Envelope = 0,
    /// A measured or desired channel that is no finite number (both lanes).
    NotFinite = 1,
    /// A measurement that is too old (both lanes).
    Stale = 2,
    /// A correction at its limit or slew for too long (each lane that asks for more).
    Saturated = 3,
    /// The loop would track better without the lane (each lane by itself).
    Counterfactual = 4,
    /// Inferences that come too late (network lane).
    Late = 5,
    /// A limit cycle (feedback lane).
    Oscillation = 6,
    /// What swings of the error is hardly less than it would be without the lane, which drives it (feedback lane).
    Astray = 7,
}

impl Trip {
    /// All reasons, in the order of their indices.
    pub const ALL: [Self; 8] = [
        Self::Envelope,
        Self::NotFinite,
        Self::Stale,
        Self::Saturated,
        Self::Counterfactual,
        Self::Late,
        Self::Oscillation,
        Self::Astray,
    ];

    /// Index in [`Trips`]; the same in every version.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Name for tables and telemetry.
    pub fn name(self) -> &'static str {
        match self {
            Self::Envelope => "envelope",
            Self::NotFinite => "not_finite",
            Self::Stale => "stale",
            Self::Saturated => "saturated",
            Self::Counterfactual => "counterfactual",
            Self::Late => "late",
            Self::Oscillation => "oscillation",
            Self::Astray => "astray",
        }
    }
}

/// Trips since the start, by [`Trip::index`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trips {
    /// Of the network lane.
    pub network: [u16; Trip::ALL.len()],
    /// Of the feedback lane.
    pub feedback: [u16; Trip::ALL.len()],
}

impl Trips {
    /// None.
    pub const NONE: Self = Self { network: [0; Trip::ALL.len()], feedback: [0; Trip::ALL.len()] };

    /// Trips of the network lane and of the feedback lane.
    pub fn by_lane(&self) -> [u16; 2] {
        [self.network, self.feedback].map(|lane| lane.iter().fold(0, |sum, count| count.saturating_add(sum)))
    }

    /// Trips of both lanes for a reason.
    pub fn of(&self, trip: Trip) -> u16 {
        let count = |lane: &[u16]| lane.get(trip.index()).copied().unwrap_or(0);
        count(&self.network).saturating_add(count(&self.feedback))
    }
}
