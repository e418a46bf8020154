//! The gradient of each term against differences of its values, on every backend.

use burn::module::{AutodiffModule, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use crate::autodiff::{Activation, TrainBackend};
use crate::flow::trajectory::{Integrator, Steps, integrate};
use crate::flow::transport::transport;
use crate::loss::*;
use crate::nets::{ImplicitNet, ImplicitNetConfig, VelocityNet, VelocityNetConfig};
use crate::operators::{Derivatives, ImplicitJet, Operators, VelocityJet, VelocityRequest};
use crate::testing::{column, host, points, shaken};

/// What a term is made of, on the training backend.
struct Scene<B: TrainBackend> {
    f: ImplicitNet<B>,
    v: VelocityNet<B>,
    derivatives: Derivatives,
}

const X: [[f64; 3]; 3] = [[0.3, -0.2, 0.1], [-0.35, 0.15, 0.2], [0.05, 0.4, -0.3]];

impl<B: TrainBackend> Scene<B> {
    fn new(derivatives: Derivatives) -> Self {
        let activation = Activation::Softplus { beta: 5.0 };
        let (depth, width, frequencies, skip) = (2, 8, 1, 0);
        let sphere_radius = 0.35;
        let f = ImplicitNetConfig {
            depth,
            width,
            activation,
            frequencies,
            skip,
            sphere_radius,
        };
        let v = VelocityNetConfig {
            depth,
            width,
            activation,
            frequencies,
            skip,
            time_dependent: true,
        };
        let device = Default::default();
        Self {
            f: shaken(f.init(3, &device), 0.2),
            v: shaken(v.init(4, &device), 0.2),
            derivatives,
        }
    }

    fn f_jet(&self) -> ImplicitJet<B> {
        self.derivatives
            .implicit_jet(&self.f, points(&X), column(&[0.1, 0.5, 0.9]))
    }

    fn v_jet(&self) -> VelocityJet<B> {
        let request = VelocityRequest {
            laplacian: true,
            rate: true,
        };
        self.derivatives
            .velocity_jet(&self.v, points(&X), column(&[0.1, 0.5, 0.9]), request)
    }

    fn carried(&self) -> Tensor<B, 2> {
        let rhs = |x, t| self.v.forward(x, t);
        let (from, to) = (column(&[0.0, 1.0, 0.0]), column(&[0.7, 0.2, 1.0]));
        integrate(
            rhs,
            points(&X),
            from,
            to,
            Steps::Even(2),
            Integrator::Midpoint,
        )
    }

    fn carried_jet(&self) -> ImplicitJet<B> {
        self.derivatives
            .implicit_jet(&self.f, self.carried(), column(&[0.7, 0.2, 1.0]))
    }

    /// The normals arrive as constants, as the learner gives them.
    fn carried_normals(&self) -> Tensor<B, 2> {
        let normals = points(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]);
        let (from, to) = (column(&[0.0, 1.0, 0.0]), column(&[0.7, 0.2, 1.0]));
        let (steps, method) = (Steps::Even(2), Integrator::Midpoint);
        let still = self.v.valid();
        let (_, n) = transport(
            &self.derivatives,
            &still,
            points(&X),
            normals,
            from,
            to,
            steps,
            method,
        );
        Tensor::from_inner(n)
    }
}

/// Moves the weights along their gradient, scaled so that the whole step has length `length`.
struct Along<'a, B: TrainBackend> {
    gradients: &'a GradientsParams,
    length: f64,
    backend: std::marker::PhantomData<B>,
}

impl<B: TrainBackend> ModuleMapper<B> for Along<'_, B> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
        let id = param.id;
        param.map(
            |weights| match self.gradients.get::<B::InnerBackend, D>(id) {
                None => weights,
                Some(gradient) => {
                    Tensor::from_inner(weights.inner() + gradient * self.length).require_grad()
                }
            },
        )
    }
}

/// The squared length of the gradient.
struct Length<'a>(&'a GradientsParams, f64);

impl<B: TrainBackend> ModuleVisitor<B> for Length<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<B, D>>) {
        if let Some(gradient) = self.0.get::<B::InnerBackend, D>(param.id) {
            self.1 += host(gradient).iter().map(|g| g * g).sum::<f64>();
        }
    }
}

