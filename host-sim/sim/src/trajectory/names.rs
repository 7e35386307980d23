//! The catalogue's names.

/// The names that [`by_name`](super::by_name) understands; capitals are arguments, those in brackets have defaults.
pub const KNOWN_NAMES: [&str; 12] = [
    "strokes:SEED:INDEX",
    "circle",
    "figure8",
    "lissajous",
    "helix",
    "trefoil",
    "star",
    "letters:TEXT",
    "multisine:SEED[:SECONDS]",
    "spline:SEED[:SECONDS]",
    "tones[:SECONDS]",
    "tone:AXIS[:AMPLITUDE[:PERIOD]]",
];
