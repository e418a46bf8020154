//! The objective of one pose: handles arrive at their marks, and the surface between them stretches and
//! bends as little as it can.
//!
//! With `u_a = J t_a` the images of two orthonormal tangents `t_1, t_2` of the source surface at a sample `p`,
//! and `n' = (u_1 x u_2) / |u_1 x u_2|` the normal there after the deformation:
//!
//! ```text
//! handles = mean |D(x_i) - y_i|^2
//! stretch = mean sum_ab (<u_a, u_b> - <t_a, t_b>)^2
//! bend    = mean sum_a ((<u_a, n'_q - n'_p> - <t_a, n_q - n_p>) / |q - p|)^2
//! ```
//!
//! *Stretch* is the change of the first fundamental form, `|P^T (J^T J - I) P|_F^2` with `P = [t_1 t_2]`, and
//! depends on `P` through the tangent plane only. The *normal*: `u_1 x u_2` is `J^-T n` times `det J`, which is
//! positive for every `D` here, so that no inverse is needed and two tangents suffice.
//!
//! *Bend* is the change of the second fundamental form, pulled back to the source, along the one direction
//! `w = (q - p) / |q - p|` to a near neighbour `q` on the surface: `(II'(t_a, w) - II(t_a, w))^2` summed over
//! `a`. Over neighbours in all directions its mean is half of `|II' - II|_F^2`. Derivatives of the normal
//! are differences between neighbours because they need no second derivative of `D` and no curvature of the
//! source, which samples with normals do not give: both sides of the comparison read the same two given
//! normals, and what is wrong with these cancels to first order. In f32 the neighbours should be
//! 1e-3 or more apart, and closer than the deformation's finest detail.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use super::deformation::Nfgp;
use crate::autodiff::ModelBackend;
use crate::objective::Objective;
use crate::operators::length;

/// What one step of the optimisation of one pose is taken on, all of `[.., 3]`, normalised.
#[derive(Clone, Debug)]
pub struct NfgpSamples<B: Backend> {
    /// Points of the source whose marks are given, `[h, 3]`.
    pub handles: Tensor<B, 2>,
    /// Where they are to go, `[h, 3]`: for time t of a motion, the share t of the straight way to their
    /// correspondents.
    pub marks: Tensor<B, 2>,
    /// Samples `p` of the source surface, `[n, 3]`.
    pub points: Tensor<B, 2>,
    /// Their unit normals, `[n, 3]`.
    pub normals: Tensor<B, 2>,
    /// A near neighbour `q` of each on the surface, not the point itself, `[n, 3]`.
    pub neighbours: Tensor<B, 2>,
    /// The unit normals of the neighbours, `[n, 3]`.
    pub neighbour_normals: Tensor<B, 2>,
}

/// The weights of the terms; 0 turns one off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NfgpWeights {
    /// Of "handles".
    pub handles: f64,
    /// Of "stretch".
    pub stretch: f64,
    /// Of "bend".
    pub bend: f64,
}

impl Default for NfgpWeights {
    /// The ratios of the authors' published settings.
    fn default() -> Self {
        Self {
            handles: 100.0,
            stretch: 0.1,
            bend: 1e-3,
        }
    }
}

/// Points of a surface with what a deformation does to two tangents; before it, the tangents themselves.
#[derive(Clone, Debug)]
pub struct SurfacePoint<B: Backend> {
    /// `[n, 3]`.
    pub position: Tensor<B, 2>,
    /// `u_1` and `u_2`, `[n, 3]` each.
    pub tangents: [Tensor<B, 2>; 2],
    /// The unit normal, `[n, 3]`.
    pub normal: Tensor<B, 2>,
}

impl<B: Backend> SurfacePoint<B> {
    /// Points of the source, their tangents made from their normals.
    pub fn at_rest(position: Tensor<B, 2>, normal: Tensor<B, 2>) -> Self {
        Self {
            position,
            tangents: tangents(normal.clone()),
            normal,
        }
    }

    /// Points whose normal is that of the plane of two tangents, with its orientation.
    pub fn spanned(position: Tensor<B, 2>, tangents: [Tensor<B, 2>; 2]) -> Self {
        let [u, v] = tangents.clone();
        let area = cross(u, v);
        Self {
            position,
            tangents,
            normal: area.clone() / length(area),
        }
    }

    /// The first `n` rows and the others.
    fn split(self, n: usize) -> (Self, Self) {
        let rows = |start: usize, end: usize| {
            let cut = |tensor: &Tensor<B, 2>| tensor.clone().slice([start..end, 0..3]);
            Self {
                position: cut(&self.position),
                tangents: [cut(&self.tangents[0]), cut(&self.tangents[1])],
                normal: cut(&self.normal),
            }
        };
        (rows(0, n), rows(n, self.position.dims()[0]))
    }
}

