//! What an undecodable card has too much of.
//!
//! *in* a card that does not decode; *out* the list that is longer than this build holds, by name; *never* more than a second reading of
//! the same bytes, with the lists counted and not kept; *source* the fields of [`super::Card`], in the same order.
//! Without this a model for a larger build would be refused as damaged.

use core::{fmt, marker::PhantomData};

use serde::{
    Deserialize, Deserializer,
    de::{SeqAccess, Visitor},
};

use super::{
    Arithmetic, Authority, Channel, LayerLayout, MAX_AXES, MAX_CHANNELS, MAX_ERRORS, MAX_FEATURES, MAX_INPUTS, MAX_LAYERS,
    MAX_OUTPUTS, Margins, Output, Provenance, Refusal, Section, Timing,
};
use crate::features::Feature;

/// A list of any length: how many, and what `largest` finds in them.
struct Count<T> {
    items: usize,
    largest: usize,
    kind: PhantomData<T>,
}

/// The longest list inside one item of a list.
trait Inner {
    fn inner(&self) -> usize {
        0
    }
}

impl Inner for Channel<'_> {}
impl Inner for Feature {}
impl Inner for Output {}
impl Inner for LayerLayout {}
impl Inner for (u8, u8) {}
impl Inner for u8 {}
impl Inner for MonitoredAxis {
    fn inner(&self) -> usize {
        self.inputs.items
    }
}
impl Inner for Axis {
    fn inner(&self) -> usize {
        self.errors.items
    }
}

impl<'de, T: Deserialize<'de> + Inner> Deserialize<'de> for Count<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Counting<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de> + Inner> Visitor<'de> for Counting<T> {
            type Value = Count<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Count<T>, A::Error> {
                let mut count = Count { items: 0, largest: 0, kind: PhantomData };
                while let Some(item) = list.next_element::<T>()? {
                    count.items += 1;
                    count.largest = count.largest.max(item.inner());
                }
                Ok(count)
            }
        }
        deserializer.deserialize_seq(Counting(PhantomData))
    }
}

#[derive(Deserialize)]
struct Signals<'a> {
    #[serde(borrow)]
    desired: Count<Channel<'a>>,
    #[serde(borrow)]
    measured: Count<Channel<'a>>,
    #[serde(borrow)]
    reference: Count<Channel<'a>>,
}

#[derive(Deserialize)]
struct Network {
    _arithmetic: Arithmetic,
    _input_normalisation: Section,
    _input_code: f32,
    layers: Count<LayerLayout>,
    _skip: Section,
    _output_normalisation: Section,
}

#[derive(Deserialize)]
struct Axis {
    _output: u8,
    errors: Count<(u8, u8)>,
    _coefficients: Section,
    _integral: f32,
    _fast_limit: f32,
    _integral_limit: f32,
}

#[derive(Deserialize)]
struct Lane {
    _lags: u8,
    axes: Count<Axis>,
    _authority: Authority,
    _margins: Margins,
}

#[derive(Deserialize)]
struct MonitoredAxis {
    _error: (u8, u8),
    inputs: Count<u8>,
    _taps: Section,
}

#[derive(Deserialize)]
struct Monitor {
    _divisor: u16,
    _taps: u8,
    _promise: f32,
    axes: Count<MonitoredAxis>,
}

#[derive(Deserialize)]
struct Counts<'a> {
    _name: &'a str,
    #[serde(borrow)]
    _provenance: Provenance<'a>,
    #[serde(borrow)]
    signals: Signals<'a>,
    _timing: Timing,
    features: Count<Feature>,
    outputs: Count<Output>,
    network: Option<Network>,
    lane: Option<Lane>,
    monitor: Option<Monitor>,
}

/// Why a card that does not decode is refused.
pub(super) fn refusal(card: &[u8]) -> Refusal {
    let Ok((counts, _)) = postcard::take_from_bytes::<Counts<'_>>(card) else { return Refusal::Card };
    let layers = counts.network.map_or(0, |network| network.layers.items);
    let (axes, errors) = counts.lane.map_or((0, 0), |lane| (lane.axes.items, lane.axes.largest));
    let (monitored, inputs) = counts.monitor.map_or((0, 0), |monitor| (monitor.axes.items, monitor.axes.largest));
    let lists = [
        ("number of desired channels", counts.signals.desired.items, MAX_CHANNELS),
        ("number of measured channels", counts.signals.measured.items, MAX_CHANNELS),
        ("number of reference channels", counts.signals.reference.items, MAX_CHANNELS),
        ("number of features", counts.features.items, MAX_FEATURES),
        ("number of outputs", counts.outputs.items, MAX_OUTPUTS),
        ("number of layers", layers, MAX_LAYERS),
        ("number of lane axes", axes, MAX_AXES),
        ("number of lane errors", errors, MAX_ERRORS),
        ("number of monitor axes", monitored, MAX_AXES),
        ("number of monitor inputs", inputs, MAX_INPUTS),
    ];
    lists.into_iter().find(|(_, found, limit)| found > limit).map_or(Refusal::Card, |(what, found, limit)| Refusal::Shape {
        what,
        found: u32::try_from(found).unwrap_or(u32::MAX),
        limit: limit as u32,
    })
}
