//! Surfaces and motion of a solved field:
//!
//! ```text
//! f(x, t) = (1 - t) g(phi_{t -> 0}(x)) + t h(phi_{t -> 1}(x))
//! ```
//!
//! as with the default method, `g` and `h` being the signed distances of the shapes themselves. Between two of many key
//! frames the weight is `t^2 (3 - 2 t)` instead of `t`, so that it has no kink where an interval ends.
//!
//! Where one of the shapes is not known, beyond the border of a scan or in a hole, the other one alone decides. With
//! `a` and `b` as how far they are known there, 0 to 1, the weight of `h` is, instead of the `t` above,
//!
//! ```text
//! t a b + t (1 - a) (1 - b) + (1 - a) b
//! ```

use std::sync::Arc;

use isomorph_spline::SplineField;
use isomorph_training::deformation::{CarriedField, Deformation, PointMotion, SurfaceField};

use crate::shape::Solid;
use crate::surface::learned::some_of;

/// How exactly points are followed, in normalised units: a fifth of a cell at 256 cells to a side.
pub(super) const TOLERANCE: f64 = 1e-3;

/// The most steps of the integrator over all of time.
const MOST_STEPS: usize = 32;

/// Points of each shape that decide how many steps it takes.
const PROBES: usize = 2000;

/// How many steps the integrator takes over all of time, by points of both shapes.
pub(super) fn steps_of<const H: usize>(
    field: &SplineField<f32, H>,
    points: [&[[f32; 3]]; 2],
) -> usize {
    let probes = points.map(|points| some_of(points, PROBES));
    field.steps_within([&probes[0], &probes[1]], TOLERANCE, [2, MOST_STEPS])
}

/// Two neighbouring shapes and the field that carries them.
pub(super) struct CarriedShapes<const H: usize> {
    field: SplineField<f32, H>,
    shapes: [Arc<Solid>; 2],
    /// Whether they are two of many key frames.
    is_part: bool,
    /// Of the Runge-Kutta integrator over all of time.
    steps: usize,
}

impl<const H: usize> CarriedShapes<H> {
    pub(super) fn new(field: SplineField<f32, H>, shapes: [Arc<Solid>; 2], is_part: bool) -> Self {
        let steps = steps_of(
            &field,
            shapes.each_ref().map(|shape| &shape.parts().points[..]),
        );
        Self {
            field,
            shapes,
            is_part,
            steps,
        }
    }

    /// The shape at time 0 or at time 1, for others too.
    pub(super) fn shared(&self, end: usize) -> Arc<Solid> {
        Arc::clone(&self.shapes[end])
    }

    /// The shape at time 0 or at time 1.
    fn shape(&self, end: usize) -> &Solid {
        &self.shapes[end]
    }

    /// The weight of the second shape where both are known.
    fn weight(&self, time: f64) -> f32 {
        if self.is_part {
            (time * time * (3.0 - 2.0 * time)) as f32
        } else {
            time as f32
        }
    }

    /// The share of the steps that a span of time has.
    fn share(&self, from: f64, to: f64) -> usize {
        (((to - from).abs() * self.steps as f64).ceil() as usize).max(1)
    }

    /// The blend of both distances where points come from and go to.
    fn blend(
        &self,
        ends: &[[f32; 6]],
        time: f64,
        distances: impl Fn(&Solid, &[[f32; 3]]) -> Vec<f32>,
    ) -> Vec<f32> {
        let places = [0, 1].map(|end: usize| -> Vec<[f32; 3]> {
            let place = |both: &[f32; 6]| [both[3 * end], both[3 * end + 1], both[3 * end + 2]];
            ends.iter().map(place).collect()
        });
        let weights = self.weights([&places[0], &places[1]], time);
        let of = |end: usize| {
            if weights.is_none() && has_no_weight(end, time) {
                return vec![0.0; ends.len()];
            }
            distances(self.shape(end), &places[end])
        };
        let (g, h) = (of(0), of(1));
        let everywhere = self.weight(time);
        let weight = |k: usize| weights.as_ref().map_or(everywhere, |weights| weights[k]);
        let blend = |(k, (g, h)): (usize, (&f32, &f32))| (1.0 - weight(k)) * g + weight(k) * h;
        g.iter().zip(&h).enumerate().map(blend).collect()
    }

