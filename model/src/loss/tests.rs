//! Each term on hand-worked points, and the gradient of each against differences of its values.

use burn::module::{AutodiffModule, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::Tensor;

use super::*;
use crate::activation::Activation;
use crate::backend::TrainBackend;
use crate::implicit_net::{ImplicitNet, ImplicitNetConfig};
use crate::operators::{
    Derivatives, ImplicitJet, Operators, VelocityJet, VelocityRequest, transport,
};
use crate::testing::{Plain, column, host, points, shaken};
use crate::trajectory::{Integrator, Steps, integrate};
use crate::velocity_net::{VelocityNet, VelocityNetConfig};

fn jet(value: &[f64], gradient: &[[f64; 3]], rate: &[f64]) -> ImplicitJet<Plain> {
    ImplicitJet {
        value: column(value),
        gradient: points(gradient),
        rate: column(rate),
    }
}

/// `V = x`.
fn expansion(x: &[[f64; 3]]) -> VelocityJet<Plain> {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].repeat(x.len());
    VelocityJet {
        value: points(x),
        jacobian: points::<Plain>(&identity).reshape([x.len(), 3, 3]),
        laplacian: Some(points(&vec![[0.0, 3.0, 0.0]; x.len()])),
        rate: Some(points(&vec![[0.0, 0.0, 2.0]; x.len()])),
    }
}

fn scalar(term: Tensor<Plain, 1>) -> f64 {
    host(term)[0]
}

#[track_caller]
fn assert_near(got: f64, wanted: f64) {
    // Means of at most three f32 numbers of size 1 to 10.
    assert!((got - wanted).abs() < 2e-5, "{got}, wanted {wanted}");
}

