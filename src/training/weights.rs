//! The weights of trained networks as plain arrays, under the names of their places: for programs other than
//! isomorph.

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use isomorph_model::SplineGrid;

/// An array of weights.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedTensor {
    /// Where it stands, such as `velocity.mlp.layers.0.weight`.
    pub name: String,
    /// Its sides.
    pub shape: Vec<usize>,
    /// Its numbers, the last side running fastest.
    pub values: Vec<f32>,
}

/// What a method has learned, as arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    /// All arrays.
    pub tensors: Vec<NamedTensor>,
    /// Steps of the integrator over all of time, where a flow carries the geometry between two key frames.
    pub flow_steps: Option<usize>,
    /// The grid of the velocity's coefficients, where it is of splines.
    pub grid: Option<SplineGrid>,
    /// From each key frame to the next, where there are more than two.
    pub intervals: Vec<IntervalWeights>,
}

/// What it takes to evaluate networks from one key frame to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct IntervalWeights {
    /// Its ends, in a time from 0 to 1.
    pub ends: [f64; 2],
    /// The functions of time of the velocity's outputs that act there, three for each, as `a + b u + c u^2` with `u` from
    /// 0 to 1 within the interval: those of its number and of the two after it. The velocity is per length of the
    /// interval.
    pub functions: [[f64; 3]; 3],
    /// Steps of the integrator over the interval.
    pub steps: usize,
}

impl Weights {
    /// Adds the arrays of a network, whose names begin with `name`.
    pub(crate) fn add<B: Backend>(&mut self, name: &str, net: &impl Module<B>) {
        let mut collector = Collector {
            place: vec![name.to_owned()],
            found: &mut self.tensors,
        };
        net.visit(&mut collector);
    }
}

struct Collector<'a> {
    place: Vec<String>,
    found: &'a mut Vec<NamedTensor>,
}

impl<B: Backend> ModuleVisitor<B> for Collector<'_> {
    fn enter_module(&mut self, name: &str, _: &str) {
        self.place.push(name.to_owned());
    }

    fn exit_module(&mut self, _: &str, _: &str) {
        self.place.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        let tensor = param.val();
        self.found.push(NamedTensor {
            name: self.place.join("."),
            shape: tensor.dims().to_vec(),
            values: tensor.into_data().iter::<f32>().collect(),
        });
    }
}
