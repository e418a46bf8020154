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

use super::affinity::{Columns, Likeness, Marks};
use super::cells::Cells;
use super::elastic::Pull;
use super::sparse::{ROWS, Row, Sparse};
use crate::geometry::linear::{Matrix, add, add_outer, length, scaled};

/// Rounds of scalings.
const ROUNDS: usize = 10;

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
    let pull = |i: usize| {
        let (mut sum, mut place, mut normal) = (0.0, [0.0; 3], [0.0; 3]);
        for (&j, &affinity) in std::iter::zip(affinities.rows.columns(i), affinities.rows.values(i))
        {
            let share = f64::from(u[i] * affinity * v[j as usize]);
            sum += share;
            let j = affinities.order[j as usize] as usize;
            place = add(place, scaled(target.points[j], share));
            normal = add(normal, scaled(target.normals[j], share));
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
    let nodes = (0..source.points.len()).into_par_iter();
    nodes.with_min_len(ROWS).map(pull).collect()
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

/// All affinities above 0.
struct Affinities {
    rows: Sparse,
    columns: Sparse,
    /// Which target each column is.
    order: Vec<u32>,
}

impl Affinities {
    fn new(source: &Marks<'_>, target: &Marks<'_>, likeness: &Likeness) -> Self {
        let cells = Cells::new(target.points, likeness.reach());
        let columns = Columns::new(target, likeness, &cells.order);
        let row = |i: usize, row: &mut Row| {
            let own = columns.mark(source, i);
            for run in cells.around(source.points[i]) {
                columns.append(own, run, row);
            }
        };
        let rows = Sparse::by_rows(source.points.len(), row);
        Self {
            columns: rows.transposed(target.points.len()),
            rows,
            order: cells.order,
        }
    }

    fn scalings(&self, slack: f32) -> (Vec<f32>, Vec<f32>) {
        let mut u = Vec::new();
        let mut v = vec![1.0; self.columns.len()];
        for _ in 0..ROUNDS {
            u = self.rows.scalings(&v, slack);
            v = self.columns.scalings(&u, slack);
        }
        (u, v)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::affinity::MOST_REMOTENESS;
    use super::*;
    use crate::geometry::linear::{difference, dot};

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

    #[test]
    fn what_is_left_out_moves_no_pull_by_more_than_a_fiftieth_of_sigma() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut points = || Vec::from_iter((0..300).map(|_| rng.random::<[f64; 3]>()));
        let sides = [points(), points()].map(|points| {
            let normal = |x: &[f64; 3]| scaled(*x, length(*x).recip());
            (Vec::from_iter(points.iter().map(normal)), points)
        });
        let remoteness = Vec::from_iter((0..300).map(|k| f64::from(k) / 300.0));
        let [ours, theirs] = sides.each_ref().map(|(normals, points)| Marks {
            points,
            normals,
            remoteness: &remoteness,
        });
        // From all points at once to cells in which most are left out.
        for sigma in [0.3, 0.1, 0.05] {
            let likeness = Likeness { sigma, ..LIKENESS };
            let found = pulls(&ours, &theirs, &likeness, 0.25);
            for (found, (to, sum)) in found.iter().zip(by_exhaustion(&ours, &theirs, &likeness)) {
                // exp(-12) over the square of the slack, .0025, for one or two of those left out: few are
                // that near to the limit and assigned to nothing else.
                let strength = found.strength.iter().enumerate().map(|(k, row)| row[k]);
                let strength = strength.sum::<f64>() * sigma * sigma / 1.5;
                assert!((strength - sum).abs() < 5e-3, "{strength} {sum}");
                let off = length(difference(found.to, to));
                assert!(sum < 5e-3 || off * sum < 2e-2 * sigma, "{off} at {sum}");
            }
        }
    }

    /// Means and sums of the assigned from all affinities, in float64.
    fn by_exhaustion(a: &Marks<'_>, b: &Marks<'_>, likeness: &Likeness) -> Vec<([f64; 3], f64)> {
        let affinity = |i: usize, j: usize| {
            let apart = length(difference(a.points[i], b.points[j])) / likeness.sigma;
            let cosine = dot(a.normals[i], b.normals[j]);
            let tolerance = likeness.remoteness.expect("it counts");
            let remoteness = (a.remoteness[i] - b.remoteness[j]) / tolerance;
            let remoteness = (0.5 * remoteness * remoteness).min(f64::from(MOST_REMOTENESS));
            (-(0.5 * apart * apart + likeness.normals * (1.0 - cosine) + remoteness)).exp()
        };
        let (rows, columns) = (0..a.points.len(), 0..b.points.len());
        let (mut u, mut v) = (vec![1.0; rows.len()], vec![1.0; columns.len()]);
        for _ in 0..ROUNDS {
            for i in rows.clone() {
                let sum: f64 = columns.clone().map(|j| affinity(i, j) * v[j]).sum();
                u[i] = (sum + likeness.slack).recip();
            }
            for j in columns.clone() {
                let sum: f64 = rows.clone().map(|i| affinity(i, j) * u[i]).sum();
                v[j] = (sum + likeness.slack).recip();
            }
        }
        let pull = |i: usize| {
            let share = |j: usize| u[i] * affinity(i, j) * v[j];
            let sum: f64 = columns.clone().map(share).sum();
            let place = columns.clone().fold([0.0; 3], |place, j| {
                add(place, scaled(b.points[j], share(j)))
            });
            (scaled(place, sum.recip()), sum)
        };
        rows.map(pull).collect()
    }
}
