//! The network lane's work, apart from the control loop: features in, correction out.
//!
//! *in* the features of one sub-rate tick; *out* the network's outputs for it; *never* anything else that is shared with the
//! control loop, so that a task of lower priority can do it.

use crate::{
    format::{DEFAULT_OUTPUTS, MAX_FEATURES},
    network::{Network, Scratch, meant},
};

/// One evaluation of the network that is to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Reference tick at which it was released.
    pub tick: i32,
    /// The model's features, in physical units; what is behind the last is not read.
    pub inputs: [f32; MAX_FEATURES],
}

/// One evaluation of the network that was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Inference<const O: usize = DEFAULT_OUTPUTS> {
    /// Reference tick of its [`Job`].
    pub tick: i32,
    /// Correction of each output of the model.
    pub outputs: [f32; O],
}

impl Job {
    /// Where one is put.
    pub const EMPTY: Self = Self { tick: 0, inputs: [0.0; MAX_FEATURES] };

    /// Evaluates the network. A correction that is no number, or larger than any that is believed, was not meant and is zero;
    /// with a scratch of fewer words than the network needs each one is.
    pub fn run<const S: usize>(&self, network: &Network<'_>, scratch: &mut Scratch<S>) -> Inference {
        self.run_sized(network, scratch)
    }

    /// [`Job::run`] of a model whose limits its type says.
    pub fn run_sized<const S: usize, const O: usize>(&self, network: &Network<'_>, scratch: &mut Scratch<S>) -> Inference<O> {
        let mut outputs = [0.0; O];
        network.evaluate(&self.inputs, &mut outputs, scratch);
        Inference { tick: self.tick, outputs: outputs.map(meant) }
    }
}
