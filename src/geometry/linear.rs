//! Vectors of three numbers, 3 x 3 matrices by rows, and eigenvectors of small symmetric matrices.
//!
//! Both are plain arrays, because points live in arrays wherever they come from or go to: files, k-d
//! trees, tensors, JSON. A crate such as glam would need a conversion at each of these borders and
//! has no eigenvectors; what is used of it is written here in a few lines.
//!
//! The smallest are marked `#[inline]`: without link-time optimisation they would else stay calls, and their
//! callers are loops over all points.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

/// A coordinate: `f32` (normalised) or `f64` (the user's).
pub trait Scalar:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
{
}

impl Scalar for f32 {}
impl Scalar for f64 {}

mod sealed {
    /// No other type is a coordinate.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A 3 x 3 matrix by rows.
pub(crate) type Matrix = [[f64; 3]; 3];

/// The matrix that changes nothing.
pub(crate) const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Sweeps of Jacobi rotations: a matrix of up to 4 x 4 is diagonal to float64 after about six.
const SWEEPS: usize = 10;

/// `a + b`.
#[inline]
pub(crate) fn add<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline]
pub(crate) fn difference<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `factor x`.
#[inline]
pub(crate) fn scaled<T: Scalar>(x: [T; 3], factor: T) -> [T; 3] {
    [factor * x[0], factor * x[1], factor * x[2]]
}

/// Scalar product.
#[inline]
pub(crate) fn dot<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
#[inline]
pub(crate) fn cross<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Euclidean length.
#[inline]
pub(crate) fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// Whether all parts are numbers: neither NaN nor infinite.
pub(crate) fn is_finite(x: &[f64; 3]) -> bool {
    x.iter().all(|part| part.is_finite())
}

/// Two unit vectors at right angles to a unit normal and to each other; the second lies to the left of the first, seen
/// from where the normal points.
pub(crate) fn tangents(normal: [f32; 3]) -> [[f32; 3]; 2] {
    // An axis that is not along it.
    let axis = match normal[0].abs() < 0.8 {
        true => [1.0, 0.0, 0.0],
        false => [0.0, 1.0, 0.0],
    };
    let across = unit(cross(normal, axis));
    [across, cross(normal, across)]
}

/// The vector scaled to unit length, or zero where it has no direction.
pub(crate) fn unit<T: Scalar>(v: [T; 3]) -> [f32; 3] {
    let v = v.map(T::into);
    let length = length(v);
    if length > 0.0 && length.is_finite() {
        v.map(|coordinate| (coordinate / length) as f32)
    } else {
        [0.0; 3]
    }
}

/// The mean of points, summed relative to the first: far from the origin the sums would cancel. The
/// origin if there are none.
pub(crate) fn mean(points: impl Iterator<Item = [f64; 3]> + Clone) -> [f64; 3] {
    let mut rest = points.clone();
    let Some(origin) = rest.next() else {
        return [0.0; 3];
    };
    let count = (rest.count() + 1) as f64;
    let away = points.fold([0.0; 3], |sum, point| add(sum, difference(point, origin)));
    [0, 1, 2].map(|axis| origin[axis] + away[axis] / count)
}

/// `M x`.
#[inline]
pub(crate) fn times(m: &Matrix, x: [f64; 3]) -> [f64; 3] {
    [dot(m[0], x), dot(m[1], x), dot(m[2], x)]
}

/// `A B`.
pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    [0, 1, 2].map(|row| columns.map(|column| dot(a[row], column)))
}

/// `M^T`.
pub(crate) fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| m[column][row]))
}

/// The determinant.
pub(crate) fn determinant(m: &Matrix) -> f64 {
    dot(m[0], cross(m[1], m[2]))
}

/// `m += weight y x^T`.
#[inline]
pub(crate) fn add_outer(m: &mut Matrix, weight: f64, y: [f64; 3], x: [f64; 3]) {
    for row in 0..3 {
        for column in 0..3 {
            m[row][column] += weight * y[row] * x[column];
        }
    }
}

