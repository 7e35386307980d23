//! Cases as the program in `firmware/board/twins` reads them, each with the bytes that this machine computes for it.

use anyhow::{Context, Result, anyhow, ensure};
use impromptu_firmware::{
    learning::{AHEAD, Learner, Limits, Measured, Parts, Response},
    model::Model,
    network::{
        Scratch,
        kernel::{Finish, Width, portable},
    },
};

/// Kinds of cases, see `firmware/board/twins/src/lib.rs`.
const NETWORK: u32 = 3;
const FLIGHT: u32 = 4;
const LEARNER: u32 = 5;
const END: u32 = 9;

/// What a layer does with its sums.
#[derive(Clone, Copy, Debug)]
pub enum Ending {
    /// Codes of an integer layer, or its sums.
    Integer(Width, Finish),
    /// f32 as they are, rectified, or their tanh.
    Float(FloatFinish),
}

/// What becomes of a sum in f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FloatFinish {
    /// Nothing.
    Linear,
    /// ReLU.
    Rectified,
    /// tanh.
    Tanh,
}

/// Cases in the order of a file.
#[derive(Clone, Debug, Default)]
pub struct Cases {
    bytes: Vec<u8>,
    /// What each of them is, and its outputs.
    expected: Vec<(String, Vec<u8>)>,
    /// Layers whose stream does not start at a word.
    unaligned: usize,
}

fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

impl Cases {
    /// Adds a layer with the words of its inputs, of its outputs and of its stream, which starts `offset` bytes behind a word.
    pub fn layer(&mut self, ending: Ending, inputs: &[u32], outputs: usize, stream: &[u32], offset: u32) {
        let (kind, finish, limit) = match ending {
            Ending::Integer(width, finish) => {
                let (number, limit) = match finish {
                    Finish::Codes { limit } => (0, limit),
                    Finish::Tanh { limit } => (1, limit),
                    Finish::Sums => (2, 0),
                    Finish::Linear { limit } => (3, limit),
                };
                (u32::from(width == Width::Int16), number, limit)
            }
            Ending::Float(finish) => (2, finish as u32, 0),
        };
        let count = |words: &[u32]| words.len() as u32;
        let header = [kind, count(inputs), outputs as u32, finish, limit.into(), count(stream), offset, 0];
        let little_endian: Vec<[u8; 4]> = stream.iter().map(|word| word.to_le_bytes()).collect();
        let mut expected = vec![0xdead_beef; outputs];
        match ending {
            Ending::Integer(width, finish) => portable::integer(width, &little_endian, inputs, finish, &mut expected),
            Ending::Float(finish) => {
                portable::float(&little_endian, inputs, finish == FloatFinish::Rectified, &mut expected);
                if finish == FloatFinish::Tanh {
                    portable::tanh(&mut expected);
                }
            }
        }
        self.add(&header, [bytes(inputs), bytes(stream)], (format!("layer {header:?}"), bytes(&expected)));
        self.unaligned += usize::from(offset > 0);
    }

    /// Adds a network: a model file and rows of its inputs.
    ///
    /// # Errors
    /// If the file is refused or has no network.
    pub fn network(&mut self, name: &str, file: &[u8], rows: &[Vec<f32>]) -> Result<()> {
        let model = Model::from_bytes(file).map_err(|refusal| anyhow!("{name}: {refusal}"))?;
        let network = model.network().with_context(|| format!("{name} has no network"))?;
        let (inputs, outputs) = (model.card().features.len(), model.card().outputs.len());
        let mut scratch = Scratch::new();
        let mut expected = Vec::new();
        for row in rows {
            ensure!(row.len() == inputs, "{name} takes {inputs} inputs, not {}", row.len());
            let mut result = vec![0.0; outputs];
            network.evaluate(row, &mut result, &mut scratch);
            expected.extend(result.iter().flat_map(|value| value.to_le_bytes()));
        }
        let header = [NETWORK, rows.len() as u32, inputs as u32, outputs as u32, file.len() as u32, 0, 0, 0];
        let data = rows.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        self.add(&header, [padded(file), data], (format!("network {name}"), expected));
        Ok(())
    }

    /// Adds a recorded flight with its model file and the answers of this machine.
    pub fn flight(&mut self, name: &str, file: &[u8], recording: &[u8], answers: &[u8]) {
        let header = [FLIGHT, file.len() as u32, 0, 0, 0, 0, 0, 0];
        self.add(&header, [padded(file), recording.to_vec()], (format!("flight {name}"), answers.to_vec()));
    }

