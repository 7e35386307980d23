//! The kernels that are compared, and what each of them cannot do.

use impromptu_model_export::Precision;

use super::{images::Form, nets::Net};

/// A way to evaluate a network.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// Name in the table.
    pub name: &'static str,
    /// What it reads.
    pub form: Form,
    /// Its number on the board (`tests/peers/mcu-benchmark/src/request.rs`).
    pub number: u32,
}

/// All kernels, ours first.
pub const KERNELS: &[Kernel] = &[
    Kernel { name: "int8", form: Form::Model(Precision::Int8), number: OURS },
    Kernel { name: "int16", form: Form::Model(Precision::Int16), number: OURS },
    Kernel { name: "f32", form: Form::Model(Precision::Float), number: OURS },
    Kernel { name: "plain_f32", form: Form::Float, number: 1 },
    Kernel { name: "embedded_nn", form: Form::Integer, number: 3 },
    Kernel { name: "embedded_nn_f32", form: Form::Float, number: 2 },
    Kernel { name: "microflow", form: Form::Integer, number: MICROFLOW },
];

const OURS: u32 = 0;
const MICROFLOW: u32 = 4;

impl Kernel {
    /// Whether it is one of ours: those share a binary, the others another, because flash is too small for all networks.
    pub fn is_ours(&self) -> bool {
        self.number == OURS
    }

    /// Whether the board can copy its weights to RAM before it starts. Those of microflow are constants of its code.
    pub fn takes_weights_in_ram(&self) -> bool {
        self.number != MICROFLOW
    }

    /// Why it cannot evaluate a network, if it cannot.
    pub fn refusal(&self, net: &Net) -> Option<&'static str> {
        match self.form {
            Form::Integer if net.is_plain_relu() => None,
            Form::Integer if self.number == MICROFLOW => Some("has no tanh"),
            Form::Integer => Some("its int8 tanh takes no input scale"),
            _ => None,
        }
    }
}