/// Eigenvalues of a symmetric matrix and its eigenvectors as columns, by cyclic Jacobi rotations.
pub(crate) fn symmetric_eigen<const N: usize>(mut a: [[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut vectors = [[0.0; N]; N];
    for (k, row) in vectors.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for _ in 0..SWEEPS {
        for p in 0..N {
            for q in p + 1..N {
                rotate(&mut a, &mut vectors, p, q);
            }
        }
    }
    (std::array::from_fn(|k| a[k][k]), vectors)
}

/// Turns the p-q plane such that `a[p][q]` becomes zero, by the smaller of the two angles that do so:
/// the larger one would exchange the axes, and the sweeps would not settle.
fn rotate<const N: usize>(a: &mut [[f64; N]; N], vectors: &mut [[f64; N]; N], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cos = tangent.hypot(1.0).recip();
    let sin = tangent * cos;
    for row in a.iter_mut().chain(vectors) {
        (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
    }
    let (upper, lower) = (a[p], a[q]);
    for k in 0..N {
        a[p][k] = cos * upper[k] - sin * lower[k];
        a[q][k] = sin * upper[k] + cos * lower[k];
    }
}

/// Column `k` of a matrix.
pub(crate) fn column(m: &Matrix, k: usize) -> [f64; 3] {
    [m[0][k], m[1][k], m[2][k]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_textbook() {
        let (a, b) = ([1.0, 2.0, 3.0], [-2.0, 0.5, 4.0]);
        assert_eq!(dot(a, b), 11.0);
        // 2 * 4 - 3 / 2, 3 * -2 - 4, 1 / 2 + 4.
        assert_eq!(cross(a, b), [6.5, -10.0, 4.5]);
        assert_eq!(cross([0.0_f32, 1.0, 0.0], [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        let m = [[1.0, 2.0, 0.0], [0.0, 1.0, 3.0], [4.0, 0.0, 1.0]];
        assert_eq!(times(&m, a), [5.0, 11.0, 7.0]);
        assert_eq!(determinant(&m), 25.0);
        assert_eq!(product(&m, &IDENTITY), m);
        assert_eq!(product(&IDENTITY, &m), m);
        assert_eq!(column(&transposed(&m), 1), m[1]);
    }

    #[test]
    fn the_mean_keeps_its_digits_far_from_the_origin() {
        // Half a step at 2^30 takes 51 bits and fits. The plain sum of 1000 such numbers takes 60 and
        // would not.
        let far = 2.0_f64.powi(30);
        let step = 2.0_f64.powi(-20);
        let points = (0..1000).map(|k| [far + step * f64::from(k % 2), -far, 0.0]);
        assert_eq!(mean(points), [far + step / 2.0, -far, 0.0]);
        assert_eq!(mean(std::iter::empty()), [0.0; 3]);
    }

    #[test]
    fn unit_vectors_are_of_length_1_and_nothing_stays_nothing() {
        assert_eq!(unit([0.0, -3.0, 4.0]), [0.0, -0.6, 0.8]);
        assert_eq!(unit([0.0_f32, 0.0, 1e-30]), [0.0, 0.0, 1.0]);
        assert_eq!(unit([0.0; 3]), [0.0_f32; 3]);
        assert_eq!(unit([f64::NAN, 0.0, 0.0]), [0.0; 3]);
    }

    #[test]
    fn eigenvectors_are_those_of_a_matrix_built_from_them() {
        let vectors = [[0.36, 0.48, 0.8], [0.8, -0.6, 0.0]];
        let vectors = [vectors[0], vectors[1], cross(vectors[0], vectors[1])];
        let mut matrix = [[0.0; 3]; 3];
        for (value, vector) in [0.1, 2.0, 5.0].into_iter().zip(vectors) {
            add_outer(&mut matrix, value, vector, vector);
        }
        let (values, found) = symmetric_eigen(matrix);
        for (value, vector) in [0.1, 2.0, 5.0].into_iter().zip(vectors) {
            let k = (0..3).min_by(|&i, &j| {
                (values[i] - value)
                    .abs()
                    .total_cmp(&(values[j] - value).abs())
            });
            let k = k.expect("three eigenvalues");
            // Jacobi is accurate to a few roundings of the largest entry.
            assert!((values[k] - value).abs() < 1e-14, "{values:?}");
            assert!((dot(column(&found, k), vector).abs() - 1.0).abs() < 1e-14);
        }
    }
}