    /// The weight of the second shape at each place, given where it comes from and goes to; `None` where it is the time
    /// everywhere.
    fn weights(&self, places: [&[[f32; 3]]; 2], time: f64) -> Option<Vec<f32>> {
        let [a, b] = [0, 1].map(|end: usize| self.shape(end).known_at(places[end]));
        if a.is_none() && b.is_none() {
            return None;
        }
        let t = self.weight(time);
        let known = |of: &Option<Vec<f32>>, k: usize| of.as_ref().map_or(1.0, |of| of[k]);
        let weight = |k: usize| {
            let (a, b) = (known(&a, k), known(&b, k));
            t * a * b + t * (1.0 - a) * (1.0 - b) + (1.0 - a) * b
        };
        Some((0..places[0].len()).map(weight).collect())
    }

    fn carry_to(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        let steps = self.share(from, to);
        self.field.carry(points, from as f32, to as f32, steps)
    }
}

impl<const H: usize> Deformation for CarriedShapes<H> {
    fn field(&self) -> Option<&dyn SurfaceField> {
        Some(self)
    }

    fn motion(&self) -> Option<&dyn PointMotion> {
        Some(self)
    }
}

impl<const H: usize> SurfaceField for CarriedShapes<H> {
    fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
        self.blend(&self.ends(points, time), time, Solid::distances)
    }

    /// The gradient of each distance where the point comes from, carried back by the transpose of the motion's
    /// derivative: that of the integrator's own steps, so that it is the gradient of [`Self::values`], but for the
    /// weights where a shape is not known, which count as constant.
    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let is_known = (0..2).all(|end| self.shape(end).parts().known.is_none());
        let [(g, from), (h, to)] = [0, 1].map(|end: usize| {
            if is_known && has_no_weight(end, time) {
                return (vec![[0.0; 3]; points.len()], Vec::new());
            }
            let (shape, until) = (self.shape(end), end as f64);
            let steps = self.share(time, until);
            let there = self
                .field
                .carry_with_gradient(points, time as f32, until as f32, steps);
            let places: Vec<[f32; 3]> = there.iter().map(|carried| carried.point).collect();
            let slopes = shape.gradients(&places).into_iter();
            let back = slopes
                .zip(&there)
                .map(|(n, carried)| transposed(&carried.gradient, n));
            (back.collect::<Vec<_>>(), places)
        });
        let weights = if is_known {
            None
        } else {
            self.weights([&from, &to], time)
        };
        let everywhere = self.weight(time);
        let weight = |k: usize| weights.as_ref().map_or(everywhere, |weights| weights[k]);
        let blend = |(k, (g, h)): (usize, (&[f32; 3], &[f32; 3]))| {
            let t = weight(k);
            [0, 1, 2].map(|i| (1.0 - t) * g[i] + t * h[i])
        };
        g.iter().zip(&h).enumerate().map(blend).collect()
    }

    fn carried(&self) -> Option<&dyn CarriedField> {
        Some(self)
    }
}

impl<const H: usize> CarriedField for CarriedShapes<H> {
    fn tolerance(&self) -> f64 {
        TOLERANCE
    }

    fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
        let [start, end] = [0.0, 1.0].map(|end| self.carry_to(points, time, end));
        let both = |(a, b): (&[f32; 3], &[f32; 3])| [a[0], a[1], a[2], b[0], b[1], b[2]];
        start.iter().zip(&end).map(both).collect()
    }

    /// Exact near the surface; [`SurfaceField::values`] are so everywhere.
    fn values_from(&self, ends: &[[f32; 6]], time: f64) -> Vec<f32> {
        self.blend(ends, time, Solid::distances_to_search)
    }
}

impl<const H: usize> PointMotion for CarriedShapes<H> {
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        self.carry_to(points, from, to)
    }

    fn velocities(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        self.field.values(points, time as f32)
    }
}

fn transposed(m: &[[f32; 3]; 3], x: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|j| m[0][j] * x[0] + m[1][j] * x[1] + m[2][j] * x[2])
}

/// Whether the blend at a time does not depend on an end: then nothing of it is computed.
fn has_no_weight(end: usize, time: f64) -> bool {
    if end == 0 { time >= 1.0 } else { time <= 0.0 }
}
