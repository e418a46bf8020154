//! Geometry defined by the flow: two end fields that the velocity field carries to the time of interest,
//!
//! ```text
//! f(x, t) = (1 - t) g(phi_{t -> 0}(x)) + t h(phi_{t -> 1}(x))
//! ```
//!
//! where `phi_{t -> s}(x)` is where a point that is at `x` at time `t` is at time `s`. Both carried fields
//! solve the level-set equation `f_t + V.grad f = 0` by construction. So only the ends are fitted, and all
//! that is learnt of the shapes stays sharp in between. Where the flow takes the source exactly onto the
//! target the two are one surface. Elsewhere `f_t + V.grad f = h - g` is the difference of the two.
//!
//! `g` and `h` are the [`EndFields`]; without a velocity this is their linear blend.
//!
//! # Differs from the paper
//! The paper trains one network `f(x, t)` under the level-set equation; that geometry is
//! [`crate::ImplicitNet`].

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::end_fields::{EndFields, between};
use super::morph::{Carried, Geometry};
use super::trajectory::{Integrator, Steps, integrate, steps_within};
use super::transport::transport_gradient;
use crate::autodiff::ModelBackend;
use crate::operators::{Derivatives, VelocityField, reverse};

/// How exactly points are followed, in normalised units: a fifth of a cell at 256 cells to a side.
const TOLERANCE: f64 = 1e-3;

/// The most steps of the Runge-Kutta integrator over any span of time.
const MOST_STEPS: usize = 32;

/// Points within this distance of the source's or the target's surface decide the number of steps.
const NEAR: f64 = 0.05;

/// Two end fields and the velocity field that carries them.
#[derive(Debug)]
pub struct FlowGeometry<B: Backend> {
    ends: EndFields<B>,
    velocity: Box<dyn VelocityField<B>>,
    /// Of the Runge-Kutta integrator over all of time.
    steps: usize,
    /// Whether the weights of the two ends change smoothly where others follow.
    is_eased: bool,
}

impl<B: ModelBackend> FlowGeometry<B> {
    /// Of what was trained. The number of steps of the integrator is the least power of two, up to 32,
    /// at which all but a twentieth of the probes near either surface end within 0.001 of where twice the
    /// steps take them.
    ///
    /// `probes`: points throughout the space of both shapes, `[n, 3]`.
    pub fn new(
        ends: EndFields<B>,
        velocity: impl VelocityField<B> + 'static,
        probes: Tensor<B, 2>,
    ) -> Self {
        let steps = needed(&ends, &velocity, probes);
        Self {
            ends,
            velocity: Box::new(velocity),
            steps,
            is_eased: false,
        }
    }

    /// The same with the weight `t^2 (3 - 2 t)` of the target instead of `t`: between two of many key frames, so that
    /// the weight of a key frame has no corner there.
    #[must_use]
    pub fn eased(self) -> Self {
        Self {
            is_eased: true,
            ..self
        }
    }

    /// The blend of what the two ends give at times `t`.
    fn blend(&self, g: Tensor<B, 2>, h: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let weight = if self.is_eased {
            t.clone() * t.clone() * (-(t * 2.0) + 3.0)
        } else {
            t
        };
        between(g, h, weight)
    }

    /// Steps of the Runge-Kutta integrator over all of time.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Where points that are at `x` at times `t` are at time `end`, in `steps`.
    fn carry(&self, x: Tensor<B, 2>, t: Tensor<B, 2>, end: f64, steps: Steps) -> Tensor<B, 2> {
        let to = t.full_like(end);
        let rhs = |x, t| self.velocity.forward(x, t);
        integrate(rhs, x, t, to, steps, Integrator::Rk4)
    }

    /// The share of the steps that a span of time has.
    fn share(&self, span: f64) -> Steps {
        Steps::Even(((span * self.steps as f64).ceil() as usize).max(1))
    }

    /// The share of the steps that the longest of the spans from `t` to each end has.
    fn shares(&self, t: &Tensor<B, 2>) -> [Steps; 2] {
        // All points are followed together, so the longest span decides for all.
        let times = t.clone().into_data();
        let [least, most] = times
            .iter::<f64>()
            .fold([1.0_f64, 0.0], |[least, most], t| {
                [least.min(t), most.max(t)]
            });
        [self.share(most), self.share(1.0 - least)]
    }

