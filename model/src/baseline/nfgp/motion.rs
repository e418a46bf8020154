//! One deformation per trained time, and what lies between.
//!
//! With `N` deformations, `D_k` belongs to time `k / N`, `k = 1 .. N`; `D_0` is the identity. Between two trained
//! times positions go straight:
//!
//! ```text
//! D_t = (1 - w) D_k + w D_{k+1},   k = floor(N t),   w = N t - k
//! ```
//!
//! A point at time `from` is at `D_to(D_from^-1(x))` at time `to`. At a trained time `D^-1` is the fixed-point
//! inverse. In between it is found by Newton's method on `D_t(x) = y` from the same mixture of the two inverses,
//! which is off by the square of what the motion between the two times is off the same translation everywhere.
//! Such a mixture is one to one only while neighbouring poses are close: `Lip(D_{k+1} ∘ D_k^-1 - id) < 1`
//! suffices. The paper has no times in between.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::block::{Normalised, largest};
use super::config::{FixedPoint, NfgpConfig};
use super::deformation::Nfgp;
use super::energy::{cross, dot};
use crate::autodiff::ModelBackend;
use crate::flow::Motion;
use crate::nets::apart;

/// Newton steps after which the inverse at a time in between ends in any case; three are usual.
const NEWTON_STEPS: usize = 10;

/// How close to a trained time, in units of their spacing, counts as that time.
const SAME_TIME: f64 = 1e-9;

/// The shape of an [`NfgpMotion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NfgpMotionConfig {
    /// Of the deformation at each time.
    pub deformation: NfgpConfig,
    /// Trained times, evenly spaced in `(0, 1]`, at least 1.
    pub times: usize,
    /// How inverses are found.
    pub inverse: FixedPoint,
}

impl NfgpMotionConfig {
    /// Deformations close to the identity, each with parameter numbers of its own.
    ///
    /// # Panics
    /// If `times` is 0, or as [`NfgpConfig::init`].
    pub fn init<B: ModelBackend>(&self, seed: u64, device: &B::Device) -> NfgpMotion<B> {
        assert!(self.times > 0, "NfgpMotionConfig: times 0: at least 1");
        let config = &self.deformation;
        let deformations = (0..self.times as u64)
            .map(|k| config.numbered(seed.wrapping_add(k), k * config.parameters(), device));
        let motion = NfgpMotion {
            deformations: deformations.collect(),
            inverse: self.inverse,
        };
        apart(motion, "NfgpMotion")
    }
}

/// A motion from the source at time 0, made of deformations at evenly spaced times.
#[derive(Module, Debug)]
pub struct NfgpMotion<B: Backend> {
    deformations: Vec<Nfgp<B>>,
    #[module(skip)]
    inverse: FixedPoint,
}

impl<B: ModelBackend> NfgpMotion<B> {
    /// How many times are trained.
    pub fn times(&self) -> usize {
        self.deformations.len()
    }

    /// The time of deformation `index`, counted from 0: `(index + 1) / times`.
    pub fn time(&self, index: usize) -> f64 {
        (index + 1) as f64 / self.times() as f64
    }

    /// Deformation `index`, counted from 0.
    ///
    /// # Panics
    /// If there is none.
    pub fn deformation(&self, index: usize) -> &Nfgp<B> {
        &self.deformations[index]
    }

    /// Where the optimisation of deformation `index` starts: from the weights of the one before, the first
    /// from its own.
    ///
    /// # Panics
    /// If there is none.
    pub fn start(&self, index: usize) -> Nfgp<B> {
        let own = &self.deformations[index];
        match index.checked_sub(1) {
            Some(before) => own.with_weights_of(&self.deformations[before]),
            None => own.clone(),
        }
    }

    /// Puts a deformation, once optimised, in its place.
    ///
    /// # Panics
    /// If there is no deformation `index`, or it is of another shape.
    pub fn replace(&mut self, index: usize, deformation: &Nfgp<B>) {
        self.deformations[index] = self.deformations[index].with_weights_of(deformation);
    }

