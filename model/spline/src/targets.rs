//! Which trajectories a step looks at, and where each should end.
//!
//! ```text
//! matching    weight (1/m) sum |r|,     r = carried source - target, and the reverse
//! on-surface  weight (1/n) sum |n . r|, r = carried sample - nearest sample of the other surface
//! ```
//!
//! Distances become squares by iteratively reweighted least squares: `|r|` has the weight
//! `1 / sqrt(r^2 + scale^2)`. A surface without normals has the distance `|r|` itself. With normals on both
//! sides, the weight is also multiplied by the cosine between the carried normal and the found one, or 0:
//! a front does not stick to a back. What arrives at the border of what is known of the other surface has no weight: it
//! may have no counterpart there.

use std::sync::Arc;

use kiddo::SquaredEuclidean;
use kiddo::immutable::float::kdtree::ImmutableKdTree;
use rand::seq::index;
use rayon::prelude::*;

use crate::band::{Purpose, random};
use crate::ends::Ends;
use crate::options::{Options, Weights};
use crate::problem::{Cloud, Pairs};
use crate::real::Real;
use crate::samples::Arrival;
use crate::trajectory::{Matrix, diagonal};

/// How many points a leaf of the tree aims at.
const BUCKET: usize = 32;

/// A surface arranged for nearest neighbours.
pub(crate) struct Surface {
    tree: ImmutableKdTree<f64, u32, 3, BUCKET>,
    cloud: Arc<Cloud>,
}

impl Surface {
    pub(crate) fn new(cloud: &Arc<Cloud>) -> Self {
        let points: Vec<[f64; 3]> = cloud.points.iter().map(|x| x.map(f64::from)).collect();
        Self {
            tree: ImmutableKdTree::new_from_slice(&points),
            cloud: Arc::clone(cloud),
        }
    }

    fn point(&self, at: usize) -> [f64; 3] {
        self.cloud.points[at].map(f64::from)
    }

    /// The unit normal at a point, if there are normals.
    fn normal(&self, at: usize) -> Option<[f64; 3]> {
        let normals = self.cloud.normals.as_ref()?;
        Some(unit(normals[at].map(f64::from)))
    }

    fn nearest(&self, query: [f64; 3]) -> usize {
        self.tree.nearest_one::<SquaredEuclidean>(&query).item as usize
    }
}

/// Trajectories of a step: where they start, and from which end of time to which.
pub(crate) struct Targets<R> {
    pub starts: Vec<[R; 3]>,
    pub times: Vec<[R; 2]>,
    /// Where the trajectories of pairs should end; the others are on-surface samples.
    goals: Vec<[f64; 3]>,
    confidence: Vec<f64>,
    /// Of each on-surface sample: which shape it is of, and which sample.
    samples: Vec<(usize, usize)>,
}

/// Residuals, their weights, and the mean distances without weights.
pub(crate) struct Residuals<R> {
    pub residuals: Vec<[R; 3]>,
    pub weights: Vec<Matrix<R>>,
    pub matching: f64,
    pub on_surface: f64,
}

impl<R: Real> Targets<R> {
    pub(crate) fn new(
        shapes: &[Arc<Cloud>; 2],
        pairs: &Pairs,
        options: &Options,
        weights: &Weights,
        step: usize,
    ) -> Self {
        let mut out = Self {
            starts: Vec::new(),
            times: Vec::new(),
            goals: Vec::new(),
            confidence: Vec::new(),
            samples: Vec::new(),
        };
        if weights.matching > 0.0 {
            let both = [
                (&pairs.source, &pairs.target),
                (&pairs.target, &pairs.source),
            ];
            for (end, (starts, goals)) in both.into_iter().enumerate() {
                for (at, (&start, goal)) in starts.iter().zip(goals).enumerate() {
                    out.push(start, end);
                    out.goals.push(goal.map(f64::from));
                    let confidence = pairs.confidence.get(at).copied().unwrap_or(1.0);
                    out.confidence.push(f64::from(confidence));
                }
            }
        }
        if weights.on_surface > 0.0 {
            let most = options.surface_samples_beside(pairs);
            for (end, cloud) in shapes.iter().enumerate() {
                let mut rng = random(options.seed, step, Purpose::Surface, end);
                let count = cloud.points.len();
                for at in index::sample(&mut rng, count, most.min(count)) {
                    out.push(cloud.points[at], end);
                    out.samples.push((end, at));
                }
            }
        }
        out
    }

    /// Where the trajectories of pairs should end.
    #[cfg(test)]
    pub(crate) fn goals(&self) -> &[[f64; 3]] {
        &self.goals
    }

