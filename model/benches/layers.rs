//! What one layer costs: its matrix product with the two products of the backward pass, and its activation.
//!
//! Of a product an item is a floating point operation, so that `Gitem/s` are GFLOP/s; of an activation, an
//! element of all that passes through. README.md beside this file says how to read the numbers.

mod backends;

use std::fmt;

use burn::tensor::Tensor;
use divan::Bencher;
use divan::counter::ItemsCount;
use isomorph_model::autodiff::Activation;
use isomorph_model::autodiff::Lanes;
use isomorph_model::{ModelBackend, TrainBackend, product};

use backends::{numbers, on_each_backend};

fn main() {
    divan::main();
}

/// The softplus of the preset `paper`, and the sine that fits the ends best.
const ACTIVATIONS: [Activation; 2] = [
    Activation::Softplus { beta: 100.0 },
    Activation::Sine { omega: 20.0 },
];

/// A layer of so many inputs and outputs, that so many rows enter.
#[derive(Clone, Copy, Debug)]
struct Layer {
    rows: usize,
    inputs: usize,
    outputs: usize,
}

impl Layer {
    const fn new(rows: usize, inputs: usize, outputs: usize) -> Self {
        Self {
            rows,
            inputs,
            outputs,
        }
    }

    /// Operations of one product: the three have as many.
    fn flop(self) -> ItemsCount {
        ItemsCount::new(2 * self.rows * self.inputs * self.outputs)
    }

    /// What enters, `[rows, inputs]`.
    fn input<B: ModelBackend>(self) -> Tensor<B, 2> {
        numbers(self.rows, self.inputs)
    }

    /// The weights, `[inputs, outputs]`.
    fn weight<B: ModelBackend>(self) -> Tensor<B, 2> {
        numbers(self.inputs, self.outputs)
    }

    /// A gradient by what leaves, `[rows, outputs]`.
    fn grad<B: ModelBackend>(self) -> Tensor<B, 2> {
        numbers(self.rows, self.outputs)
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            rows,
            inputs,
            outputs,
        } = self;
        write!(out, "{rows} x {inputs} x {outputs}")
    }
}

/// Hidden layers of the sizes small, shipped and paper, the second as one core is given it too, alone and with
/// the five lanes of a sweep; then the first and the last layer of `V`, whose products are slim.
const LAYERS: [Layer; 7] = [
    Layer::new(1000, 128, 128),
    Layer::new(256, 256, 256),
    Layer::new(5 * 93, 256, 256),
    Layer::new(4000, 256, 256),
    Layer::new(4000, 512, 512),
    Layer::new(4000, 39, 256),
    Layer::new(4000, 256, 3),
];

/// Lanes of so many rows each, 256 columns wide, and what they pass through.
#[derive(Clone, Copy, Debug)]
struct Block {
    activation: Activation,
    rows: usize,
    lanes: Lanes,
}

impl Block {
    const COLUMNS: usize = 256;

    /// Elements of all lanes.
    fn elements(self) -> ItemsCount {
        ItemsCount::new(self.lanes.blocks() * self.rows * Self::COLUMNS)
    }

    /// What enters the activation, and the bias.
    fn tensors<B: ModelBackend>(self) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let z = numbers(self.lanes.blocks() * self.rows, Self::COLUMNS);
        (z, numbers(1, Self::COLUMNS))
    }
}

impl fmt::Display for Block {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.activation {
            Activation::Softplus { .. } => "softplus",
            Activation::Sine { .. } => "sine",
        };
        write!(out, "{name}, {} rows, value", self.rows)?;
        if self.lanes.tangents > 0 {
            write!(out, ", {} tangents", self.lanes.tangents)?;
        }
        if self.lanes.laplacian {
            write!(out, ", Laplacian")?;
        }
        Ok(())
    }
}

/// Every kind of lanes: in a core's cache, and far larger.
fn blocks() -> impl Iterator<Item = Block> {
    let kinds = [(0, false), (3, false), (4, false), (3, true), (4, true)];
    let sizes = ACTIVATIONS.map(|activation| [64, 4000].map(|rows| (activation, rows)));
    sizes
        .into_iter()
        .flatten()
        .flat_map(move |(activation, rows)| {
            kinds.map(|(tangents, laplacian)| Block {
                activation,
                rows,
                lanes: Lanes {
                    tangents,
                    laplacian,
                },
            })
        })
}

/// Times an activation and its backward pass, from a gradient that is an ordinary tensor.
fn activation_and_backward<B: TrainBackend>(bencher: Bencher<'_, '_>, block: Block) {
    let (z, bias) = block.tensors::<B>();
    let grad = z.clone();
    let (z, bias) = (z.require_grad(), bias.require_grad());
    bencher.counter(block.elements()).bench_local(|| {
        let out = block.activation.jet(z.clone(), bias.clone(), block.lanes);
        (out * grad.clone()).sum().backward()
    });
}

on_each_backend! {
    /// `h W`.
    #[divan::bench(args = LAYERS, sample_count = 20)]
    fn forward(bencher: Bencher<'_, '_>, layer: Layer) {
        let (h, w) = (layer.input::<Plain>(), layer.weight());
        bencher
            .counter(layer.flop())
            .bench_local(|| product(h.clone(), w.clone()));
    }

    /// `g W^T`.
    #[divan::bench(args = LAYERS, sample_count = 20)]
    fn backward_by_input(bencher: Bencher<'_, '_>, layer: Layer) {
        let (g, w) = (layer.grad::<Plain>(), layer.weight());
        bencher
            .counter(layer.flop())
            .bench_local(|| product(g.clone(), w.clone().transpose()));
    }

    /// `h^T g`.
    #[divan::bench(args = LAYERS, sample_count = 20)]
    fn backward_by_weights(bencher: Bencher<'_, '_>, layer: Layer) {
        let (h, g) = (layer.input::<Plain>(), layer.grad());
        bencher
            .counter(layer.flop())
            .bench_local(|| product(h.clone().transpose(), g.clone()));
    }

    /// The activation without a graph.
    #[divan::bench(args = blocks(), sample_count = 20)]
    fn activation(bencher: Bencher<'_, '_>, block: Block) {
        let (z, bias) = block.tensors::<Plain>();
        bencher
            .counter(block.elements())
            .bench_local(|| block.activation.jet(z.clone(), bias.clone(), block.lanes));
    }

    /// The activation with its backward pass, and a product and a sum to start that from.
    #[divan::bench(args = blocks(), sample_count = 20)]
    fn activation_trained(bencher: Bencher<'_, '_>, block: Block) {
        activation_and_backward::<Train>(bencher, block);
    }
}
