//! Which way is out, told by the cloud as a whole.
//!
//! With the right dipoles `m_j`, area times outward normal, the winding number is 1/2 at every point
//! of a closed surface. The dipoles that come nearest to this, found from zero by a few steps of
//! conjugate gradients, need no normals at all (Lin, Xiao, Shi and Wang, "Surface reconstruction
//! from point clouds without normals by parametrizing the Gauss formula", ACM Transactions on
//! Graphics 42(2), 2022). Each tells at its point, with no regard to the neighbours, which side of
//! the tangent plane is out and how clear that is: also of the inner wall of a hollow, which no
//! rule about extreme points gets right.
//!
//! # Differs from the paper
//! The paper takes its normals from the dipoles and solves a dense regularised system; here only the signs are
//! taken, as evidence beside that of the neighbours, and the few steps are the regularisation.

use crate::geometry::linear::dot;
use crate::geometry::winding::{Charges, SummationTree};

/// Steps of conjugate gradients. Fewer leave thin parts in doubt, many more fit the spacing of the
/// points.
const STEPS: usize = 10;

/// For each point how clearly `normals`, the unit normals of the tangent planes, point out: 1 if
/// they surely do, -1 if they surely point in, near 0 where the cloud does not tell.
///
/// `areas` are those that the points stand for, `softening` the squares of the lengths below which
/// their places say nothing: spacing and noise.
pub(super) fn outward(
    points: &[[f64; 3]],
    normals: &[[f64; 3]],
    areas: &[f64],
    softening: &[f64],
) -> Vec<f64> {
    let problem = Problem {
        tree: SummationTree::new(points, softening),
        areas,
    };
    let dipoles = problem.solve();
    let clear = |((dipole, normal), &area): ((&[f64; 3], &[f64; 3]), &f64)| {
        if area > 0.0 {
            (dot(*dipole, *normal) / area).clamp(-1.0, 1.0)
        } else {
            0.0
        }
    };
    dipoles.iter().zip(normals).zip(areas).map(clear).collect()
}

/// The least squares problem `w = 1/2` at all points, each weighted by its area; the unknowns are
/// dipoles per area, so that dense places do not get more of a say.
struct Problem<'a> {
    tree: SummationTree,
    areas: &'a [f64],
}

impl Problem<'_> {
    /// Conjugate gradients for least squares (CGLS; Björck, "Numerical Methods for Least Squares Problems",
    /// 1996), from zero.
    ///
    /// Not `isomorph_model::linear::conjugate_gradient` on the normal equations: that takes the
    /// curvature from the product of the direction with `W^T W` of it, and `W^T` is only close to the
    /// adjoint of `W` here ([`SummationTree::pull_at_points`]). Here the curvature is a sum of squares, which
    /// cannot be negative, and the residual is that of the equations themselves.
    fn solve(&self) -> Vec<[f64; 3]> {
        let mut dipoles = vec![[0.0; 3]; self.areas.len()];
        let mut residual = vec![0.5; self.areas.len()];
        let (mut gradient, mut slope) = self.gradient(&residual);
        let mut direction = gradient;
        // A fixed number of steps and no tolerance: stopping early is the regularisation.
        for _ in 0..STEPS {
            let change = self.winding(&direction);
            let squares = change.iter().zip(self.areas).map(|(c, a)| c * c * a);
            let curvature: f64 = squares.sum();
            // Zero where the cloud has no extent: then nothing is known.
            if slope <= 0.0 || curvature <= 0.0 {
                break;
            }
            let step = slope / curvature;
            for (dipole, along) in dipoles.iter_mut().zip(&direction) {
                *dipole = [0, 1, 2].map(|axis| dipole[axis] + step * along[axis]);
            }
            for (left, changed) in residual.iter_mut().zip(&change) {
                *left -= step * changed;
            }
            let before = slope;
            (gradient, slope) = self.gradient(&residual);
            for (along, steepest) in direction.iter_mut().zip(&gradient) {
                *along = [0, 1, 2].map(|axis| steepest[axis] + slope / before * along[axis]);
            }
        }
        dipoles
    }

    /// The winding numbers about the points.
    fn winding(&self, dipoles: &[[f64; 3]]) -> Vec<f64> {
        let charges: Charges<3> = self.tree.charges(dipoles);
        self.tree.winding_at_points(&charges)
    }

    /// The steepest descent in dipoles, and its slope.
    fn gradient(&self, residual: &[f64]) -> (Vec<[f64; 3]>, f64) {
        let weighted = residual.iter().zip(self.areas).map(|(r, a)| [r * a]);
        let charges: Charges<1> = self.tree.charges(&weighted.collect::<Vec<_>>());
        let pulls = self.tree.pull_at_points(&charges);
        let scaled = pulls.iter().zip(self.areas);
        let scaled: Vec<[f64; 3]> = scaled.map(|(pull, area)| pull.map(|x| x * area)).collect();
        // Summed in order: the same on any number of cores.
        let slope = pulls.iter().zip(&scaled).map(|(a, b)| dot(*a, *b));
        let slope = slope.sum();
        (scaled, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::sphere_cloud;

    #[test]
    fn each_point_of_a_sphere_knows_which_way_is_out() {
        let points = sphere_cloud(2000, 1.0, 51);
        // Every other normal is turned inwards.
        let signs = [1.0, -1.0].repeat(1000);
        let normals: Vec<[f64; 3]> = (points.iter().zip(&signs))
            .map(|(p, sign)| p.map(|x| x * sign))
            .collect();
        let area = 4.0 * std::f64::consts::PI / 2000.0;
        let found = outward(&points, &normals, &[area; 2000], &[area; 2000]);
        for (evidence, sign) in found.iter().zip(&signs) {
            // The dipoles of a closed surface are its outward normals. Measured 0.97 or more.
            assert!(evidence * sign > 0.9, "{evidence}, of sign {sign}");
        }
    }

    #[test]
    fn a_plane_tells_nothing() {
        let points: Vec<[f64; 3]> = (0..400)
            .map(|i| [f64::from(i % 20), f64::from(i / 20), 7.0])
            .collect();
        let found = outward(&points, &[[0.0, 0.0, 1.0]; 400], &[1.0; 400], &[1.0; 400]);
        assert_eq!(found, [0.0; 400]);
    }
}