/// The slope of `term` along its own gradient by the weights of a network is the gradient's length.
fn check_network<B: TrainBackend, M: AutodiffModule<B>>(
    label: &str,
    net: &M,
    with: impl Fn(M) -> Scene<B>,
    term: fn(&Scene<B>) -> Tensor<B, 1>,
) {
    let here = with(net.clone());
    let gradients = GradientsParams::from_grads(term(&here).backward(), net);
    let mut visitor = Length(&gradients, 0.0);
    net.visit(&mut visitor);
    let slope = visitor.1.sqrt();
    assert!(slope > 1e-4, "{label}: the gradient is {slope}");
    let step = 4e-3;
    let at = |length: f64| {
        let backend = std::marker::PhantomData;
        let gradients = &gradients;
        let length = length / slope;
        host(term(&with(net.clone().map(&mut Along::<B> {
            gradients,
            length,
            backend,
        }))))[0]
    };
    let difference = (at(step) - at(-step)) / (2.0 * step);
    // Truncation, step^2 times a third derivative of size 10 to 1000, and f32 rounding of values of size
    // 1 over the step: 1e-4 of 1; together below two per cent of the slope.
    let bound = 0.02 * slope + 2e-4;
    assert!(
        (difference - slope).abs() < bound,
        "{label}: {difference}, gradient {slope}"
    );
}

/// Every term: by which network it must move, and how it is made.
#[expect(clippy::type_complexity, reason = "a table of functions")]
fn terms<B: TrainBackend>() -> Vec<(&'static str, bool, bool, fn(&Scene<B>) -> Tensor<B, 1>)> {
    vec![
        ("data", true, false, |s| data::data(s.f_jet().value)),
        ("on-surface", true, true, |s| {
            data::data(s.carried_jet().value)
        }),
        ("matching", false, true, |s| {
            matching::matching(s.carried(), points(&[[0.0, 0.1, 0.2]; 3]), 0.0)
        }),
        ("robust matching", false, true, |s| {
            matching::matching(s.carried(), points(&[[0.0, 0.1, 0.2]; 3]), 0.3)
        }),
        ("mlse", true, true, |s| {
            level_set::level_set(&s.f_jet(), &s.v_jet(), 1.0)
        }),
        ("olse", true, true, |s| {
            level_set::level_set(&s.f_jet(), &s.v_jet(), 0.0)
        }),
        ("eikonal", true, false, |s| {
            eikonal::eikonal(s.f_jet().slope())
        }),
        ("normals", true, false, |s| {
            normals::normals(&s.f_jet(), points(&[[0.0, 0.6, 0.8]; 3]))
        }),
        ("transported-normals", true, true, |s| {
            normals::normals(&s.carried_jet(), s.carried_normals().detach())
        }),
        ("smoothness", false, true, |s| {
            smoothness::smoothness(&s.v_jet(), 0.01, 1.0)
        }),
        ("divergence", false, true, |s| {
            divergence::divergence(&s.v_jet())
        }),
        ("strain", false, true, |s| strain::strain(&s.v_jet(), 0.0)),
        ("strain of a scale", false, true, |s| {
            strain::strain(&s.v_jet(), 0.3)
        }),
        ("screw", false, true, |s| screw::screw(&s.v_jet())),
        ("distance", true, false, |s| {
            distance::distance(s.f_jet().value, column(&[0.4, -0.3, 0.2]))
        }),
        ("off-surface", true, false, |s| {
            // Scaled down: farther out the penalty is too flat to measure.
            off_surface::off_surface(s.f_jet().value * 0.01)
        }),
    ]
}

fn gradients_reach_the_weights<B: TrainBackend>() {
    for derivatives in [Derivatives::Nested, Derivatives::Forward] {
        for (name, by_f, by_v, term) in terms::<B>() {
            let scene = Scene::<B>::new(derivatives);
            let label = format!("{name}, {derivatives:?}");
            if by_f {
                let with = |f| Scene {
                    f,
                    v: scene.v.clone(),
                    derivatives,
                };
                check_network(&format!("{label}, by f"), &scene.f, with, term);
            }
            // The carried normal is a constant of the step, so its term has no full derivative by V.
            if by_v && name != "transported-normals" {
                let with = |v| Scene {
                    f: scene.f.clone(),
                    v,
                    derivatives,
                };
                check_network(&format!("{label}, by V"), &scene.v, with, term);
            }
        }
    }
}

#[test]
fn the_gradient_of_every_term_reaches_the_weights_on_ndarray() {
    gradients_reach_the_weights::<burn_autodiff::Autodiff<burn_ndarray::NdArray>>();
}

#[cfg(feature = "flex")]
#[test]
fn the_gradient_of_every_term_reaches_the_weights_on_flex() {
    gradients_reach_the_weights::<burn_autodiff::Autodiff<burn_flex::Flex>>();
}

#[cfg(feature = "wgpu")]
#[test]
fn the_gradient_of_every_term_reaches_the_weights_on_wgpu() {
    gradients_reach_the_weights::<burn_autodiff::Autodiff<burn_wgpu::Wgpu>>();
}
