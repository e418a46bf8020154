//! NISE: `f(x, t)` carried from one distance field to another by a level-set equation (Novello, da Silva,
//! Schardong, Schirmer, Lopes, Velho, "Neural Implicit Surface Evolution", ICCV 2023).
//!
//! First two sine networks are fitted to the ends, `g` and `h`, a [`EndFields`], and are constants from then
//! on. Then a third learns `f(x, t)` by
//!
//! ```text
//! data       mean (f - g)^2 at t = 0, (f - h)^2 at t = 1                          weight 1e4
//! normals    mean (1 - <n_f, n_g>) at t = 0, (1 - <n_f, n_h>) at t = 1            weight 10
//! level-set  mean r^2 at random positions and times                               weight 10
//! ```
//!
//! with the residual of one of two evolutions:
//!
//! ```text
//! cross-fade              r = f_t - (h - f) exp(-f^2) |grad f| / 2
//! interpolated velocity   r = f_t + <V, grad f>,   V = -(h - g) ((1 - t) n_g + t n_h)
//! ```
//!
//! `n` is the unit gradient. The first moves each point of the surface along its normal, at half of its
//! distance from the target, `V = -(h - f) exp(-f^2) n_f / 2`; on its own it reaches the target only after
//! infinite time, so at t = 1 it disagrees with the data term and the training settles between them. The
//! second is the level-set equation under the velocity that the linear blend `(1 - t) g + t h` has at either
//! end, `-(h - g) grad g / |grad g|^2` and `-(h - g) grad h / |grad h|^2`, interpolated in time.
//!
//! # Differs from the paper
//! The second is our reading of an interpolated velocity. With `|grad g| = |grad h| = 1`, as it is for
//! distances, the blend's velocities are those of the formula; it divides by the length of the gradient once
//! and not twice, which keeps `|V| <= |h - g|` where a fitted field is flat. Networks start as a sphere
//! ([`ImplicitNet`]) and not as weights of `g`.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::autodiff::ModelBackend;
use crate::flow::Geometry;
use crate::flow::end_fields::{EndFields, between};
use crate::flow::end_terms::EndSamples;
use crate::loss;
use crate::nets::{ImplicitNet, ImplicitNetConfig, apart, renumbered};
use crate::objective::Objective;
use crate::operators::{Derivatives, ImplicitJet, Operators};

/// What the parameters of the ends are numbered from. It stands in checkpoints.
const ENDS: u64 = 10_000;

/// By which equation the surface moves between the ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evolution {
    /// Each level set towards the target, along its own normal.
    CrossFade,
    /// Along a velocity given beforehand, interpolated between those at the ends.
    InterpolatedVelocity,
}

/// The shape of a [`Nise`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NiseConfig {
    /// The network; the source takes sines of frequency 20 to 30.
    pub implicit: ImplicitNetConfig,
    /// The equation between the ends.
    pub evolution: Evolution,
}

impl NiseConfig {
    /// A network that starts as a sphere, between two fitted ends.
    ///
    /// # Panics
    /// If the network has more than 10,000 parameter tensors, two to a layer.
    pub fn init<B: ModelBackend>(
        &self,
        ends: EndFields<B>,
        seed: u64,
        device: &B::Device,
    ) -> Nise<B> {
        let nise = Nise {
            net: self.implicit.init(seed, device),
            ends: renumbered(ends, ENDS),
            evolution: self.evolution,
        };
        apart(nise, "Nise")
    }
}

/// The weight of each term; 0 leaves it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NiseWeights {
    /// Agreement with `g` at t = 0 and with `h` at t = 1.
    pub data: f64,
    /// Agreement with their normals.
    pub normals: f64,
    /// The level-set equation.
    pub level_set: f64,
}

impl Default for NiseWeights {
    /// The source's.
    fn default() -> Self {
        Self {
            data: 1e4,
            normals: 10.0,
            level_set: 10.0,
        }
    }
}

/// Random positions and times, where the level-set equation is sampled.
#[derive(Clone, Debug)]
pub struct BetweenSamples<B: Backend> {
    /// In the box and near both surfaces, `[n, 3]`.
    pub points: Tensor<B, 2>,
    /// In `[0, 1]`, `[n, 1]`.
    pub times: Tensor<B, 2>,
}

/// `f(x, t)` and the two fields that it joins.
#[derive(Module, Debug)]
pub struct Nise<B: Backend> {
    net: ImplicitNet<B>,
    ends: EndFields<B>,
    #[module(skip)]
    evolution: Evolution,
}

