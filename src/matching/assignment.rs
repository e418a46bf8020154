//! Which node of the target each node of the source belongs to, softly: a matrix whose rows and
//! columns each sum to at most 1.
//!
//! From affinities `K_ij` in [0, 1] the scalings `u_i = 1 / (sum_j K_ij v_j + c)`, `v_j = 1 /
//! (sum_i K_ij u_i + c)`, renewed in turn (Sinkhorn), give `P_ij = u_i K_ij v_j`. The slack `c` is
//! what stays unassigned: a node without a counterpart, all of whose affinities are below `c`, has
//! a small sum and pulls at nothing. Assigning in both directions is what draws the end of a limb
//! to the end of its counterpart, where each node's nearest would leave it beside it. Robust point
//! matching: Chui and Rangarajan, "A new point matching algorithm for non-rigid registration", CVIU
//! 89, 2003.

use rayon::prelude::*;

use super::elastic::Pull;
use crate::geometry::linear::{Matrix, add, add_outer, difference, dot, length, scaled};

/// Rounds of scalings.
const ROUNDS: usize = 10;

/// Affinities below `exp(-20)` are 0: they change no sum that float32 could show.
const FAINTEST: f64 = 20.0;

/// Rows that one core takes at a time: sums over them are added in this order whatever the number
/// of cores.
const ROWS: usize = 64;

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
const MOST_REMOTENESS: f64 = 4.0;

impl Likeness {
    fn affinity(&self, a: &Marks<'_>, i: usize, b: &Marks<'_>, j: usize) -> f32 {
        let apart = difference(a.points[i], b.points[j]);
        let mut exponent = dot(apart, apart) / (2.0 * self.sigma * self.sigma);
        if exponent > FAINTEST {
            return 0.0;
        }
        exponent += self.normals * (1.0 - dot(a.normals[i], b.normals[j]));
        if let Some(tolerance) = self.remoteness {
            let difference = (a.remoteness[i] - b.remoteness[j]) / tolerance;
            exponent += (0.5 * difference * difference).min(MOST_REMOTENESS);
        }
        if exponent > FAINTEST {
            0.0
        } else {
            (-exponent as f32).exp()
        }
    }
}

/// What the target pulls each node of the source to: the mean of the nodes assigned to it, as
/// strongly as they are assigned.
///
/// Along the mean normal of these nodes the strength is `sum_j P_ij / sigma^2`, across it `slide`
/// times as much: a surface that slides along itself stays where it is.
pub(super) fn pulls(
    source: &Marks<'_>,
    target: &Marks<'_>,
    likeness: &Likeness,
    slide: f64,
) -> Vec<Pull> {
    let affinities = Affinities::new(source, target, likeness);
    let (u, v) = affinities.scalings(likeness.slack as f32);
    let pull = |(i, row): (usize, &[f32])| {
        let (mut sum, mut place, mut normal) = (0.0, [0.0; 3], [0.0; 3]);
        for (j, &affinity) in row.iter().enumerate() {
            if affinity > 0.0 {
                let share = f64::from(u[i] * affinity * v[j]);
                sum += share;
                place = add(place, scaled(target.points[j], share));
                normal = add(normal, scaled(target.normals[j], share));
            }
        }
        let to = if sum > 0.0 {
            scaled(place, sum.recip())
        } else {
            source.points[i]
        };
        let strength = sum / (likeness.sigma * likeness.sigma);
        Pull {
            to,
            strength: sliding(strength, normal, slide),
        }
    };
    let rows = affinities.values.par_chunks(affinities.columns);
    rows.enumerate().map(pull).collect()
}

/// `strength` along the normal and `slide` times as much across it.
pub(super) fn sliding(strength: f64, normal: [f64; 3], slide: f64) -> Matrix {
    let length = length(normal);
    let mut matrix = [[0.0; 3]; 3];
    let across = if length > 0.0 {
        slide * strength
    } else {
        strength
    };
    for (k, row) in matrix.iter_mut().enumerate() {
        row[k] = across;
    }
    if length > 0.0 {
        let unit = scaled(normal, length.recip());
        add_outer(&mut matrix, strength - across, unit, unit);
    }
    matrix
}

/// All affinities, row by row.
struct Affinities {
    columns: usize,
    values: Vec<f32>,
}

impl Affinities {
    fn new(source: &Marks<'_>, target: &Marks<'_>, likeness: &Likeness) -> Self {
        let columns = target.points.len();
        let mut values = vec![0.0; source.points.len() * columns];
        let rows = values.par_chunks_mut(columns).enumerate();
        rows.for_each(|(i, row)| {
            for (j, value) in row.iter_mut().enumerate() {
                *value = likeness.affinity(source, i, target, j);
            }
        });
        Self { columns, values }
    }

