//! The field's derivatives against differences in float64, and its subdivision.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::cell::Node;
use crate::ends::{EndTerms, Ends};
use crate::trajectory::diagonal;
use crate::{Grid, SplineError, SplineField, TimeBasis};

const GRID: Grid<f64> = Grid {
    lower: [-0.6, -0.5, -0.4],
    spacing: 0.15,
    cells: [8, 7, 6],
};

/// A smooth field of speed and gradient about 1, with coefficients drawn at random.
fn random_field(seed: u64) -> SplineField<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = GRID.size() * 6;
    let drawn: Vec<f64> = (0..count).map(|_| rng.random_range(-0.3..0.3)).collect();
    SplineField::from_parts(GRID, TimeBasis::Linear, &drawn).expect("valid")
}

fn points(count: usize) -> Vec<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let point = |_| [0.5, 0.4, 0.3].map(|half: f64| rng.random_range(-half..half));
    (0..count).map(point).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn jacobian_and_rate_are_those_of_differences() {
    let field = random_field(1);
    let (points, t, e) = (points(50), 0.3, 1e-5);
    let jets = field.jets(&points, &vec![t; points.len()]);
    let (after, before) = (field.values(&points, t + e), field.values(&points, t - e));
    for i in 0..3 {
        // V is linear in time: the difference is exact but for rounding, 1e-16 / e.
        for ((jet, after), before) in jets.iter().zip(&after).zip(&before) {
            assert!((jet.rate[i] - (after[i] - before[i]) / (2.0 * e)).abs() < 1e-9);
        }
        let shifted = |by: f64| {
            let mut moved = points.clone();
            for point in &mut moved {
                point[i] += by;
            }
            field.values(&moved, t)
        };
        let (right, left) = (shifted(e), shifted(-e));
        for ((jet, right), left) in jets.iter().zip(right).zip(left) {
            for a in 0..3 {
                let difference = (right[a] - left[a]) / (2.0 * e);
                // Second derivatives jump at the faces of cells by up to 100: an error of 100 e there.
                assert!((jet.jacobian[a][i] - difference).abs() < 2e-3);
            }
        }
    }
}

#[test]
fn beyond_the_box_the_velocity_is_that_of_its_border() {
    let field = random_field(2);
    let inside = [[-0.6, 0.1, 0.2], [0.6, 0.1, 0.2]];
    let outside = [[-3.0, 0.1, 0.2], [7.0, 0.1, 0.2]];
    let values = field.values(&inside, 0.4);
    for (jet, value) in field.jets(&outside, &[0.4; 2]).iter().zip(values) {
        assert!(distance(jet.value, value) < 1e-13);
        // Nothing changes along the axis that leaves the box; something does along the others.
        assert!((0..3).all(|a| jet.jacobian[a][0] == 0.0));
        assert!((0..3).any(|a| jet.jacobian[a][1] != 0.0));
    }
}

#[test]
fn halving_the_cells_changes_no_value() {
    let field = random_field(3);
    let fine = field.refined().expect("small");
    assert_eq!(fine.grid().cells, [16, 14, 12]);
    let points = points(200);
    let (a, b) = (field.values(&points, 0.7), fine.values(&points, 0.7));
    // A few roundings of numbers below 1.
    assert!(a.iter().zip(&b).all(|(&a, &b)| distance(a, b) < 1e-14));
    let changed = field.values(&points, 0.6);
    assert!(a.iter().zip(changed).any(|(&a, b)| distance(a, b) > 1e-3));
}

#[test]
fn coefficients_come_back_as_they_went() {
    let field = random_field(4);
    let same = SplineField::from_parts(GRID, TimeBasis::Linear, &field.coefficients());
    assert_eq!(same.expect("valid"), field);
    let few = SplineField::from_parts(GRID, TimeBasis::Linear, &[0.0; 7]);
    assert!(matches!(few, Err(SplineError::Lengths { found: 7, .. })));
    let mut damaged = field.coefficients();
    damaged[5] = f64::NAN;
    let damaged = SplineField::from_parts(GRID, TimeBasis::Linear, &damaged);
    assert!(matches!(damaged, Err(SplineError::Input { index: 5, .. })));
    for (spacing, cells) in [(0.0, [8, 7, 6]), (f64::NAN, [8, 7, 6]), (0.1, [8, 0, 6])] {
        let grid = Grid {
            spacing,
            cells,
            ..GRID
        };
        let field = SplineField::from_parts(grid, TimeBasis::Linear, &[]);
        assert!(matches!(field, Err(SplineError::Grid { .. })));
    }
}

#[test]
fn there_and_back_is_the_start_to_the_fourth_order() {
    let field = random_field(5);
    let points = points(50);
    let error = |steps: usize| {
        let there = field.carry(&points, 0.0, 1.0, steps);
        let back = field.carry(&there, 1.0, 0.0, steps);
        let sum: f64 = back
            .iter()
            .zip(&points)
            .map(|(&a, &b)| distance(a, b))
            .sum();
        sum / points.len() as f64
    };
    let (coarse, fine) = (error(16), error(64));
    // V has only one continuous derivative, so that steps across faces are of third order: 4^3, halved.
    assert!(fine > 0.0 && coarse / fine > 32.0, "{coarse} {fine}");
}

