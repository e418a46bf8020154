//! The linear blend of two signed distance fields, `f(x, t) = (1 - t) g(x) + t h(x)`: what the end fields are
//! at rest.
//!
//! It is the classical way of shape averaging (Payne and Toga, "Distance field manipulation of surface
//! models", 1992). It needs no correspondences. It dissolves and regrows whatever moves by more than its own
//! thickness.
//!
//! The networks, their terms and their records are those of [`EndFields`].

use burn::tensor::Tensor;

use crate::autodiff::ModelBackend;
use crate::flow::Geometry;
use crate::flow::end_fields::{EndFields, EndFieldsConfig, between};
use crate::operators::Derivatives;

/// The method's networks, `g` and `h`.
pub type SdfBlend<B> = EndFields<B>;

/// The shape of an [`SdfBlend`].
pub type SdfBlendConfig = EndFieldsConfig;

impl<B: ModelBackend> Geometry<B> for SdfBlend<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let zeros = t.zeros_like();
        let g = self.source().forward(x.clone(), zeros.clone());
        let h = self.target().forward(x, zeros);
        between(g, h, t)
    }

    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.jet(x, t, &Derivatives::Forward).gradient
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::nets::ImplicitNetConfig;
    use crate::testing::learning::{end_weights, radius, small, spheres, trained};
    use crate::testing::{Plain, Train, column, host, points, shaken};

    /// End fields that are two exact initial spheres.
    pub(crate) fn of_spheres<B: ModelBackend>(
        mut implicit: ImplicitNetConfig,
        radii: [f64; 2],
    ) -> EndFields<B> {
        let [source, target] = radii.map(|radius| {
            implicit.sphere_radius = radius;
            implicit.init(1, &Default::default())
        });
        EndFields::new(source, target)
    }

    #[test]
    fn each_network_learns_its_own_end_and_the_radius_changes_evenly_between() {
        let implicit = small(10.0);
        let net: SdfBlend<Train> = SdfBlendConfig { implicit }.init(5, &Default::default());
        let (near, far) = (spheres(96, [0.3; 2]), spheres(96, [0.45; 2]));
        let net = trained(net, 150, 5e-3, |net| {
            net.objective([&near, &far], &end_weights(), &Derivatives::Forward)
        });
        for (t, wanted) in [(0.0, 0.3), (0.5, 0.375), (1.0, 0.45)] {
            let got = radius(&net, t);
            // A tenth of the distance between the ends: the training is short.
            assert!((got - wanted).abs() < 0.015, "{got} at {t}");
        }
    }

    #[test]
    fn the_written_gradient_and_rate_are_those_of_the_value() {
        let net: SdfBlend<Plain> = shaken(of_spheres(small(5.0), [0.3, 0.5]), 0.2);
        let x = [[0.3, -0.2, 0.1], [-0.35, 0.15, 0.2]];
        let at = |x: &[[f64; 3]], t: f64| host(net.value(points(x), column(&[t; 2])));
        let jet = net.jet(points(&x), column(&[0.3; 2]), &Derivatives::Forward);
        let gradient = host(jet.gradient);
        let step = 5e-3;
        // Differences: 1e-7 / 1e-2 of rounding, and 1e-5 times a third derivative of size 10.
        for axis in 0..3 {
            let moved = |by: f64| {
                x.map(|mut point| {
                    point[axis] += by;
                    point
                })
            };
            let (ahead, behind) = (at(&moved(step), 0.3), at(&moved(-step), 0.3));
            for row in 0..2 {
                let (got, wanted) = (
                    gradient[3 * row + axis],
                    (ahead[row] - behind[row]) / (2.0 * step),
                );
                assert!((got - wanted).abs() < 1e-3, "{got}, wanted {wanted}");
            }
        }
        let (ahead, behind) = (at(&x, 0.8), at(&x, -0.2));
        for (row, rate) in host(jet.rate).into_iter().enumerate() {
            // Linear in time: f32 rounding only.
            assert!((rate - (ahead[row] - behind[row])).abs() < 2e-6);
        }
    }
}