    /// `g(phi_{t -> 0}(x))` and `h(phi_{t -> 1}(x))`, `[n, 1]` each: one surface where the flow takes the
    /// source onto the target.
    pub fn carried_values(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> [Tensor<B, 2>; 2] {
        let [back, ahead] = self.shares(&t);
        let start = self.carry(x.clone(), t.clone(), 0.0, back);
        let end = self.carry(x, t, 1.0, ahead);
        self.end_values(start, end)
    }

    /// `g` where the source is and `h` where the target is.
    fn end_values(&self, start: Tensor<B, 2>, end: Tensor<B, 2>) -> [Tensor<B, 2>; 2] {
        let zeros = Tensor::zeros([start.dims()[0], 1], &start.device());
        [
            self.ends.source().forward(start, zeros.clone()),
            self.ends.target().forward(end, zeros),
        ]
    }
}

impl<B: ModelBackend> Geometry<B> for FlowGeometry<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let [g, h] = self.carried_values(x, t.clone());
        self.blend(g, h, t)
    }

    /// The gradient of each end field where the point comes from, carried back along with it.
    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let gradient = |net, end: f64, steps: Steps| {
            // Exact up to the integration: differences would divide the error of two integrations by a small step.
            let from = t.full_like(end);
            let there = self.carry(x.clone(), t.clone(), end, steps);
            let jet = reverse::implicit_jet(net, there.clone(), t.zeros_like());
            let (way, to, method) = (Derivatives::Forward, t.clone(), Integrator::Rk4);
            let (v, gradient) = (&*self.velocity, jet.gradient);
            transport_gradient(&way, v, there, gradient, from, to, steps, method).1
        };
        let [back, ahead] = self.shares(&t);
        let g = gradient(self.ends.source(), 0.0, back);
        let h = gradient(self.ends.target(), 1.0, ahead);
        self.blend(g, h, t.clone())
    }

    fn carried(&self) -> Option<&dyn Carried<B>> {
        Some(self)
    }
}

impl<B: ModelBackend> Carried<B> for FlowGeometry<B> {
    fn tolerance(&self) -> f64 {
        TOLERANCE
    }

    fn ends(&self, x: Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
        let t = Tensor::full([x.dims()[0], 1], time, &x.device());
        let start = self.carry(x.clone(), t.clone(), 0.0, self.share(time));
        let end = self.carry(x, t, 1.0, self.share(1.0 - time));
        Tensor::cat(vec![start, end], 1)
    }

    fn value_from(&self, ends: Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
        let [n, _] = ends.dims();
        let (start, end) = (ends.clone().slice([0..n, 0..3]), ends.slice([0..n, 3..6]));
        let [g, h] = self.end_values(start, end);
        let t = Tensor::full([n, 1], time, &g.device());
        self.blend(g, h, t)
    }
}

/// Steps over the whole span of time that follow the probes near each surface within the tolerance.
fn needed<B: ModelBackend>(
    ends: &EndFields<B>,
    velocity: &dyn VelocityField<B>,
    probes: Tensor<B, 2>,
) -> usize {
    let count = probes.dims()[0];
    let zeros = Tensor::zeros([count, 1], &probes.device());
    let rhs = |x, t| velocity.forward(x, t);
    let mut most = 1;
    for (net, start) in [(ends.source(), 0.0), (ends.target(), 1.0)] {
        // Away from both surfaces an error of the position moves no surface.
        let distance = net.forward(probes.clone(), zeros.clone()).abs();
        let near = distance.lower_elem(NEAR).squeeze_dim::<1>(1).argwhere();
        let near = near.reshape([-1]);
        if near.dims()[0] == 0 {
            continue;
        }
        let x = probes.clone().select(0, near);
        let from = Tensor::full([x.dims()[0], 1], start, &x.device());
        let to = from.full_like(1.0 - start);
        most = most.max(steps_within(
            rhs,
            x,
            from,
            to,
            Integrator::Rk4,
            TOLERANCE,
            MOST_STEPS,
        ));
    }
    most
}

#[cfg(test)]
mod tests {
    use super::super::end_fields::EndFieldsConfig;
    use super::super::morph::Motion;
    use super::*;
    use crate::autodiff::Activation;
    use crate::nets::{ImplicitNetConfig, VelocityNet, VelocityNetConfig};
    use crate::testing::{Plain, assert_close, column, host, numbers, points, shaken};

    const X: [[f64; 3]; 3] = [[0.3, -0.2, 0.1], [-0.35, 0.15, 0.2], [0.05, 0.4, -0.3]];

    fn networks(shake: f64) -> (EndFields<Plain>, VelocityNet<Plain>) {
        let activation = Activation::Softplus { beta: 5.0 };
        let (depth, width, frequencies, skip) = (2, 12, 0, 0);
        let implicit = ImplicitNetConfig {
            depth,
            width,
            activation,
            frequencies,
            skip,
            sphere_radius: 0.35,
        };
        let velocity = VelocityNetConfig {
            depth,
            width,
            activation,
            frequencies,
            skip,
            time_dependent: true,
        };
        let device = Default::default();
        let ends = EndFieldsConfig { implicit }.init(3, &device);
        let velocity = velocity.init(4, &device);
        (shaken(ends, 0.1), shaken(velocity, shake))
    }

