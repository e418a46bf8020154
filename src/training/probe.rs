//! The operations of a run in its own shapes, as plain numbers: what a device computes can so be held against what
//! another one does. burn has open reports of wrong products on some drivers (tracel-ai/burn#5122, #4966, #4355).

use burn::module::{AutodiffModule, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Tensor, TensorData};
use isomorph_model::autodiff::activation::Activation;
use isomorph_model::operators::{Operators, VelocityRequest};
use isomorph_model::{ModelBackend, TrainBackend, product};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::recipe::Recipe;
use crate::settings::Settings;

/// What one operation gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The operation.
    pub operation: Operation,
    /// What it was applied to, as in `2000 x 64 by 64 x 64`.
    pub shape: String,
    /// The numbers, in parts that have a size of their own: one for each array of weights.
    pub parts: Vec<Vec<f32>>,
}

/// What a device is tried with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// A product of two matrices.
    Product,
    /// The activation of a hidden layer.
    Activation,
    /// The sums of columns.
    Sums,
    /// The gradient of terms of `f` by all weights, through its own derivatives by position.
    GradientOfF,
    /// The same of `V`.
    GradientOfV,
}

/// What the networks of a recipe and their layers give on a device, for as many points as a step has.
pub fn readings<B: TrainBackend>(recipe: &Recipe, device: &B::Device) -> Vec<Reading> {
    let settings = Settings::new(recipe);
    let points = settings.training.batch;
    let layers = [
        (settings.implicit.width, settings.implicit.activation),
        (settings.velocity.width, settings.velocity.activation),
    ];
    let mut found = layer::<B::InnerBackend>(points, layers[0], device);
    if layers[1] != layers[0] {
        found.extend(layer::<B::InnerBackend>(points, layers[1], device));
    }
    found.push(gradient_of_f::<B>(&settings, device));
    found.push(gradient_of_v::<B>(&settings, device));
    found
}

/// The parts of a hidden layer.
fn layer<B: ModelBackend>(
    points: usize,
    (width, activation): (usize, Activation),
    device: &B::Device,
) -> Vec<Reading> {
    let matrix = |rows, seed, size| {
        let data = TensorData::new(numbers(rows * width, seed, size), [rows, width]);
        Tensor::<B, 2>::from_data(data, device)
    };
    let reading = |operation, shape, tensor: Tensor<B, 2>| Reading {
        operation,
        shape,
        parts: vec![read(tensor)],
    };
    let (a, w) = (
        matrix(points, 1, 1.0),
        matrix(width, 2, (3.0 / width as f32).sqrt()),
    );
    let z = product(a, w);
    let out = activation.value(z.clone());
    let whole = format!("{points} x {width}");
    vec![
        reading(
            Operation::Product,
            format!("{whole} by {width} x {width}"),
            z,
        ),
        reading(Operation::Activation, whole.clone(), out.clone()),
        reading(Operation::Sums, whole, (out.clone() * out).sum_dim(0)),
    ]
}

/// The gradient of the mean of `f^2 + (|grad f| - 1)^2`.
fn gradient_of_f<B: TrainBackend>(settings: &Settings, device: &B::Device) -> Reading {
    let net = settings.implicit.init::<B>(settings.training.seed, device);
    let (x, t) = samples(settings, device);
    let jet = settings.derivatives.implicit_jet(&net, x, t);
    let off = jet.slope() - 1.0;
    let objective = (jet.value.clone() * jet.value).mean() + (off.clone() * off).mean();
    Reading {
        operation: Operation::GradientOfF,
        shape: shape_of(settings, settings.implicit.depth, settings.implicit.width),
        parts: gradient(&net, objective),
    }
}

/// The gradient of the mean of `|V|^2 + |J|^2`, and of the squared Laplacian where the recipe has it.
fn gradient_of_v<B: TrainBackend>(settings: &Settings, device: &B::Device) -> Reading {
    let net = settings.velocity.init::<B>(settings.training.seed, device);
    let (x, t) = samples(settings, device);
    let request = VelocityRequest {
        laplacian: settings.loss.smoothness > 0.0,
        rate: false,
    };
    let jet = settings.derivatives.velocity_jet(&net, x, t, request);
    let mut objective =
        (jet.value.clone() * jet.value).mean() + (jet.jacobian.clone() * jet.jacobian).mean();
    if let Some(laplacian) = jet.laplacian {
        objective = objective + (laplacian.clone() * laplacian).mean();
    }
    Reading {
        operation: Operation::GradientOfV,
        shape: shape_of(settings, settings.velocity.depth, settings.velocity.width),
        parts: gradient(&net, objective),
    }
}

fn shape_of(settings: &Settings, depth: usize, width: usize) -> String {
    format!(
        "{} points, {depth} layers of {width}",
        settings.training.batch
    )
}

/// Positions and times of as many points as a step has.
fn samples<B: TrainBackend>(
    settings: &Settings,
    device: &B::Device,
) -> (Tensor<B, 2>, Tensor<B, 2>) {
    let points = settings.training.batch;
    let tensor = |columns: usize, seed| {
        let data = TensorData::new(numbers(points * columns, seed, 0.5), [points, columns]);
        Tensor::from_data(data, device)
    };
    (tensor(3, 3), tensor(1, 4) + 0.5)
}

/// Even numbers between `-size` and `size`.
fn numbers(count: usize, seed: u64, size: f32) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| rng.random_range(-size..size)).collect()
}

fn read<B: ModelBackend, const D: usize>(tensor: Tensor<B, D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

/// The gradient of an objective by each array of weights, in their order.
fn gradient<B: TrainBackend, M: AutodiffModule<B>>(
    net: &M,
    objective: Tensor<B, 1>,
) -> Vec<Vec<f32>> {
    let mut gradients = objective.backward();
    let mut collected = Collected {
        gradients: &GradientsParams::from_module(&mut gradients, net),
        parts: Vec::new(),
    };
    net.visit(&mut collected);
    collected.parts
}

/// The gradients of a network on the host.
struct Collected<'a> {
    gradients: &'a GradientsParams,
    parts: Vec<Vec<f32>>,
}

impl<B: TrainBackend> ModuleVisitor<B> for Collected<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if let Some(gradient) = self.gradients.get::<B::InnerBackend, D>(param.id) {
            self.parts.push(read(gradient));
        }
    }
}
