//! The one multilayer perceptron that both networks are made of.
//!
//! ```text
//! h_0 = input,   h_{k+1} = s(h_k W_k + b_k) for k < depth,   output = h_depth W_depth + b_depth
//! ```
//!
//! With a skip connection at hidden layer `k`, that layer reads `[h_k, input] / sqrt(2)` (Park et al.
//! 2019; Gropp et al. 2020).

use burn::module::{Module, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};

use crate::autodiff::{Activation, Lanes, ModelBackend, product};

/// An affine layer, `x W + b`, of plain operations.
///
/// burn's own `Linear::forward` is one fused operation whose backward cannot be differentiated again.
#[derive(Module, Debug)]
pub struct Dense<B: Backend> {
    /// `[inputs, outputs]`.
    pub weight: Param<Tensor<B, 2>>,
    /// `[1, outputs]`.
    pub bias: Param<Tensor<B, 2>>,
}

impl<B: ModelBackend> Dense<B> {
    /// `[n, inputs]` to `[n, outputs]`.
    pub fn forward(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        self.linear(x) + self.bias.val()
    }

    /// `x W`: what a tangent passes through.
    pub fn linear(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        product(x, self.weight.val())
    }

    /// `g W^T`: what a cotangent passes back through, `[n, outputs]` to `[n, inputs]`.
    pub fn transposed(&self, g: Tensor<B, 2>) -> Tensor<B, 2> {
        product(g, self.weight.val().transpose())
    }
}

/// The weights of one layer on the host, from which a [`Dense`] is made.
#[derive(Clone, Debug)]
pub(crate) struct HostLayer {
    pub inputs: usize,
    pub outputs: usize,
    /// Row-major `[inputs, outputs]`.
    pub weight: Vec<f32>,
    pub bias: Vec<f32>,
}

/// The shape of a multilayer perceptron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MlpConfig {
    /// Columns of the input.
    pub inputs: usize,
    /// Columns of the output.
    pub outputs: usize,
    /// Hidden layers, at least 1.
    pub depth: usize,
    /// Columns of each hidden layer.
    pub width: usize,
    /// Applied after each hidden layer.
    pub activation: Activation,
    /// The hidden layer that reads the input again; 0 for none, else below `depth`.
    pub skip: usize,
}

impl MlpConfig {
    /// `(inputs, outputs)` of every layer, the skip connection counted in.
    pub fn layer_sizes(&self) -> Vec<(usize, usize)> {
        (0..=self.depth)
            .map(|k| {
                let repeated = if self.skip > 0 && k == self.skip {
                    self.inputs
                } else {
                    0
                };
                let inputs = if k == 0 {
                    self.inputs
                } else {
                    self.width + repeated
                };
                (
                    inputs,
                    if k == self.depth {
                        self.outputs
                    } else {
                        self.width
                    },
                )
            })
            .collect()
    }

    /// Floating point operations of the matrix products of one evaluation of one point.
    pub fn flop_per_point(&self) -> f64 {
        self.layer_sizes()
            .iter()
            .map(|(a, b)| 2.0 * (a * b) as f64)
            .sum()
    }

    pub(crate) fn init<B: Backend>(&self, layers: &[HostLayer], device: &B::Device) -> Mlp<B> {
        assert!(
            self.skip < self.depth.max(1),
            "skip {} in depth {}",
            self.skip,
            self.depth
        );
        let sizes = self.layer_sizes();
        let given: Vec<_> = layers
            .iter()
            .map(|layer| (layer.inputs, layer.outputs))
            .collect();
        assert_eq!(sizes, given, "layer sizes of the shape, and those given");
        // Initialised at once: a parameter of burn that was never read draws its weights when it is cloned, and the
        // clone would be another network.
        let parameter = |id: usize, values: &[f32], shape: [usize; 2]| {
            let tensor = Tensor::from_data(TensorData::new(values.to_vec(), shape), device);
            // Numbered, so that a checkpoint depends on nothing but the seed.
            Param::initialized(ParamId::from(id as u64), tensor.require_grad())
        };
        let layers = layers.iter().enumerate().map(|(k, layer)| Dense {
            weight: parameter(2 * k + 1, &layer.weight, [layer.inputs, layer.outputs]),
            bias: parameter(2 * k + 2, &layer.bias, [1, layer.outputs]),
        });
        Mlp {
            layers: layers.collect(),
            activation: self.activation,
            skip: self.skip,
        }
    }
}

/// A multilayer perceptron.
#[derive(Module, Debug)]
pub struct Mlp<B: Backend> {
    layers: Vec<Dense<B>>,
    #[module(skip)]
    activation: Activation,
    skip: usize,
}

impl<B: ModelBackend> Mlp<B> {
    /// `[n, inputs]` to `[n, outputs]`.
    pub fn forward(&self, input: Tensor<B, 2>) -> Tensor<B, 2> {
        self.output().forward(self.last_hidden(input))
    }

    /// What the output layer reads, `[n, width]`.
    pub(crate) fn last_hidden(&self, input: Tensor<B, 2>) -> Tensor<B, 2> {
        let mut hidden = input.clone();
        for (k, layer) in self.hidden().iter().enumerate() {
            let z = layer.linear(self.layer_input(k, hidden, &input));
            hidden = self.activation.jet(z, layer.bias.val(), Lanes::VALUE);
        }
        hidden
    }

    /// What hidden layer `k` reads: `hidden`, with `input` beside it at the skip connection.
    pub(crate) fn layer_input(
        &self,
        k: usize,
        hidden: Tensor<B, 2>,
        input: &Tensor<B, 2>,
    ) -> Tensor<B, 2> {
        if self.skips_at(k) {
            // Divided so that what the layer reads does not grow by what is put beside it.
            Tensor::cat(vec![hidden, input.clone()], 1) / 2f64.sqrt()
        } else {
            hidden
        }
    }

    pub(crate) fn skips_at(&self, k: usize) -> bool {
        self.skip > 0 && k == self.skip
    }

    pub(crate) fn hidden(&self) -> &[Dense<B>] {
        &self.layers[..self.layers.len() - 1]
    }

    pub(crate) fn output(&self) -> &Dense<B> {
        &self.layers[self.layers.len() - 1]
    }

    /// Puts another output layer in the place of this one.
    pub(crate) fn put_output(&mut self, output: Dense<B>) {
        let last = self.layers.len() - 1;
        self.layers[last] = output;
    }

    /// The weight matrices between two hidden layers: not those that read the input or give the output.
    pub(crate) fn hidden_weights(&self) -> Vec<ParamId> {
        let between = self.hidden().iter().skip(1);
        between.map(|layer| layer.weight.id).collect()
    }

    pub(crate) fn activation(&self) -> Activation {
        self.activation
    }
}