/// Two unit tangents with `t_1 x t_2 = n`, of unit normals (Duff et al. 2017, "Building an Orthonormal
/// Basis, Revisited").
///
/// # Shapes
/// `[n, 3]` to two of `[n, 3]`.
pub fn tangents<B: Backend>(normal: Tensor<B, 2>) -> [Tensor<B, 2>; 2] {
    let [x, y, z] = coordinates(normal);
    // The sign of `z` keeps `sign + z` away from 0 at both poles.
    let sign = z.ones_like().mask_fill(z.clone().lower_elem(0.0), -1.0);
    let a = -z.ones_like() / (sign.clone() + z);
    let b = x.clone() * y.clone() * a.clone();
    let first = vec![
        sign.clone() * x.clone() * x.clone() * a.clone() + 1.0,
        sign.clone() * b.clone(),
        -sign.clone() * x,
    ];
    let second = vec![b, sign + y.clone() * y.clone() * a, -y];
    [Tensor::cat(first, 1), Tensor::cat(second, 1)]
}

/// The stretch at each sample, `sum_ab (<u_a, u_b> - [a = b])^2`, `[n, 1]`.
///
/// `tangents` are the images of two orthonormal tangents, `[n, 3]` each.
pub fn stretch<B: Backend>(tangents: &[Tensor<B, 2>; 2]) -> Tensor<B, 2> {
    let [u, v] = tangents;
    let (e, f, g) = (
        dot(u.clone(), u.clone()) - 1.0,
        dot(u.clone(), v.clone()),
        dot(v.clone(), v.clone()) - 1.0,
    );
    square(e) + square(f) * 2.0 + square(g)
}

/// The bend at each sample, `[n, 1]`, of pairs of neighbours before and after a deformation.
///
/// Of the points before it, the tangents at the neighbours are not read; of those after it, the positions
/// are not.
pub fn bend<B: Backend>(
    before: (&SurfacePoint<B>, &SurfacePoint<B>),
    after: (&SurfacePoint<B>, &SurfacePoint<B>),
) -> Tensor<B, 2> {
    let distance = length(before.1.position.clone() - before.0.position.clone());
    let turned = |pair: (&SurfacePoint<B>, &SurfacePoint<B>), a: usize| {
        let turn = pair.1.normal.clone() - pair.0.normal.clone();
        dot(pair.0.tangents[a].clone(), turn)
    };
    let change = |a: usize| square((turned(after, a) - turned(before, a)) / distance.clone());
    change(0) + change(1)
}

impl<B: ModelBackend> Nfgp<B> {
    /// The terms "handles", "stretch" and "bend" (the formulas are in this file's head).
    pub fn objective(&self, samples: &NfgpSamples<B>, weights: &NfgpWeights) -> Objective<B> {
        let net = self.normalised();
        let deformed = |rest: &SurfacePoint<B>| {
            let (position, pushed) = net.jet(rest.position.clone(), rest.tangents.clone());
            SurfacePoint::spanned(position, pushed)
        };
        let mut objective = Objective::new();
        objective.add("handles", weights.handles, || {
            let missing = net.forward(samples.handles.clone()) - samples.marks.clone();
            dot(missing.clone(), missing).mean()
        });
        let n = samples.points.dims()[0];
        let here = SurfacePoint::at_rest(samples.points.clone(), samples.normals.clone());
        // Without the bend no neighbour goes through the network: half of the points.
        if weights.bend == 0.0 {
            objective.add("stretch", weights.stretch, || {
                stretch(&deformed(&here).tangents).mean()
            });
            return objective;
        }
        let pairs = SurfacePoint::at_rest(
            Tensor::cat(vec![here.position, samples.neighbours.clone()], 0),
            Tensor::cat(vec![here.normal, samples.neighbour_normals.clone()], 0),
        );
        let after = deformed(&pairs).split(n);
        let before = pairs.split(n);
        objective.add("stretch", weights.stretch, || {
            stretch(&after.0.tangents).mean()
        });
        objective.add("bend", weights.bend, || {
            bend((&before.0, &before.1), (&after.0, &after.1)).mean()
        });
        objective
    }
}

/// The three columns, `[n, 1]` each.
fn coordinates<B: Backend>(rows: Tensor<B, 2>) -> [Tensor<B, 2>; 3] {
    let n = rows.dims()[0];
    std::array::from_fn(|k| rows.clone().slice([0..n, k..k + 1]))
}

/// The cross product of each pair of rows, `[n, 3]`.
pub(super) fn cross<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    let ([a0, a1, a2], [b0, b1, b2]) = (coordinates(a), coordinates(b));
    let first = a1.clone() * b2.clone() - a2.clone() * b1.clone();
    let second = a2 * b0.clone() - a0.clone() * b2;
    Tensor::cat(vec![first, second, a0 * b1 - a1 * b0], 1)
}

/// The inner product of each pair of rows, `[n, 1]`.
pub(super) fn dot<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    (a * b).sum_dim(1)
}

fn square<B: Backend>(rows: Tensor<B, 2>) -> Tensor<B, 2> {
    rows.clone() * rows
}
