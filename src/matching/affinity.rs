//! How alike two points are: a number from 0 to 1, by distance, normals and remoteness.
//!
//! ```text
//! K_ij = exp(-|x_i - y_j|^2 / (2 sigma^2) - w (1 - n_i . n_j) - (r_i - r_j)^2 / (2 t^2))
//! ```
//!
//! with the last term at most [`MOST_REMOTENESS`]; 0 where it is below `exp(-12)`.

use std::ops::Range;

use super::sparse::Row;
use crate::geometry::linear::scaled;

/// Affinities below `exp(-12)` are 0. With a slack of `c` a share is at most the affinity over `c^2`:
/// what is left out of one is below .0025 with the slack of the registration.
const FAINTEST: f32 = 12.0;

/// Points with what tells them apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Marks<'a> {
    pub points: &'a [[f64; 3]],
    pub normals: &'a [[f64; 3]],
    pub remoteness: &'a [f64],
}

/// How alike two points must be to be assigned to each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Likeness {
    /// Standard deviation of the distance.
    pub sigma: f64,
    /// Weight of the angle between the normals: `exp(-weight (1 - cos))`.
    pub normals: f64,
    /// Standard deviation of the difference in remoteness; none: it does not count.
    pub remoteness: Option<f64>,
    /// The slack `c`.
    pub slack: f64,
}

/// The most that a difference in remoteness counts, as an exponent: where a part is missing, all of
/// a shape seems less remote than it is.
pub(super) const MOST_REMOTENESS: f32 = 4.0;

impl Likeness {
    /// The distance beyond which the affinity is 0.
    pub(super) fn reach(&self) -> f64 {
        self.sigma * f64::from(2.0 * FAINTEST).sqrt()
    }
}

/// A mark in numbers of which squares of differences and products make the exponent of the
/// affinity: places over `sigma sqrt(2)`, normals times the root of their weight, remoteness over
/// its tolerance times `sqrt(2)`.
pub(super) type Mark = [f32; 7];

/// The marks of the target, one number after the other, so that the machine takes several marks at
/// once.
pub(super) struct Columns {
    numbers: [Vec<f32>; 7],
    /// What the places, the normals and the remoteness are multiplied by.
    factors: [f64; 3],
    /// The weight of the normals.
    normals: f32,
}

impl Columns {
    pub(super) fn new(target: &Marks<'_>, likeness: &Likeness, order: &[u32]) -> Self {
        let root_half = std::f64::consts::FRAC_1_SQRT_2;
        let factors = [
            root_half / likeness.sigma,
            likeness.normals.sqrt(),
            likeness
                .remoteness
                .map_or(0.0, |tolerance| root_half / tolerance),
        ];
        let mut columns = Self {
            numbers: std::array::from_fn(|_| Vec::with_capacity(order.len())),
            factors,
            normals: likeness.normals as f32,
        };
        for &j in order {
            let mark = columns.mark(target, j as usize);
            for (numbers, number) in columns.numbers.iter_mut().zip(mark) {
                numbers.push(number);
            }
        }
        columns
    }

    pub(super) fn mark(&self, marks: &Marks<'_>, k: usize) -> Mark {
        let [place, normal, remoteness] = self.factors;
        let [x, y, z] = scaled(marks.points[k], place).map(|part| part as f32);
        let [a, b, c] = scaled(marks.normals[k], normal).map(|part| part as f32);
        [x, y, z, a, b, c, (marks.remoteness[k] * remoteness) as f32]
    }

    /// Appends what is above 0 of the affinities between a mark and a run of columns.
    pub(super) fn append(&self, own: Mark, run: Range<usize>, row: &mut Row) {
        let first = run.start as u32;
        let [x, y, z, a, b, c, d] = self.numbers.each_ref().map(|numbers| &numbers[run.clone()]);
        let count = x.len();
        row.exponents.clear();
        row.exponents.resize(count, 0.0);
        let exponents = &mut row.exponents[..count];
        let (y, z, a, b, c, d) = (
            &y[..count],
            &z[..count],
            &a[..count],
            &b[..count],
            &c[..count],
            &d[..count],
        );
        for k in 0..count {
            let (p, q, r) = (x[k] - own[0], y[k] - own[1], z[k] - own[2]);
            let cosine = a[k] * own[3] + b[k] * own[4] + c[k] * own[5];
            let remoteness = d[k] - own[6];
            let remoteness = remoteness * remoteness;
            let remoteness = if remoteness < MOST_REMOTENESS {
                remoteness
            } else {
                MOST_REMOTENESS
            };
            exponents[k] = p * p + q * q + r * r + (self.normals - cosine) + remoteness;
        }
        for (column, &exponent) in (first..).zip(&*exponents) {
            if exponent <= FAINTEST {
                row.columns.push(column);
                row.values.push(exponent);
            }
        }
    }
}