impl<B: ModelBackend> Nise<B> {
    /// The terms "data", "normals" and "level-set".
    ///
    /// Of the samples at the ends the points and their times are read; the values and normals to be reached there
    /// are those of `g` and `h`.
    pub fn objective(
        &self,
        samples: &EndSamples<B>,
        between: &BetweenSamples<B>,
        weights: &NiseWeights,
        operators: &impl Operators,
    ) -> Objective<B> {
        // The ends are constants: nothing is recorded of them.
        let ends = self.ends.clone().no_grad();
        let mut objective = Objective::new();
        let (x, t) = samples.all();
        let on_surface = samples.surface.dims()[0];
        let f = operators.implicit_jet(&self.net, x.clone(), t.clone());
        // At t = 0 and t = 1 the blend is g and h.
        let given = ends.jet(x, t, operators);
        objective.add("data", weights.data, || {
            let off = f.value.clone() - given.value.clone();
            (off.clone() * off).mean()
        });
        objective.add("normals", weights.normals, || {
            let normals = given.rows(0, on_surface).normal();
            loss::normals::normals(&f.rows(0, on_surface), normals)
        });
        objective.add("level-set", weights.level_set, || {
            let BetweenSamples { points, times } = between.clone();
            let f = operators.implicit_jet(&self.net, points.clone(), times.clone());
            let [g, h] = ends.end_jets(points, operators);
            let residual = match self.evolution {
                Evolution::CrossFade => cross_fade_residual(&f, h.value),
                Evolution::InterpolatedVelocity => {
                    carried_residual(&f, interpolated_velocity(&g, &h, times))
                }
            };
            (residual.clone() * residual).mean()
        });
        objective
    }
}

impl<B: ModelBackend> Geometry<B> for Nise<B> {
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        self.net.forward(x, t)
    }

    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        Derivatives::Forward.implicit_jet(&self.net, x, t).gradient
    }
}

/// `f_t - (h - f) exp(-f^2) |grad f| / 2`, `[n, 1]`, from `f` and the values of the target `h`, `[n, 1]`.
pub fn cross_fade_residual<B: Backend>(f: &ImplicitJet<B>, target: Tensor<B, 2>) -> Tensor<B, 2> {
    let value = f.value.clone();
    let near = (-(value.clone() * value.clone())).exp();
    f.rate.clone() - (target - value) * near * f.slope() * 0.5
}

/// `f_t + <V, grad f>`, `[n, 1]`; `velocity`: `[n, 3]`.
pub fn carried_residual<B: Backend>(f: &ImplicitJet<B>, velocity: Tensor<B, 2>) -> Tensor<B, 2> {
    f.rate.clone() + (velocity * f.gradient.clone()).sum_dim(1)
}

/// `V = -(h - g) ((1 - t) n_g + t n_h)`, `[n, 3]`, from the fields of both ends and times `[n, 1]`.
pub fn interpolated_velocity<B: Backend>(
    g: &ImplicitJet<B>,
    h: &ImplicitJet<B>,
    t: Tensor<B, 2>,
) -> Tensor<B, 2> {
    between(g.normal(), h.normal(), t) * (g.value.clone() - h.value.clone())
}

#[cfg(test)]
mod tests {
    use super::super::blend::tests::of_spheres;
    use super::*;
    use crate::testing::learning::{
        check_gradients, directions, radius, small_siren, spheres, trained,
    };
    use crate::testing::{Plain, Train, column, host, points, shaken};

    const RADII: [f64; 2] = [0.3, 0.5];

    /// `|x| - radius` along one ray, with the rate of a changing radius.
    fn sphere(distances: &[f64], radius: f64, growth: f64) -> ImplicitJet<Plain> {
        let outward = vec![[0.6, 0.0, -0.8]; distances.len()];
        ImplicitJet {
            value: column(&distances.iter().map(|r| r - radius).collect::<Vec<_>>()),
            gradient: points(&outward),
            rate: column(&vec![-growth; distances.len()]),
        }
    }