    fn geometry() -> FlowGeometry<Plain> {
        let (ends, velocity) = networks(0.3);
        FlowGeometry::new(ends, velocity, numbers(200, 3, 0.3))
    }

    #[test]
    fn at_its_ends_it_is_the_end_fields() {
        let flow = geometry();
        let zeros = || column(&[0.0; 3]);
        let g = flow.ends.source().forward(points(&X), zeros());
        let h = flow.ends.target().forward(points(&X), zeros());
        // No time to move in: exact.
        assert_close(host(flow.value(points(&X), zeros())), host(g), 0.0, "t = 0");
        let ones = column(&[1.0; 3]);
        assert_close(host(flow.value(points(&X), ones)), host(h), 0.0, "t = 1");
    }

    #[test]
    fn an_eased_weight_has_no_corner_at_the_ends() {
        let (flow, eased) = (geometry(), geometry().eased());
        for (t, weight) in [(0.0, 0.0), (0.25, 0.15625), (0.5, 0.5), (1.0, 1.0)] {
            let time = || column(&[t; 3]);
            let [g, h] = flow.carried_values(points(&X), time()).map(host);
            let wanted = g
                .iter()
                .zip(&h)
                .map(|(g, h)| (1.0 - weight) * g + weight * h);
            let found = host(eased.value(points(&X), time()));
            assert_close(found.clone(), wanted.collect(), 1e-6, "value");
            let from = eased.value_from(eased.ends(points(&X), t), t);
            assert_close(host(from), found, 1e-6, "from the ends");
            let [plain, own] = [&flow, &eased].map(|of| host(of.gradient(points(&X), time())));
            let same = plain.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-6);
            assert_eq!(same, weight == t, "the gradient at {t}");
        }
    }

    #[test]
    fn each_carried_field_is_constant_along_the_motion() {
        let flow = geometry();
        let (_, velocity) = networks(0.3);
        let (t, now) = (0.4, velocity.carry(points(&X), 0.0, 0.4));
        let zeros = || column(&[0.0; 3]);
        let [g, h] = flow.carried_values(now.clone(), column(&[t; 3]));
        let moved = (now.clone() - points(&X)).abs().max();
        assert!(host(moved)[0] > 0.05, "the test moves its points");
        let end = velocity.carry(points(&X), 0.0, 1.0);
        let wanted_g = flow.ends.source().forward(points(&X), zeros());
        let wanted_h = flow.ends.target().forward(end, zeros());
        // The tolerance of the integrator times a slope of about one.
        assert_close(host(g), host(wanted_g), 2.0 * TOLERANCE, "g");
        assert_close(host(h), host(wanted_h), 2.0 * TOLERANCE, "h");
    }

    #[test]
    fn its_values_come_from_where_points_come_from_and_go_to() {
        let flow = geometry();
        for time in [0.0, 0.4, 1.0] {
            let ends = flow.ends(points(&X), time);
            let from = flow.value_from(ends, time);
            let value = flow.value(points(&X), column(&[time; 3]));
            // The same operations in the same order.
            assert_close(host(from), host(value), 1e-7, "value");
        }
    }

    #[test]
    fn the_carried_gradient_is_that_of_the_value() {
        let flow = geometry();
        let t = [0.0, 0.35, 1.0];
        let gradient = host(flow.gradient(points(&X), column(&t)));
        let step = 5e-3;
        for axis in 0..3 {
            let moved = |by: f64| {
                let x = X.map(|mut x| {
                    x[axis] += by;
                    x
                });
                host(flow.value(points(&x), column(&t)))
            };
            for (row, (ahead, behind)) in moved(step).iter().zip(moved(-step)).enumerate() {
                let wanted = (ahead - behind) / (2.0 * step);
                let got = gradient[3 * row + axis];
                // Differences: rounding of 1e-7 / 1e-2 and the third derivative; and the two integrations
                // agree to the tolerance per unit of length only.
                assert!((got - wanted).abs() < 5e-3, "{got}, wanted {wanted}");
            }
        }
    }

    #[test]
    fn a_wilder_velocity_takes_more_steps() {
        let steps = |shake| {
            let (ends, velocity) = networks(shake);
            FlowGeometry::new(ends, velocity, numbers(200, 3, 0.3)).steps()
        };
        assert_eq!(steps(0.0), 1, "almost at rest");
        assert!(steps(0.6) > steps(0.0));
    }
}
