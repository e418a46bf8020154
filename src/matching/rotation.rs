//! Rotations nearest to a matrix, and the rigid motion that carries points onto points best.
//!
//! The rotation `R` that maximises `trace(R^T C)` is that of the unit quaternion which is the
//! eigenvector with the greatest eigenvalue of a symmetric 4 x 4 matrix linear in `C` (Horn,
//! "Closed-form solution of absolute orientation using unit quaternions", J. Opt. Soc. Am. A 4,
//! 1987): always proper, also where `C` is flat or mirrored.

use crate::geometry::linear::{
    IDENTITY, Matrix, add, add_outer, cross, difference, dot, mean, scaled, symmetric_eigen, times,
    transposed,
};
use crate::geometry::similarity::angle_of;

/// `x -> rotation x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RigidMotion {
    /// By rows; proper: of determinant 1.
    pub rotation: [[f64; 3]; 3],
    /// In the unit of the points.
    pub translation: [f64; 3],
}

impl RigidMotion {
    /// The motion that leaves all in place.
    pub(crate) const IDENTITY: Self = Self {
        rotation: IDENTITY,
        translation: [0.0; 3],
    };

    /// Where a point goes.
    pub(crate) fn apply(&self, x: [f64; 3]) -> [f64; 3] {
        add(times(&self.rotation, x), self.translation)
    }

    /// The motion back.
    #[must_use]
    pub(crate) fn inverse(&self) -> Self {
        let rotation = transposed(&self.rotation);
        Self {
            translation: times(&rotation, self.translation).map(|part| -part),
            rotation,
        }
    }

    /// The angle of the rotation in radians, 0 to pi.
    pub(crate) fn angle(&self) -> f64 {
        angle_of(&self.rotation)
    }

    /// The motion with the least `sum |R x_k + t - y_k|^2` over pairs `(x_k, y_k)`; the identity of
    /// none.
    pub(crate) fn between(pairs: &[([f64; 3], [f64; 3])]) -> Self {
        if pairs.is_empty() {
            return Self::IDENTITY;
        }
        let from = mean(pairs.iter().map(|pair| pair.0));
        let to = mean(pairs.iter().map(|pair| pair.1));
        let mut covariance = [[0.0; 3]; 3];
        for (x, y) in pairs {
            add_outer(
                &mut covariance,
                1.0,
                difference(*y, to),
                difference(*x, from),
            );
        }
        Self::about(nearest_rotation(&covariance), from, to)
    }

    /// The rotation that takes the point `from` to `to`.
    pub(super) fn about(rotation: Matrix, from: [f64; 3], to: [f64; 3]) -> Self {
        Self {
            translation: difference(to, times(&rotation, from)),
            rotation,
        }
    }
}

/// The proper rotation `R` with the greatest `trace(R^T C)`.
pub(super) fn nearest_rotation(c: &Matrix) -> Matrix {
    polar_rotation(c).unwrap_or_else(|| turned_by_quaternion(c))
}

/// Steps of the polar decomposition; a matrix that [`LEAST_VOLUME`] admits takes up to eight.
const POLAR_STEPS: usize = 12;

/// The polar decomposition is left to matrices whose determinant is at least this share of the cube
/// of their size.
const LEAST_VOLUME: f64 = 1e-9;

/// The rotation of the polar decomposition of a matrix with a positive determinant; none of others.
///
/// `X -> (g X + X^-T / g) / 2` with `g^2 = |X^-1| / |X|` doubles the right digits with each step
/// (Higham, "Computing the polar decomposition - with applications", SIAM J. Sci. Stat. Comput. 7,
/// 1986).
fn polar_rotation(c: &Matrix) -> Option<Matrix> {
    let mut x = *c;
    let size = |m: &Matrix| (dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2])).sqrt();
    for step in 0..POLAR_STEPS {
        let cofactors = [cross(x[1], x[2]), cross(x[2], x[0]), cross(x[0], x[1])];
        let volume = dot(x[0], cofactors[0]);
        let (own, inverse) = (size(&x), size(&cofactors));
        if step == 0 && (volume.is_nan() || volume <= LEAST_VOLUME * own * own * own) {
            return None;
        }
        // X^-T is the matrix of the cofactors over the determinant.
        let factor = (inverse / (volume * own)).sqrt();
        let (mine, theirs) = (0.5 * factor, 0.5 / (factor * volume));
        let mixed = |row: usize| add(scaled(x[row], mine), scaled(cofactors[row], theirs));
        let next = [mixed(0), mixed(1), mixed(2)];
        let apart = |row: usize| difference(next[row], x[row]);
        let change = [apart(0), apart(1), apart(2)];
        x = next;
        if size(&change) < CLOSE {
            return Some(x);
        }
    }
    None
}

