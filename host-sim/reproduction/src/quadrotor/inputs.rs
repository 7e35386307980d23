//! The paper's two lists of network inputs, as data.
//!
//! *in* the origin of differences; *out* a list of [`Feature`]s; *never* other than 12 or 36; *source* Zhou 2017, section V-B.
//! What differs: desired angles and body rates are not stored with a trajectory; in their places stand the desired accelerations
//! which they follow from (flatness), now and one tick later, and the heading.

use impromptu_firmware::features::{Feature, Relative, Source};

/// What differences of the desired trajectory are taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The desired state, now.
    Desired,
    /// The measured state, now.
    Measured,
    /// Nothing: absolute values.
    Nothing,
}

impl Origin {
    /// The same in words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Desired => "y_d",
            Self::Measured => "y",
            Self::Nothing => "nothing",
        }
    }

    fn of(self, channel: u8) -> Relative {
        match self {
            Self::Desired => Relative::Desired(channel),
            Self::Measured => Relative::Measured(channel),
            Self::Nothing => Relative::Nothing,
        }
    }
}

fn desired(channel: u8, offset: i16, relative: Relative) -> Feature {
    Feature { source: Source::Desired, channel, offset, relative }
}

fn measured(channel: u8) -> Feature {
    Feature { source: Source::Measured, channel, offset: 0, relative: Relative::Nothing }
}

/// Position and velocity differences at the relative degrees (4, 4, 2 ticks), attitude, body rates.
pub fn twelve(origin: Origin) -> Vec<Feature> {
    with_degrees([4, 4, 2], origin)
}

/// The same 12 inputs with other relative degrees, in ticks.
pub fn with_degrees(degrees: [i16; 3], origin: Origin) -> Vec<Feature> {
    let mut list: Vec<Feature> = Vec::with_capacity(12);
    for velocity in [0u8, 1] {
        list.extend((0..3u8).zip(degrees).map(|(axis, degree)| {
            let channel = axis + 3 * velocity;
            desired(channel, (degree - i16::from(velocity)).max(1), origin.of(channel))
        }));
    }
    list.extend((6..12).map(measured));
    list
}

/// Everything 4 and 6 ticks ahead: positions against `origin` (the paper: the measured one), all else absolute.
pub fn thirty_six(origin: Origin) -> Vec<Feature> {
    let mut list: Vec<Feature> = Vec::with_capacity(36);
    for offset in [4, 6] {
        list.extend((0..3).map(|channel| desired(channel, offset, origin.of(channel))));
        list.extend((3..6).map(|channel| desired(channel, offset, Relative::Nothing)));
        // Roll, pitch and yaw; their rates, by what they are a tick later; the vertical acceleration.
        list.extend([6, 7, 9].map(|channel| desired(channel, offset, Relative::Nothing)));
        list.extend([6, 7, 9].map(|channel| desired(channel, offset + 1, Relative::Nothing)));
        list.push(desired(8, offset, Relative::Nothing));
    }
    list.extend((3..13).map(measured));
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_as_many_inputs_as_the_paper_says() {
        for origin in [Origin::Desired, Origin::Measured, Origin::Nothing] {
            assert_eq!((twelve(origin).len(), thirty_six(origin).len()), (12, 36));
        }
        let offsets: Vec<i16> = twelve(Origin::Desired).iter().take(6).map(|feature| feature.offset).collect();
        assert_eq!(offsets, [4, 4, 2, 3, 3, 1]);
    }
}