#[test]
fn the_gradient_of_a_place_is_that_of_differences() {
    let field = random_field(6);
    let (points, e) = (points(40), 1e-6);
    let carried = field.carry_with_gradient(&points, 0.0, 1.0, 2);
    let plain = field.carry(&points, 0.0, 1.0, 2);
    for j in 0..3 {
        let shifted = |by: f64| {
            let mut moved = points.clone();
            for point in &mut moved {
                point[j] += by;
            }
            field.carry(&moved, 0.0, 1.0, 2)
        };
        let (right, left) = (shifted(e), shifted(-e));
        for (at, carried) in carried.iter().enumerate() {
            assert!(distance(carried.point, plain[at]) < 1e-14);
            for i in 0..3 {
                let difference = (right[at][i] - left[at][i]) / (2.0 * e);
                // Jumps of second derivatives, as above.
                assert!((carried.gradient[i][j] - difference).abs() < 3e-4);
            }
        }
    }
}

/// How far ends move per unit along a direction of the coefficients: by the influences, and by differences.
fn moves(merge: bool) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let (mut field, direction) = (random_field(7), random_field(8));
    let points = points(60);
    let times = vec![[0.0, 1.0]; points.len()];
    let ends = Ends::new(&field, &points, &times, 2, merge);
    let plain = field.carry(&points, 0.0, 1.0, 2);
    assert!(
        ends.points
            .iter()
            .zip(&plain)
            .all(|(&a, &b)| distance(a, b) < 1e-14)
    );
    let carried = field.carry_with_gradient(&points, 0.0, 1.0, 2);
    for (a, b) in ends.gradients.iter().zip(&carried) {
        assert!((0..3).all(|i| distance(a[i], b.gradient[i]) < 1e-12));
    }
    let none = vec![[0.0; 3]; points.len()];
    let weights = vec![diagonal(1.0); points.len()];
    let mut terms = EndTerms::new(&field, &ends, none, weights);
    let analytic = terms.end_moves(&direction.nodes, field.grid().strides());
    let e = 1e-6;
    let mut along = |by: f64| {
        for (node, direction) in field.nodes.iter_mut().zip(&direction.nodes) {
            for (value, &by_one) in node.flat_mut().iter_mut().zip(direction.flat()) {
                *value += by * by_one;
            }
        }
        field.carry(&points, 0.0, 1.0, 2)
    };
    let right = along(e);
    let left = along(-2.0 * e);
    let difference = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|i| (a[i] - b[i]) / (2.0 * e));
    (analytic, right.iter().zip(&left).map(difference).collect())
}

fn relative_error(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let error: f64 = a.iter().zip(b).map(|(&a, &b)| distance(a, b).powi(2)).sum();
    let size: f64 = b.iter().map(|&b| distance(b, [0.0; 3]).powi(2)).sum();
    (error / size).sqrt()
}

#[test]
fn influences_are_the_derivatives_of_ends_by_coefficients() {
    let (analytic, differences) = moves(false);
    // V is once differentiable: the difference is off by about e where a path touches a face of a cell.
    let error = relative_error(&analytic, &differences);
    assert!(error < 1e-6, "{error:e}");
}

#[test]
fn merging_places_changes_the_derivatives_little() {
    let (analytic, differences) = moves(true);
    let error = relative_error(&analytic, &differences);
    // This field turns within a cell, far faster than a solved one; places of a pair are dt^2 / 4 apart.
    assert!(error > 1e-6 && error < 0.05, "{error:e}");
}

#[test]
fn sums_over_places_and_their_transposes_agree() {
    // a . (A b) = b . (A a) for the quadratic form of the ends, with weights that differ.
    let (field, a, b) = (random_field(10), random_field(11), random_field(12));
    let points = points(30);
    let times = vec![[1.0, 0.0]; points.len()];
    let ends = Ends::new(&field, &points, &times, 2, true);
    let weights = (0..30).map(|k| diagonal(1.0 + f64::from(k))).collect();
    let mut terms = EndTerms::new(&field, &ends, vec![[0.0; 3]; 30], weights);
    let mut product = |along: &[Node<f64>], with: &[Node<f64>]| {
        let strides = GRID.strides();
        terms.move_ends(along, strides);
        terms.spread_moves(strides);
        let mut out = vec![Node::ZERO; with.len()];
        crate::scatter::add_up(&[terms.parts()], with, 0.0, &mut out)
    };
    let (ab, ba) = (product(&a.nodes, &b.nodes), product(&b.nodes, &a.nodes));
    assert!(
        ab.abs() > 1e-3 && (ab - ba).abs() < 1e-12 * ab.abs(),
        "{ab} {ba}"
    );
}