    /// Adds a learner beside a loop: what is desired, from the first tick to [`AHEAD`] ticks behind the last one, and what is
    /// measured and its rate of change at each tick.
    ///
    /// # Errors
    /// If the lengths do not go together.
    pub fn learner(&mut self, name: &str, desired: &[f32], measured: &[[f32; 2]]) -> Result<()> {
        ensure!(desired.len() == measured.len() + AHEAD as usize, "{name}: {} values are desired", desired.len());
        let response = Response::second_order(1.0, 2.55, 0.78, 0.08, 100.0);
        let limits = Limits { scale: 1.0, correction: 2.0, feedback: 0.3, rate: 40.0 };
        let learner = response.and_then(|response| Learner::new(response, 100.0, 0.024, limits));
        let mut learner = learner.context("a learner")?;
        learner.start(desired[0]);
        let (mut expected, mut words) = (Vec::new(), Vec::new());
        for (tick, [value, rate]) in measured.iter().copied().enumerate() {
            let at = |offset: i32| desired[(tick as i32 + offset).max(0) as usize];
            let correction = learner.step(at, Some(Measured { value, rate: Some(rate) }), Parts::BOTH, Parts::BOTH);
            expected.push(correction.to_bits());
            words.extend([desired[tick + AHEAD as usize], value, rate].map(f32::to_bits));
        }
        let first: Vec<u32> = desired.iter().take(AHEAD as usize).map(|value| value.to_bits()).collect();
        let header = [LEARNER, measured.len() as u32, 0, 0, 0, 0, 0, 0];
        self.add(&header, [bytes(&first), bytes(&words)], (format!("learner {name}"), bytes(&expected)));
        Ok(())
    }

    fn add(&mut self, header: &[u32; 8], data: [Vec<u8>; 2], expected: (String, Vec<u8>)) {
        self.bytes.extend(bytes(header));
        self.bytes.extend(data.concat());
        self.expected.push(expected);
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.expected.len()
    }

    /// How many layers have a stream that does not start at a word.
    pub fn unaligned(&self) -> usize {
        self.unaligned
    }

    /// The file.
    pub fn file(&self) -> Vec<u8> {
        let end = bytes(&[END, 0, 0, 0, 0, 0, 0, 0]);
        [&self.bytes[..], &end].concat()
    }

    /// Compares the outputs of another machine with those of this one.
    ///
    /// # Errors
    /// If they are not the same bytes: with the first case that differs.
    pub fn compare(&self, found: &[u8]) -> Result<()> {
        let mut rest = found;
        for (index, (name, expected)) in self.expected.iter().enumerate() {
            let (case, after) =
                rest.split_at_checked(expected.len()).with_context(|| format!("no outputs of case {index}, {name}"))?;
            let differs = |(at, (found, expected)): (usize, (&[u8; 4], &[u8; 4]))| (found != expected).then_some(at);
            let words = |bytes| <[u8]>::as_chunks::<4>(bytes).0;
            if let Some(word) = words(case).iter().zip(words(expected)).enumerate().find_map(differs) {
                let of = |bytes| u32::from_le_bytes(words(bytes)[word]);
                return Err(anyhow!(
                    "case {index}, {name}: word {word} of the outputs is {:08x} there and {:08x} here",
                    of(case),
                    of(expected)
                ));
            }
            rest = after;
        }
        ensure!(rest.is_empty(), "{} bytes of outputs too many", rest.len());
        Ok(())
    }
}

/// A file filled up to whole words.
fn padded(file: &[u8]) -> Vec<u8> {
    let mut padded = file.to_vec();
    padded.resize(file.len().next_multiple_of(4), 0);
    padded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_other_bit_is_found_and_named() {
        let mut cases = Cases::default();
        for finish in [FloatFinish::Linear, FloatFinish::Tanh] {
            let stream: Vec<u32> = (0..18u32).map(|value| (value as f32).to_bits()).collect();
            cases.layer(Ending::Float(finish), &[0.5f32.to_bits(), 2.0f32.to_bits()], 6, &stream, 0);
        }
        let right: Vec<u8> = cases.expected.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
        assert_eq!(right.len(), 48);
        cases.compare(&right).unwrap();
        for (bit, place) in [(7, "case 0"), (8 * 30, "case 1")] {
            let mut wrong = right.clone();
            wrong[bit / 8] ^= 1 << (bit % 8);
            let error = cases.compare(&wrong).unwrap_err().to_string();
            assert!(error.starts_with(place), "{error}");
        }
        assert!(cases.compare(&right[1..]).is_err() && cases.compare(&[&right[..], &[0]].concat()).is_err());
    }
}
