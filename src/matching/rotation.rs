//! Rotations nearest to a matrix, and the rigid motion that carries points onto points best.
//!
//! The rotation `R` that maximises `trace(R^T C)` is that of the unit quaternion which is the
//! eigenvector with the greatest eigenvalue of a symmetric 4 x 4 matrix linear in `C` (Horn,
//! "Closed-form solution of absolute orientation using unit quaternions", J. Opt. Soc. Am. A 4,
//! 1987): always proper, also where `C` is flat or mirrored.

use crate::geometry::linear::{
    IDENTITY, Matrix, add, add_outer, difference, mean, symmetric_eigen, times, transposed,
};

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
        let [a, b, c] = self.rotation;
        ((a[0] + b[1] + c[2] - 1.0) / 2.0).clamp(-1.0, 1.0).acos()
    }

    /// The motion with the least `sum |R x_k + t - y_k|^2` over pairs `(x_k, y_k)`; the identity of
    /// none.
    pub(super) fn between(pairs: &[([f64; 3], [f64; 3])]) -> Self {
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
}
