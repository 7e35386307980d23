//! Our kernels: whatever arithmetic the model file asks for.

use impromptu_firmware::{
    model::Model,
    network::{Network, Scratch},
};
use static_cell::StaticCell;

use crate::kernel::Kernel;

/// A network from a model file and the memory that it works in.
struct Engine {
    network: &'static Network<'static>,
    shape: (usize, usize),
    scratch: Scratch,
}

impl Kernel for Engine {
    fn shape(&self) -> (usize, usize) {
        self.shape
    }

    fn working_memory(&self) -> usize {
        4 * self.network.scratch_words()
    }

    fn evaluate(&mut self, inputs: &[f32], outputs: &mut [f32]) {
        self.network.evaluate(inputs, outputs, &mut self.scratch);
    }
}

/// Loads a model file.
pub(crate) fn load(file: &'static [u8]) -> Result<&'static mut dyn Kernel, &'static str> {
    static MODEL: StaticCell<Model<'static>> = StaticCell::new();
    static ENGINE: StaticCell<Engine> = StaticCell::new();
    let model = match Model::from_bytes(file) {
        Ok(model) => MODEL.init(model),
        Err(refusal) => {
            semihosting::eprintln!("{refusal}");
            return Err("the model file is refused");
        }
    };
    let card = model.card();
    let shape = (card.features.len(), card.outputs.len());
    let network = model.network().ok_or("the model file has no network")?;
    Ok(ENGINE.init(Engine { network, shape, scratch: Scratch::new() }))
}
