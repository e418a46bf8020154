//! Similarities: turns, shifts and one factor of size, and rotations as unit quaternions.

use super::linear::{Matrix, add, determinant, dot, product, scaled, times, transposed};

/// `x -> scale * rotation x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similarity {
    /// Above 0.
    pub scale: f64,
    /// By rows; proper: of determinant 1.
    pub rotation: Matrix,
    /// In the unit of the places that come out.
    pub translation: [f64; 3],
}

impl Similarity {
    /// Leaves all in place.
    pub(crate) const IDENTITY: Self = Self {
        scale: 1.0,
        rotation: super::linear::IDENTITY,
        translation: [0.0; 3],
    };

    /// Where a place goes.
    pub(crate) fn apply(&self, x: [f64; 3]) -> [f64; 3] {
        add(
            scaled(times(&self.rotation, x), self.scale),
            self.translation,
        )
    }

    /// The way back.
    #[must_use]
    pub(crate) fn inverse(&self) -> Self {
        let rotation = transposed(&self.rotation);
        let scale = self.scale.recip();
        Self {
            translation: scaled(times(&rotation, self.translation), -scale),
            rotation,
            scale,
        }
    }

    /// First this one, then the other.
    #[must_use]
    pub(crate) fn then(&self, next: &Self) -> Self {
        Self {
            scale: next.scale * self.scale,
            rotation: product(&next.rotation, &self.rotation),
            translation: next.apply(self.translation),
        }
    }
}

/// The angle of a rotation in radians, 0 to pi.
pub(crate) fn angle_of([a, b, c]: &Matrix) -> f64 {
    ((a[0] + b[1] + c[2] - 1.0) / 2.0).clamp(-1.0, 1.0).acos()
}

/// A rotation as a unit quaternion, its real part first.
pub(crate) type Quaternion = [f64; 4];

/// The quaternion of a rotation; of the two the one whose real part is not negative.
///
/// The largest of the four parts is found first, so that no small number divides (Shepperd, "Quaternion from
/// rotation matrix", J. Guidance and Control 1, 1978).
pub(crate) fn quaternion_of(r: &Matrix) -> Quaternion {
    debug_assert!((determinant(r) - 1.0).abs() < 1e-6, "a rotation");
    let [a, b, c] = [r[0][0], r[1][1], r[2][2]];
    // Four times the square of each part.
    let squares = [
        1.0 + a + b + c,
        1.0 + a - b - c,
        1.0 - a + b - c,
        1.0 - a - b + c,
    ];
    let sums = [
        [
            squares[0],
            r[2][1] - r[1][2],
            r[0][2] - r[2][0],
            r[1][0] - r[0][1],
        ],
        [
            r[2][1] - r[1][2],
            squares[1],
            r[1][0] + r[0][1],
            r[0][2] + r[2][0],
        ],
        [
            r[0][2] - r[2][0],
            r[1][0] + r[0][1],
            squares[2],
            r[2][1] + r[1][2],
        ],
        [
            r[1][0] - r[0][1],
            r[0][2] + r[2][0],
            r[2][1] + r[1][2],
            squares[3],
        ],
    ];
    let largest = (0..4).max_by(|&i, &j| squares[i].total_cmp(&squares[j]));
    let q = normalised(sums[largest.expect("four parts")]);
    if q[0] < 0.0 { q.map(|part| -part) } else { q }
}

/// The rotation of a quaternion of any length but 0.
pub(crate) fn rotation_of(q: Quaternion) -> Matrix {
    let [w, x, y, z] = normalised(q);
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// The even turn from one rotation to another at a share of the way (Shoemake, "Animating rotation with quaternion
/// curves", SIGGRAPH 1985).
pub(crate) fn even_turn(from: Quaternion, to: Quaternion, share: f64) -> Quaternion {
    let cosine = dot4(from, to);
    let angle = cosine.clamp(-1.0, 1.0).acos();
    let sine = angle.sin();
    let (a, b) = if sine < 1e-9 {
        (1.0 - share, share)
    } else {
        (
            ((1.0 - share) * angle).sin() / sine,
            (share * angle).sin() / sine,
        )
    };
    [0, 1, 2, 3].map(|k| a * from[k] + b * to[k])
}

/// The quaternion of the same rotation that is nearer to another one.
pub(crate) fn nearer(q: Quaternion, to: Quaternion) -> Quaternion {
    if dot4(q, to) < 0.0 {
        q.map(|part| -part)
    } else {
        q
    }
}

fn dot4(a: Quaternion, b: Quaternion) -> f64 {
    a[0] * b[0] + dot([a[1], a[2], a[3]], [b[1], b[2], b[3]])
}

fn normalised(q: Quaternion) -> Quaternion {
    let size = dot4(q, q).sqrt();
    q.map(|part| part / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// About an axis that is not one of the coordinates', by so many degrees.
    fn turn(degrees: f64) -> Matrix {
        let (sine, cosine) = (degrees / 2.0).to_radians().sin_cos();
        let axis = [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0];
        rotation_of([cosine, sine * axis[0], sine * axis[1], sine * axis[2]])
    }

    fn apart(a: &Matrix, b: &Matrix) -> f64 {
        let parts = a.as_flattened().iter().zip(b.as_flattened());
        parts.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn rotations_become_quaternions_and_back() {
        for degrees in [0.0, 1e-6, 30.0, 90.0, 179.0, 180.0, 200.0, 359.0] {
            let r = turn(degrees);
            let q = quaternion_of(&r);
            assert!(apart(&rotation_of(q), &r) < 1e-12, "{degrees}: {q:?}");
            assert!(q[0] >= 0.0, "{degrees}: {q:?}");
        }
    }

    #[test]
    fn a_turn_is_even() {
        let ends = [turn(10.0), turn(130.0)].map(|r| quaternion_of(&r));
        for (share, degrees) in [(0.0, 10.0), (0.25, 40.0), (0.5, 70.0), (1.0, 130.0)] {
            let between = rotation_of(even_turn(ends[0], ends[1], share));
            assert!(apart(&between, &turn(degrees)) < 1e-12, "{share}");
        }
    }

    #[test]
    fn a_similarity_has_a_way_back_and_a_sum() {
        let one = Similarity {
            scale: 3.0,
            rotation: turn(70.0),
            translation: [1.0, -2.0, 0.5],
        };
        let other = Similarity {
            scale: 0.1,
            rotation: turn(-20.0),
            translation: [0.0, 4.0, 1.0],
        };
        let x = [0.3, 0.7, -1.1];
        let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-12);
        assert!(close(one.inverse().apply(one.apply(x)), x));
        assert!(close(one.then(&other).apply(x), other.apply(one.apply(x))));
    }
}
