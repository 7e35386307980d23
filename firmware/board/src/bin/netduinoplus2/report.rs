//! What a flight cost, as one line of JSON.

use core::fmt::{self, Write};

use impromptu_firmware::model::Model;
use impromptu_flight::flight::Flight;

use crate::instruments::StageCost;

/// Instructions of each stage.
#[derive(Default)]
pub(crate) struct Cost {
    /// Checking the model file, probes included.
    pub(crate) load: StageCost,
    /// A tick of the attitude loop alone.
    attitude: StageCost,
    /// A tick with the position loop and, if there is one, the add-on between two sub-rate ticks.
    position: StageCost,
    /// A tick with the position loop and the add-on's sub-rate tick: the inference, if the network lane is on.
    sub_rate: StageCost,
}

impl Cost {
    /// The stage that a control tick belongs to; the divisors count control ticks.
    pub(crate) fn of(&mut self, tick: u32, reference: u32, sub_rate: Option<u32>) -> &mut StageCost {
        if sub_rate.is_some_and(|divisor| tick.is_multiple_of(divisor)) {
            &mut self.sub_rate
        } else if tick.is_multiple_of(reference) {
            &mut self.position
        } else {
            &mut self.attitude
        }
    }
}

/// A JSON object of the stages that ran.
impl fmt::Display for Cost {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stages =
            [("load", &self.load), ("attitude", &self.attitude), ("position", &self.position), ("sub_rate", &self.sub_rate)];
        let mut separator = '{';
        for (name, stage) in stages.into_iter().filter(|(_, stage)| stage.has_run()) {
            write!(formatter, "{separator}\"{name}\":{stage}")?;
            separator = ',';
        }
        formatter.write_str(if separator == '{' { "{}" } else { "}" })
    }
}

/// Which model was flown; displayed as a JSON object.
pub(crate) struct ModelReport<'m> {
    name: &'m str,
    checksum: u32,
    multiply_adds: u32,
}

impl<'m> From<&Model<'m>> for ModelReport<'m> {
    fn from(model: &Model<'m>) -> Self {
        let network = model.network().map_or(0, |network| network.multiply_adds());
        let lane = model.feedback().map_or(0, |lane| lane.multiply_adds());
        Self { name: model.card().name, checksum: model.checksum(), multiply_adds: network + lane }
    }
}

impl fmt::Display for ModelReport<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("{\"name\":\"")?;
        for character in self.name.chars() {
            match character {
                '"' | '\\' => write!(formatter, "\\{character}")?,
                '\0'..' ' => write!(formatter, "\\u{:04x}", u32::from(character))?,
                _ => formatter.write_char(character)?,
            }
        }
        write!(formatter, "\",\"checksum\":\"{:08x}\",\"multiply_adds\":{}}}", self.checksum, self.multiply_adds)
    }
}

/// What a flight cost; displayed as a JSON object.
pub(crate) struct Report<'m> {
    pub(crate) model: Option<ModelReport<'m>>,
    pub(crate) ticks: u32,
    pub(crate) cost: Cost,
    /// Deepest stack while the model was checked, bytes.
    pub(crate) stack_load: u32,
    /// Deepest stack in flight, bytes.
    pub(crate) stack_flight: u32,
    /// Room for the stack, bytes.
    pub(crate) stack_size: u32,
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { model, ticks, cost, stack_load, stack_flight, stack_size } = self;
        formatter.write_str("{\"board\":\"netduinoplus2\",\"model\":")?;
        match model {
            Some(model) => write!(formatter, "{model}")?,
            None => formatter.write_str("null")?,
        }
        write!(
            formatter,
            ",\"ticks\":{ticks},\"instructions\":{cost},\
             \"stack_bytes\":{{\"load\":{stack_load},\"flight\":{stack_flight},\"size\":{stack_size}}},\
             \"static_bytes\":{{\"model\":{},\"flight\":{}}}}}",
            size_of::<Model<'_>>(),
            size_of::<Flight<'_>>()
        )
    }
}