/// The last step of the polar decomposition changes nothing beyond this; its square is below
/// rounding.
const CLOSE: f64 = 1e-8;

/// The rotation of the unit quaternion that Horn's matrix has.
fn turned_by_quaternion(c: &Matrix) -> Matrix {
    // Horn's matrix for S_ab = sum x_a y_b, which is the transpose of C = sum y x^T.
    let s = transposed(c);
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let (values, vectors) = symmetric_eigen([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ]);
    let greatest = (0..4).max_by(|&i, &j| values[i].total_cmp(&values[j]));
    let greatest = greatest.expect("four eigenvalues");
    let [w, x, y, z] = [0, 1, 2, 3].map(|row| vectors[row][greatest]);
    [
        [
            w * w + x * x - y * y - z * z,
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            w * w - x * x + y * y - z * z,
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            w * w - x * x - y * y + z * z,
        ],
    ]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::linear::{cross, determinant, dot, length, product};

    /// By Rodrigues' formula about the axis (2, -1, 2) / 3.
    pub(crate) fn turn(angle: f64) -> Matrix {
        let axis = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
        let (sin, cos) = angle.sin_cos();
        let mut columns = [[0.0; 3]; 3];
        for (k, column) in columns.iter_mut().enumerate() {
            let x = IDENTITY[k];
            let across = cross(axis, x);
            let along = dot(axis, x) * (1.0 - cos);
            *column = [0, 1, 2].map(|row| cos * x[row] + sin * across[row] + along * axis[row]);
        }
        transposed(&columns)
    }

    fn farthest(a: &Matrix, b: &Matrix) -> f64 {
        let parts = a.as_flattened().iter().zip(b.as_flattened());
        parts.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
    }

    #[test]
    fn a_rigid_motion_is_found_again_to_rounding() {
        let points = [
            [0.3, -1.0, 2.0],
            [1.5, 0.2, -0.7],
            [-0.4, 0.9, 0.1],
            [0.0, 0.0, 1.0],
        ];
        for angle in [0.0, 0.4, 2.0, std::f64::consts::PI] {
            let motion = RigidMotion {
                rotation: turn(angle),
                translation: [0.5, -2.0, 7.0],
            };
            let pairs = points.map(|x| (x, motion.apply(x)));
            let found = RigidMotion::between(&pairs);
            // Sums of four products of numbers up to 7: a few hundred roundings of 2e-16.
            assert!(farthest(&found.rotation, &motion.rotation) < 1e-13);
            assert!(
                (found.angle() - angle).abs() < 1e-6,
                "acos near its ends halves the digits"
            );
            for x in points {
                let back = found.inverse().apply(found.apply(x));
                assert!(length(difference(back, x)) < 1e-13);
            }
        }
    }

    #[test]
    fn of_a_mirrored_or_a_flat_matrix_the_rotation_is_proper() {
        let mirror = [[-1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
        let flat = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]];
        for matrix in [mirror, flat, [[0.0; 3]; 3]] {
            let rotation = nearest_rotation(&matrix);
            let square = product(&rotation, &transposed(&rotation));
            assert!(farthest(&square, &IDENTITY) < 1e-14);
            assert!((determinant(&rotation) - 1.0).abs() < 1e-14);
        }
        // Of the mirror along the axis that weighs least nothing is left but the identity.
        assert!(farthest(&nearest_rotation(&mirror), &IDENTITY) < 1e-14);
        assert!(farthest(&nearest_rotation(&flat), &IDENTITY) < 1e-14);
    }

    #[test]
    fn both_ways_to_the_nearest_rotation_agree() {
        // Stretched by a factor of a thousand, and nearly mirrored.
        for stretch in [[1.0, 1.0, 1.0], [3.0, 0.5, 0.003], [1e-4, 2e-4, 5e-5]] {
            let scale = [0, 1, 2].map(|k| scaled(IDENTITY[k], stretch[k]));
            for angle in [0.0, 0.3, 1.5, 3.0] {
                let c = product(&turn(angle), &product(&turn(0.7), &scale));
                let polar = polar_rotation(&c).expect("a positive determinant");
                // Rounding of the matrix moves the rotation by its size over its least stretch.
                assert!(farthest(&polar, &turned_by_quaternion(&c)) < 1e-12);
                assert!(farthest(&polar, &product(&turn(angle), &turn(0.7))) < 1e-12);
            }
        }
        assert_eq!(polar_rotation(&[[0.0; 3]; 3]), None);
        assert_eq!(polar_rotation(&[[f64::NAN; 3]; 3]), None);
        let mirror = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(polar_rotation(&mirror), None);
    }
}