    fn scalings(&self, slack: f32) -> (Vec<f32>, Vec<f32>) {
        let rows = self.values.len() / self.columns;
        let (mut u, mut v) = (vec![1.0; rows], vec![1.0; self.columns]);
        for _ in 0..ROUNDS {
            u = self
                .row_sums(&v)
                .into_iter()
                .map(|sum| (sum + slack).recip())
                .collect();
            v = self
                .column_sums(&u)
                .into_iter()
                .map(|sum| (sum + slack).recip())
                .collect();
        }
        (u, v)
    }

    /// `K v`.
    fn row_sums(&self, v: &[f32]) -> Vec<f32> {
        let rows = self.values.par_chunks(self.columns);
        rows.map(|row| row.iter().zip(v).map(|(k, v)| k * v).sum())
            .collect()
    }

    /// `K^T u`.
    fn column_sums(&self, u: &[f32]) -> Vec<f32> {
        let blocks = self
            .values
            .par_chunks(self.columns * ROWS)
            .zip(u.par_chunks(ROWS));
        let partial: Vec<Vec<f32>> = blocks
            .map(|(block, u)| {
                let mut sums = vec![0.0; self.columns];
                for (row, u) in block.chunks(self.columns).zip(u) {
                    for (sum, k) in sums.iter_mut().zip(row) {
                        *sum += k * u;
                    }
                }
                sums
            })
            .collect();
        let mut sums = vec![0.0; self.columns];
        for block in partial {
            for (sum, part) in sums.iter_mut().zip(block) {
                *sum += part;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIKENESS: Likeness = Likeness {
        sigma: 0.1,
        normals: 4.0,
        remoteness: Some(0.1),
        slack: 0.05,
    };

    /// Points along the x axis, each with the z coordinate of its normal, all equally remote.
    struct Row {
        points: Vec<[f64; 3]>,
        normals: Vec<[f64; 3]>,
        remoteness: Vec<f64>,
    }

    impl Row {
        fn new(points: &[(f64, f64)]) -> Self {
            Self {
                points: points.iter().map(|point| [point.0, 0.0, 0.0]).collect(),
                normals: points.iter().map(|point| [0.0, 0.0, point.1]).collect(),
                remoteness: vec![1.0; points.len()],
            }
        }

        fn marks(&self) -> Marks<'_> {
            Marks {
                points: &self.points,
                normals: &self.normals,
                remoteness: &self.remoteness,
            }
        }
    }

    fn pulls_between(ours: &[(f64, f64)], theirs: &[(f64, f64)]) -> Vec<Pull> {
        let (ours, theirs) = (Row::new(ours), Row::new(theirs));
        pulls(&ours.marks(), &theirs.marks(), &LIKENESS, 0.25)
    }

    #[test]
    fn what_has_no_counterpart_is_not_pulled_and_the_rest_is_pulled_to_its_own() {
        let up = |x: f64| (x, 1.0);
        let found = pulls_between(&[up(0.0), up(1.0), up(2.0)], &[up(2.05), up(0.05)]);
        // Along the normal, the z axis, the whole strength; across it a quarter.
        let strength = |k: usize| found[k].strength[2][2] * LIKENESS.sigma * LIKENESS.sigma;
        for (k, goal) in [(0, 0.05), (2, 2.05)] {
            assert!(
                (found[k].to[0] - goal).abs() < 1e-6,
                "a single partner: float32"
            );
            // u K v with u = v = 1 / (K v + c): about .95 for K = .88 and c = .05.
            assert!((0.9..=1.0).contains(&strength(k)), "{}", strength(k));
            assert!((found[k].strength[0][0] / found[k].strength[2][2] - 0.25).abs() < 1e-6);
        }
        assert_eq!(strength(1), 0.0, "ten standard deviations from everything");
    }

    #[test]
    fn a_point_that_faces_the_other_way_is_passed_over() {
        // One sheet above the other: the nearer candidate faces down.
        let found = pulls_between(&[(0.0, 1.0)], &[(0.02, -1.0), (0.08, 1.0)]);
        // exp(-8 - .02) against exp(-.32).
        assert!((found[0].to[0] - 0.08).abs() < 1e-3, "{:?}", found[0].to);
    }

    #[test]
    fn both_ends_of_a_row_are_drawn_to_the_ends_of_a_longer_one() {
        // Twenty points, their counterparts 1.25 times as far apart, each end .11 further out. What
        // is nearest to an end is not the end; assigned in both directions the mean pull there is
        // outward by most of the way.
        let row = |length: f64| -> Vec<(f64, f64)> {
            (0..20)
                .map(|k| (length * (f64::from(k) / 19.0 - 0.5), 1.0))
                .collect()
        };
        let found = pulls_between(&row(0.9), &row(1.125));
        let outward = found[19].to[0] - 0.45;
        assert!(outward > 0.03, "{outward}");
        assert!(
            (found[0].to[0] + found[19].to[0]).abs() < 1e-5,
            "mirrored: float32 sums"
        );
    }
}