    /// `D_t`.
    fn at(&self, time: f64) -> Pose<B> {
        let (index, weight) = between(time, self.times());
        // Index 0 is the identity, which has no blocks.
        let end = |index: usize| match index.checked_sub(1) {
            Some(k) => self.deformations[k].normalised(),
            None => Normalised::new(std::iter::empty()),
        };
        Pose {
            below: end(index),
            above: (weight > 0.0).then(|| (end(index + 1), weight)),
        }
    }
}

impl<B: ModelBackend> Motion<B> for NfgpMotion<B> {
    /// Times outside `[0, 1]` are taken to its ends. The inverse at `from` is not tracked; the way to `to` is.
    fn carry(&self, x: Tensor<B, 2>, from: f64, to: f64) -> Tensor<B, 2> {
        if from == to {
            return x;
        }
        self.at(to).forward(self.at(from).inverse(x, self.inverse))
    }

    /// Each from time 0, where the inverse is the identity.
    fn path(&self, x: Tensor<B, 2>, times: &[f64]) -> Vec<Tensor<B, 2>> {
        let from_start = |time: &f64| self.carry(x.clone(), 0.0, *time);
        times.iter().map(from_start).collect()
    }
}

/// The trained time at or below `time`, as an index from 0 at time 0, and how far it is to the next.
fn between(time: f64, times: usize) -> (usize, f64) {
    let place = time.clamp(0.0, 1.0) * times as f64;
    let nearest = place.round();
    if (place - nearest).abs() < SAME_TIME {
        (nearest as usize, 0.0)
    } else {
        (place as usize, place.fract())
    }
}

/// `D_t`: one deformation, or a mixture of two and the share of the second.
struct Pose<B: Backend> {
    below: Normalised<B>,
    above: Option<(Normalised<B>, f64)>,
}

impl<B: ModelBackend> Pose<B> {
    fn forward(&self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        match &self.above {
            None => self.below.forward(x),
            Some((above, weight)) => mix(self.below.forward(x.clone()), above.forward(x), *weight),
        }
    }

    fn inverse(&self, y: Tensor<B, 2>, until: FixedPoint) -> Tensor<B, 2> {
        let Some((above, weight)) = &self.above else {
            return self.below.inverse(y, until);
        };
        let y = y.detach();
        let ends = [&self.below, above].map(|end| end.inverse(y.clone(), until));
        let [below, beyond] = ends;
        // The mixture of the inverses is exact where both ends differ by a translation.
        let mut x = mix(below, beyond, *weight);
        for _ in 0..NEWTON_STEPS {
            let (value, columns) = self.jet(x.clone());
            let step = solve(columns, y.clone() - value).detach();
            x = x + step.clone();
            if largest(step) <= until.tolerance {
                break;
            }
        }
        x
    }

    /// `D_t(x)` and the columns of its Jacobian.
    fn jet(&self, x: Tensor<B, 2>) -> (Tensor<B, 2>, [Tensor<B, 2>; 3]) {
        let (value, [a, b, c]) = self.below.jet_by_axes(x.clone());
        let Some((above, weight)) = &self.above else {
            return (value, [a, b, c]);
        };
        let (other, [p, q, r]) = above.jet_by_axes(x);
        let columns = [(a, p), (b, q), (c, r)].map(|(own, other)| mix(own, other, *weight));
        (mix(value, other, *weight), columns)
    }
}

/// `(1 - w) a + w b`.
fn mix<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>, weight: f64) -> Tensor<B, 2> {
    a * (1.0 - weight) + b * weight
}

/// The `d` with `d_1 a + d_2 b + d_3 c = right`, row by row (Cramer's rule), `[n, 3]`.
fn solve<B: Backend>(columns: [Tensor<B, 2>; 3], right: Tensor<B, 2>) -> Tensor<B, 2> {
    let [a, b, c] = columns;
    let (bc, ca, ab) = (
        cross(b.clone(), c.clone()),
        cross(c, a.clone()),
        cross(a.clone(), b),
    );
    let determinant = dot(a, bc.clone());
    let parts = [bc, ca, ab].map(|plane| dot(right.clone(), plane));
    Tensor::cat(parts.into(), 1) / determinant
}
