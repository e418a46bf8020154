//! What is known at the two ends, and the terms that several methods make of it.
//!
//! ```text
//! data         mean |f|                  on the surfaces
//! normals      mean (1 - <n, n_given>)   on the surfaces, where normals are given
//! eikonal      mean (|grad f| - 1)^2     on the surfaces and in space
//! off-surface  mean exp(-100 |f|)        in space
//! distance     mean |f - d|              in space away from the surfaces, where distances are known
//! ```
//!
//! All at t = 0 and t = 1 and at no time between.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::loss;
use crate::objective::Objective;
use crate::operators::ImplicitJet;

/// Samples at t = 0 and t = 1, in normalised coordinates.
#[derive(Clone, Debug)]
pub struct EndSamples<B: Backend> {
    /// Points on the surfaces, `[n, 3]`.
    pub surface: Tensor<B, 2>,
    /// On which surface each lies: 0 or 1, `[n, 1]`.
    pub surface_times: Tensor<B, 2>,
    /// The outward unit normals there, `[n, 3]`, where they are known.
    pub normals: Option<Tensor<B, 2>>,
    /// Points near the surfaces and in the box, `[m, 3]`.
    pub space: Tensor<B, 2>,
    /// Which end each is of: 0 or 1, `[m, 1]`.
    pub space_times: Tensor<B, 2>,
    /// The signed distance of each point in space from the surface of its end, negative inside, `[m, 1]`.
    pub distances: Option<Tensor<B, 2>>,
}

impl<B: Backend> EndSamples<B> {
    /// All points, those on the surfaces first, `[n + m, 3]`, and their times, `[n + m, 1]`.
    ///
    /// # Panics
    /// If there are not as many times as points.
    pub fn all(&self) -> (Tensor<B, 2>, Tensor<B, 2>) {
        for (points, times) in [
            (&self.surface, &self.surface_times),
            (&self.space, &self.space_times),
        ] {
            let (points, times) = (points.dims(), times.dims());
            assert!(
                points[1] == 3 && times == [points[0], 1],
                "points {points:?} and their times {times:?}: [n, 3] and [n, 1] needed"
            );
        }
        let points = vec![self.surface.clone(), self.space.clone()];
        let times = vec![self.surface_times.clone(), self.space_times.clone()];
        (Tensor::cat(points, 0), Tensor::cat(times, 0))
    }
}

/// The weight of each shared term; 0 leaves it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndWeights {
    /// `|f|` on the surfaces.
    pub data: f64,
    /// Agreement with the given normals; without any the term is left out.
    pub normals: f64,
    /// The slope of a distance.
    pub eikonal: f64,
    /// No zeros away from the surfaces.
    pub off_surface: f64,
    /// The signed distance away from the surfaces; without any distances the term is left out.
    pub distance: f64,
}

/// `f` and its derivatives at all samples of some ends, as [`EndSamples::all`] orders them.
pub(crate) struct Seen<'a, B: Backend> {
    pub samples: &'a EndSamples<B>,
    pub jet: ImplicitJet<B>,
}

impl<B: Backend> Seen<'_, B> {
    fn on_surface(&self) -> ImplicitJet<B> {
        self.jet.rows(0, self.samples.surface.dims()[0])
    }

    fn in_space(&self) -> ImplicitJet<B> {
        let [first, _] = self.samples.surface.dims();
        self.jet.rows(first, self.jet.value.dims()[0])
    }
}

/// The shared terms. Where the two ends have a field each, each term is the mean of theirs.
pub(crate) fn objective<B: Backend>(ends: &[Seen<B>], weights: &EndWeights) -> Objective<B> {
    let mean = |term: &dyn Fn(&Seen<B>) -> Tensor<B, 1>| {
        // A mean of means: each end counts alike, however many samples it has.
        Tensor::cat(ends.iter().map(term).collect(), 0).mean()
    };
    let mut objective = Objective::new();
    objective.add("data", weights.data, || {
        mean(&|end| loss::data::data(end.on_surface().value))
    });
    let known = ends.iter().filter_map(|end| {
        let given = end.samples.normals.clone()?;
        Some((end, given))
    });
    let known: Vec<_> = known.collect();
    if !known.is_empty() {
        objective.add("normals", weights.normals, || {
            let terms = known
                .into_iter()
                .map(|(end, given)| loss::normals::normals(&end.on_surface(), given));
            Tensor::cat(terms.collect(), 0).mean()
        });
    }
    objective.add("eikonal", weights.eikonal, || {
        mean(&|end| loss::eikonal::eikonal(end.jet.slope()))
    });
    objective.add("off-surface", weights.off_surface, || {
        mean(&|end| loss::off_surface::off_surface(end.in_space().value))
    });
    let measured = ends.iter().filter_map(|end| {
        let distances = end.samples.distances.clone()?;
        Some((end, distances))
    });
    let measured: Vec<_> = measured.collect();
    if !measured.is_empty() {
        objective.add("distance", weights.distance, || {
            let terms = measured
                .into_iter()
                .map(|(end, known)| loss::distance::distance(end.in_space().value, known));
            Tensor::cat(terms.collect(), 0).mean()
        });
    }
    objective
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, column, points};

    const WEIGHTS: EndWeights = EndWeights {
        data: 1.0,
        normals: 1.0,
        eikonal: 1.0,
        off_surface: 1.0,
        distance: 1.0,
    };

    fn samples(normals: bool) -> EndSamples<Plain> {
        EndSamples {
            surface: points(&[[0.3, 0.0, 0.0], [0.0, 0.4, 0.0]]),
            surface_times: column(&[0.0, 1.0]),
            normals: normals.then(|| points(&[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])),
            space: points(&[[0.5, 0.0, 0.0]]),
            space_times: column(&[1.0]),
            distances: normals.then(|| column(&[0.2])),
        }
    }

    fn jet() -> ImplicitJet<Plain> {
        ImplicitJet {
            value: column(&[0.1, -0.3, 0.01]),
            gradient: points(&[[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]),
            rate: column(&[0.0; 3]),
        }
    }

    #[test]
    fn each_term_is_taken_at_the_samples_that_it_is_about() {
        let samples = samples(true);
        let jet = jet();
        let objective = objective(
            &[Seen {
                samples: &samples,
                jet,
            }],
            &WEIGHTS,
        );
        let names: Vec<_> = objective.terms().iter().map(|term| term.name).collect();
        let all = ["data", "normals", "eikonal", "off-surface", "distance"];
        assert_eq!(names, all);
        let wanted = [0.2, 0.5, 5.0 / 3.0, (-1.0f64).exp(), 0.19];
        for (got, wanted) in objective.read().into_iter().zip(wanted) {
            // Means of at most three f32 numbers of size 1 to 10.
            assert!((got - wanted).abs() < 2e-6, "{got}, wanted {wanted}");
        }
    }

    #[test]
    fn ends_seen_apart_count_alike_and_one_without_normals_is_passed_over() {
        let (with, without) = (samples(true), samples(false));
        let first = Seen {
            samples: &with,
            jet: jet(),
        };
        let mut other = jet();
        other.value = other.value * 3.0;
        let second = Seen {
            samples: &without,
            jet: other,
        };
        let objective = objective(&[first, second], &WEIGHTS);
        let wanted = [
            0.4,
            0.5,
            5.0 / 3.0,
            ((-1.0f64).exp() + (-3.0f64).exp()) / 2.0,
            0.19,
        ];
        for (got, wanted) in objective.read().into_iter().zip(wanted) {
            // As above.
            assert!((got - wanted).abs() < 2e-6, "{got}, wanted {wanted}");
        }
    }
}