    #[test]
    fn a_sphere_that_relaxes_to_the_target_solves_the_cross_fade_on_its_surface() {
        // r' = (r_1 - r) / 2, hence r = r_1 + (r_0 - r_1) exp(-t / 2).
        for t in [0.0f64, 0.4, 1.0] {
            let radius = RADII[1] + (RADII[0] - RADII[1]) * (-t / 2.0).exp();
            let growth = (RADII[1] - radius) / 2.0;
            let f = sphere(&[radius, radius + 0.5], radius, growth);
            let h = sphere(&[radius, radius + 0.5], RADII[1], 0.0);
            let residual = host(cross_fade_residual(&f, h.value));
            // Off the surface the speed falls by exp(-f^2), the field's own does not.
            let wanted = [0.0, -growth * (1.0 - (-0.25f64).exp())];
            for (got, wanted) in residual.into_iter().zip(wanted) {
                // f32 rounding of numbers of size 1.
                assert!((got - wanted).abs() < 3e-7, "{got}, wanted {wanted}, t {t}");
            }
        }
    }

    #[test]
    fn a_sphere_that_grows_evenly_solves_the_interpolated_velocity_everywhere() {
        let distances = [0.1, 0.3, 0.44, 0.9];
        let growth = RADII[1] - RADII[0];
        let [g, h] = RADII.map(|radius| sphere(&distances, radius, 0.0));
        for t in [0.0, 0.3, 1.0] {
            let f = sphere(&distances, RADII[0] + t * growth, growth);
            let velocity = interpolated_velocity(&g, &h, column(&[t; 4]));
            for got in host(carried_residual(&f, velocity)) {
                // f32 rounding of numbers of size 1.
                assert!(got.abs() < 3e-7, "{got} at {t}");
            }
            // A field that stands still does not.
            let still = sphere(&distances, RADII[0] + t * growth, 0.0);
            let velocity = interpolated_velocity(&g, &h, column(&[t; 4]));
            for got in host(carried_residual(&still, velocity)) {
                assert!((got - growth).abs() < 3e-7, "{got}, wanted {growth}");
            }
        }
    }

    fn between_samples() -> BetweenSamples<Train> {
        let lattice = directions(128);
        let x = lattice.iter().enumerate().map(|(k, d)| {
            let radius = 0.1 + 0.55 * (0.755 * k as f64).fract();
            d.map(|c| c * radius)
        });
        let times: Vec<f64> = (0..128).map(|k| (0.57 * k as f64).fract()).collect();
        BetweenSamples {
            points: points(&x.collect::<Vec<_>>()),
            times: column(&times),
        }
    }

    fn nise(evolution: Evolution) -> Nise<Train> {
        let (ends, mut implicit) = (of_spheres(small_siren(5.0), RADII), small_siren(5.0));
        implicit.sphere_radius = RADII[0];
        let config = NiseConfig {
            implicit,
            evolution,
        };
        config.init(ends, 7, &Default::default())
    }

    #[test]
    fn the_gradient_of_every_term_reaches_the_weights_and_none_reaches_the_ends() {
        let samples = spheres(16, RADII);
        for evolution in [Evolution::CrossFade, Evolution::InterpolatedVelocity] {
            let net = shaken(nise(evolution), 0.05);
            let objective = |net: &Nise<Train>| {
                let weights = NiseWeights::default();
                net.objective(
                    &samples,
                    &between_samples(),
                    &weights,
                    &Derivatives::Forward,
                )
            };
            check_gradients(&net, objective);
            let total = objective(&net).total().expect("three terms");
            let gradients = burn::optim::GradientsParams::from_grads(total.backward(), &net);
            // Two hidden layers and the output, a weight and a bias each: those of f alone.
            assert_eq!(gradients.len(), 6, "{evolution:?}");
        }
    }

    #[test]
    fn between_two_spheres_the_trained_surface_has_their_radii_at_the_ends_and_one_between_in_between()
     {
        let samples = spheres(64, RADII);
        for evolution in [Evolution::CrossFade, Evolution::InterpolatedVelocity] {
            let net = trained(nise(evolution), 150, 5e-3, |net| {
                let weights = NiseWeights::default();
                net.objective(
                    &samples,
                    &between_samples(),
                    &weights,
                    &Derivatives::Forward,
                )
            });
            let got = [0.0, 0.5, 1.0].map(|t| radius(&net, t));
            // A tenth of the distance between the ends: the training is short.
            assert!((got[0] - RADII[0]).abs() < 0.02, "{evolution:?}: {got:?}");
            assert!((got[2] - RADII[1]).abs() < 0.02, "{evolution:?}: {got:?}");
            // Half way, within a fifth of the way: the cross-fade alone would be behind.
            assert!((got[1] - 0.4).abs() < 0.04, "{evolution:?}: {got:?}");
        }
    }
}