#[test]
fn the_terms_on_hand_worked_points() {
    assert_near(scalar(data::data(column(&[0.5, -1.5]))), 1.0);
    assert_near(scalar(eikonal::eikonal(column(&[1.0, 3.0]))), 2.0);
    let f = jet(
        &[0.0, 0.0],
        &[[2.0, 0.0, 0.0], [0.0, 3.0, 0.0]],
        &[0.0, 0.0],
    );
    let given = points(&[[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    assert_near(scalar(normals::normals(&f, given)), 1.0);
    let (a, b) = (points(&[[3.0, 4.0, 0.0]]), points(&[[0.0, 0.0, 0.0]]));
    assert_near(scalar(matching::matching(a.clone(), b.clone(), 0.0)), 5.0);
    assert_near(scalar(matching::matching(a, b, 2.5)), 2.5 * 4.0 / 5.0);
    let v = expansion(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    assert_near(scalar(divergence::divergence(&v)), 3.0);
    assert_near(scalar(strain::strain(&v, 0.0)), 3.0);
    assert_near(scalar(strain::strain(&v, 1.0)), 2.0);
    assert_near(scalar(deviatoric::deviatoric(&v)), 0.0);
    assert_near(scalar(steadiness::steadiness(&v)), 4.0);
    // V_t + J V = (0, 0, 2) + x.
    assert_near(scalar(acceleration::acceleration(&v)), (5.0 + 8.0) / 2.0);
    // V_t + D V is the same where J = I.
    assert_near(scalar(screw::screw(&v)), (5.0 + 8.0) / 2.0);
    let upwards = points(&[[0.0, 0.0, 1.0]; 2]);
    assert_near(scalar(stretch::stretch(&v, upwards)), 2.0);
    // V - 0.5 * (0, 3, 0): (1, -1.5, 0) and (0, 0.5, 0).
    assert_near(
        scalar(smoothness::smoothness(&v, 0.5, 1.0)),
        (3.25f64.sqrt() + 0.5) / 2.0,
    );
    // Two far away, off by 0.3 and 0.1, and one so near that the term says nothing.
    let (f, d) = (column(&[0.2, -0.3, 0.9]), column(&[-0.1, -0.4, 0.01]));
    assert_near(scalar(distance::distance(f, d)), 0.4 / 3.0);
    assert_near(
        scalar(off_surface::off_surface(column(&[0.0, -0.01]))),
        (1.0 + (-1.0f64).exp()) / 2.0,
    );
}

/// `V = (a y, 0, 0) + b (-y, x, 0)`: a shear along x and a turn about z.
fn shear_and_turn(a: f64, b: f64) -> VelocityJet<Plain> {
    let jacobian = [[0.0, a - b, 0.0], [b, 0.0, 0.0], [0.0; 3]];
    VelocityJet {
        value: points(&[[0.0; 3]]),
        jacobian: points::<Plain>(&jacobian).reshape([1, 3, 3]),
        laplacian: None,
        rate: None,
    }
}

#[test]
fn the_priors_of_a_shear_are_those_of_its_closed_form_and_a_turn_adds_nothing() {
    for turn in [0.0, 3.0] {
        let v = shear_and_turn(2.0, turn);
        // D has the entries 1 at (x, y) and (y, x).
        assert_near(scalar(strain::strain(&v, 0.0)), 2.0);
        assert_near(scalar(strain::strain(&v, 0.5)), 0.5 * (9f64.sqrt() - 1.0));
        assert_near(scalar(deviatoric::deviatoric(&v)), 2.0);
        let seen = |n: [f64; 3]| scalar(stretch::stretch(&v, points(&[n])));
        // In the plane of the shear all of it shows; across it, where x and y do not both lie in the
        // surface, none; along the diagonal, the stretch of the other diagonal by 1.
        assert_near(seen([0.0, 0.0, 1.0]), 2.0);
        assert_near(seen([1.0, 0.0, 0.0]), 0.0);
        let half = 0.5f64.sqrt();
        assert_near(seen([half, half, 0.0]), 1.0);
    }
}

#[test]
fn a_screw_costs_nothing_wherever_its_axis_is_and_a_change_of_its_pace_does() {
    // V = omega (e_3 x (x - c)) + s e_3 at a pace of 1 + a t, seen at t = 0.
    let (omega, slide, pace) = (1.5, 0.4, 0.6);
    let (x, c) = ([0.7, -0.2, 0.3], [0.1, 0.5, -0.2]);
    let value = [-omega * (x[1] - c[1]), omega * (x[0] - c[0]), slide];
    let jacobian = [[0.0, -omega, 0.0], [omega, 0.0, 0.0], [0.0; 3]];
    let jet = |pace: f64| VelocityJet::<Plain> {
        value: points(&[value]),
        jacobian: points::<Plain>(&jacobian).reshape([1, 3, 3]),
        laplacian: None,
        rate: Some(points(&[value.map(|v| v * pace)])),
    };
    assert_near(scalar(screw::screw(&jet(0.0))), 0.0);
    let speed: f64 = value.iter().map(|v| v * v).sum();
    assert_near(scalar(screw::screw(&jet(pace))), pace * pace * speed);
    // The same motion is accelerated: a turn is no straight path.
    let centripetal = omega.powi(4) * ((x[0] - c[0]).powi(2) + (x[1] - c[1]).powi(2));
    assert_near(scalar(acceleration::acceleration(&jet(0.0))), centripetal);
}

#[test]
fn an_expanding_sphere_solves_the_level_set_equation_with_lambda_one_and_no_other() {
    // f = |x| - exp(t), carried by V = x: an exact distance at every time.
    let (t, x) = (0.4f64, [[0.5, 0.0, 0.0], [0.0, 1.2, 0.9], [-2.0, 1.0, 2.0]]);
    let norm = |x: &[f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
    let value: Vec<f64> = x.iter().map(|x| norm(x) - t.exp()).collect();
    let gradient: Vec<[f64; 3]> = x.iter().map(|x| x.map(|c| c / norm(x))).collect();
    let f = jet(&value, &gradient, &[-t.exp(); 3]);
    let v = expansion(&x);
    let off: f64 = value.iter().map(|f| f.abs()).sum::<f64>() / 3.0;
    for (lambda, wanted) in [(1.0, 0.0), (0.0, off), (10.0, 9.0 * off)] {
        assert_near(scalar(level_set::level_set(&f, &v, lambda)), wanted);
    }
}

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
        ("deviatoric", false, true, |s| {
            deviatoric::deviatoric(&s.v_jet())
        }),
        ("stretch", false, true, |s| {
            stretch::stretch(&s.v_jet(), points(&[[0.0, 0.6, 0.8]; 3]))
        }),
        ("screw", false, true, |s| screw::screw(&s.v_jet())),
        ("acceleration", false, true, |s| {
            acceleration::acceleration(&s.v_jet())
        }),
        ("steadiness", false, true, |s| {
            steadiness::steadiness(&s.v_jet())
        }),
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
