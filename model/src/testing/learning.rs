//! What the tests of methods share: spheres to learn, a short training, and the check that a term's
//! gradient is the slope of its values.

use burn::module::{AutodiffModule, ModuleMapper, ModuleVisitor, Param};
use burn::optim::{AdamConfig, GradientsParams, Optimizer};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::{column, host, points};
use crate::autodiff::{Activation, ModelBackend, TrainBackend};
use crate::flow::end_terms::{EndSamples, EndWeights};
use crate::flow::morph::Geometry;
use crate::nets::ImplicitNetConfig;
pub(crate) use crate::nets::implicit_net::directions;
use crate::objective::Objective;

/// A network small enough to be trained within a second, softplus of sharpness `beta`.
pub(crate) fn small(beta: f64) -> ImplicitNetConfig {
    ImplicitNetConfig {
        depth: 2,
        width: 24,
        activation: Activation::Softplus { beta },
        frequencies: 0,
        skip: 0,
        sphere_radius: 0.35,
    }
}

/// As [`small`], of sines.
pub(crate) fn small_siren(omega: f64) -> ImplicitNetConfig {
    ImplicitNetConfig {
        activation: Activation::Sine { omega },
        ..small(1.0)
    }
}

/// All five terms.
pub(crate) fn end_weights() -> EndWeights {
    EndWeights {
        data: 1.0,
        normals: 0.1,
        eikonal: 0.1,
        off_surface: 0.01,
        distance: 0.1,
    }
}

/// `count` samples on each of two spheres around the origin, and as many in space around them.
pub(crate) fn spheres<B: Backend>(count: usize, radii: [f64; 2]) -> EndSamples<B> {
    let lattice = directions(count);
    let scaled = |by: &dyn Fn(usize) -> f64| -> Vec<[f64; 3]> {
        let point = |(k, d): (usize, &[f64; 3])| d.map(|c| c * by(k));
        lattice.iter().enumerate().map(point).collect()
    };
    // Not in step with the lattice's angles, which are multiples of 0.618 of a turn.
    let spread = |k: usize| 0.05 + 0.65 * (0.755 * k as f64).fract();
    let times = [vec![0.0; count], vec![1.0; count]].concat();
    let surface = radii.map(|radius| scaled(&|_| radius)).concat();
    let distances = radii.map(|radius| (0..count).map(|k| spread(k) - radius).collect::<Vec<_>>());
    EndSamples {
        surface: points(&surface),
        surface_times: column(&times),
        normals: Some(points(&[lattice.clone(), lattice.clone()].concat())),
        space: points(&[scaled(&spread), scaled(&spread)].concat()),
        space_times: column(&times),
        distances: Some(column(&distances.concat())),
    }
}

/// The mean distance from the origin at which `f(., t)` first turns positive.
pub(crate) fn radius<B: ModelBackend>(geometry: &impl Geometry<B>, t: f64) -> f64 {
    let (lattice, shells, step) = (directions(24), 80, 0.01);
    let sum: f64 = lattice
        .iter()
        .map(|d| {
            let ray: Vec<_> = (0..shells)
                .map(|k| d.map(|c| c * step * (k + 1) as f64))
                .collect();
            let times = column(&vec![t; shells]);
            let values = host(geometry.value(points::<B>(&ray), times));
            let outside = values
                .iter()
                .position(|f| *f > 0.0)
                .expect("the box reaches outside");
            assert!(outside > 0, "f is positive at the centre");
            let (a, b) = (values[outside - 1], values[outside]);
            step * (outside as f64 + a / (a - b))
        })
        .sum();
    sum / lattice.len() as f64
}

/// The network after some steps of Adam down the objective.
pub(crate) fn trained<B: TrainBackend, M: AutodiffModule<B>>(
    net: M,
    steps: usize,
    rate: f64,
    objective: impl Fn(&M) -> Objective<B>,
) -> M {
    let mut net = net;
    let mut adam = AdamConfig::new().with_epsilon(1e-8).init::<B, M>();
    for step in 0..steps {
        let total = objective(&net).total().expect("some weight is not 0");
        let gradients = GradientsParams::from_grads(total.backward(), &net);
        // Down to a tenth at the end, along a cosine.
        let turn = std::f64::consts::PI * step as f64 / steps as f64;
        net = adam.step(rate * (0.55 + 0.45 * turn.cos()), net, gradients);
    }
    net
}

/// The slope of each term along its own gradient by the weights is the gradient's length, and not 0.
pub(crate) fn check_gradients<B: TrainBackend, M: AutodiffModule<B>>(
    net: &M,
    objective: impl Fn(&M) -> Objective<B>,
) {
    let names: Vec<_> = objective(net)
        .terms()
        .iter()
        .map(|term| term.name)
        .collect();
    assert!(!names.is_empty(), "no terms");
    for (k, name) in names.into_iter().enumerate() {
        let term = |net: &M| objective(net).terms()[k].value.clone();
        let gradients = GradientsParams::from_grads(term(net).backward(), net);
        let mut squares = Squares(&gradients, 0.0);
        net.visit(&mut squares);
        let slope = squares.1.sqrt();
        assert!(slope > 1e-4, "{name}: the gradient is {slope}");
        let at = |by: f64| {
            let length = by / slope;
            let moved = net.clone().map(&mut Along {
                gradients: &gradients,
                length,
            });
            host(term(&moved))[0]
        };
        // No more than changes the term by 1 % of itself: the penalty off the surface bends soon, and
        // absolute values have corners.
        let step = (0.01 * host(term(net))[0] / slope).min(2e-3);
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Truncation, step^2 times a third derivative of size 10 to 1000, and f32 rounding of values of
        // size 1 over the step: 1e-4 of 1; together below two per cent of the slope.
        let bound = 0.02 * slope + 2e-4;
        assert!(
            (difference - slope).abs() < bound,
            "{name}: {difference}, gradient {slope}"
        );
    }
}

/// Moves the weights along their gradient.
struct Along<'a> {
    gradients: &'a GradientsParams,
    length: f64,
}

impl<B: TrainBackend> ModuleMapper<B> for Along<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        let Some(gradient) = self.gradients.get::<B::InnerBackend, D>(param.id) else {
            return param;
        };
        param.map(|weights| {
            Tensor::from_inner(weights.inner() + gradient * self.length).require_grad()
        })
    }
}

/// The squared length of the gradient.
struct Squares<'a>(&'a GradientsParams, f64);

impl<B: TrainBackend> ModuleVisitor<B> for Squares<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if let Some(gradient) = self.0.get::<B::InnerBackend, D>(param.id) {
            self.1 += host(gradient).iter().map(|g| g * g).sum::<f64>();
        }
    }
}