    /// The trajectories of pairs, and those of surface samples with what they should reach.
    pub(crate) fn arrivals(
        &self,
        ends: &Ends<R>,
        surfaces: &[Arc<Surface>; 2],
    ) -> (Vec<Arrival<R>>, Vec<Arrival<R>>) {
        let count = self.goals.len();
        let arrival = |at: usize, place, normal, factor| Arrival {
            start: self.starts[at],
            times: self.times[at],
            place,
            normal,
            factor,
        };
        let goals = self.goals.iter().zip(&self.confidence).enumerate();
        let pairs = goals.map(|(at, (&goal, &sure))| arrival(at, goal, None, sure));
        let samples = self.samples.iter().enumerate();
        let surface = samples.map(|(k, &(from, index))| {
            let at = count + k;
            let end = ends.points[at].map(R::wide);
            let found = Found::new(end, &ends.gradients[at], surfaces, from, index);
            let place = difference(end, found.residual);
            arrival(at, place, found.normal, found.agreement)
        });
        (pairs.collect(), surface.collect())
    }

    /// The nearest place of each on-surface sample, its normal, and the agreement.
    #[cfg(test)]
    pub(crate) fn planes(
        &self,
        ends: &Ends<R>,
        surfaces: &[Arc<Surface>; 2],
    ) -> Vec<([f64; 3], [f64; 3], f64)> {
        let (_, surface) = self.arrivals(ends, surfaces);
        let plane = |at: Arrival<R>| (at.place, at.normal.expect("normals"), at.factor);
        surface.into_iter().map(plane).collect()
    }

    fn push(&mut self, start: [f32; 3], end: usize) {
        let of = |x: f32| R::of(f64::from(x));
        self.starts.push(start.map(of));
        let end = end as f64;
        self.times.push([R::of(end), R::of(1.0 - end)]);
    }

    /// What is wrong with where the trajectories end.
    pub(crate) fn residuals(
        &self,
        ends: &Ends<R>,
        surfaces: &[Arc<Surface>; 2],
        weights: &Weights,
        scale: f64,
    ) -> Residuals<R> {
        let mut out = Residuals {
            residuals: Vec::with_capacity(ends.points.len()),
            weights: Vec::with_capacity(ends.points.len()),
            matching: 0.0,
            on_surface: 0.0,
        };
        let (of_pairs, of_samples) = ends.points.split_at(self.goals.len());
        let each = weights.matching / of_pairs.len().max(1) as f64;
        for ((&end, &goal), confidence) in of_pairs.iter().zip(&self.goals).zip(&self.confidence) {
            let r = difference(end.map(R::wide), goal);
            let distance = norm(r);
            out.residuals.push(r.map(R::of));
            let weight = each * confidence / distance.hypot(scale);
            out.weights.push(diagonal(R::of(weight)));
            out.matching += distance / of_pairs.len() as f64;
        }
        let gradients = &ends.gradients[self.goals.len()..];
        let each = weights.on_surface / of_samples.len().max(1) as f64;
        let found: Vec<Found> = of_samples
            .par_iter()
            .zip(gradients)
            .zip(&self.samples)
            .map(|((&end, gradient), &(from, at))| {
                Found::new(end.map(R::wide), gradient, surfaces, from, at)
            })
            .collect();
        for Found {
            residual,
            normal,
            agreement,
        } in found
        {
            let distance = normal.map_or_else(|| norm(residual), |n| dot(n, residual).abs());
            let weight = each * agreement / distance.hypot(scale);
            out.residuals.push(residual.map(R::of));
            out.weights.push(match normal {
                None => diagonal(R::of(weight)),
                Some(n) => n.map(|a| n.map(|b| R::of(weight * a * b))),
            });
            out.on_surface += distance / of_samples.len() as f64;
        }
        out
    }
}

/// The nearest sample of the other surface.
struct Found {
    residual: [f64; 3],
    normal: Option<[f64; 3]>,
    agreement: f64,
}

impl Found {
    fn new<R: Real>(
        end: [f64; 3],
        gradient: &Matrix<R>,
        surfaces: &[Arc<Surface>; 2],
        from: usize,
        at: usize,
    ) -> Self {
        let (own, other) = (&surfaces[from], &surfaces[1 - from]);
        let nearest = other.nearest(end);
        let normal = other.normal(nearest);
        let agreement = match (own.normal(at), normal) {
            _ if other.cloud.border.get(nearest) == Some(&true) => 0.0,
            (Some(own), Some(found)) => dot(carried_normal(gradient, own), found).clamp(0.0, 1.0),
            _ => 1.0,
        };
        Self {
            residual: difference(end, other.point(nearest)),
            normal,
            agreement,
        }
    }
}

/// `G^-T n` as a unit vector, by `G`'s cofactors.
fn carried_normal<R: Real>(gradient: &Matrix<R>, normal: [f64; 3]) -> [f64; 3] {
    let column = |j: usize| [0, 1, 2].map(|i: usize| gradient[i][j].wide());
    let (a, b, c) = (column(0), column(1), column(2));
    let [bc, ca, ab] = [cross(b, c), cross(c, a), cross(a, b)];
    let sign = dot(a, bc).signum();
    unit([0, 1, 2].map(|i| sign * (normal[0] * bc[i] + normal[1] * ca[i] + normal[2] * ab[i])))
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// The vector at length 1; zero stays zero.
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = norm(a);
    if length > 0.0 {
        a.map(|x| x / length)
    } else {
        a
    }
}
