//! Large symmetric systems `A x = b` that are known by products `A x` alone.
//!
//! Conjugate gradients (Hestenes and Stiefel, 1952), optionally preconditioned by the diagonal `D` of `A`:
//!
//! ```text
//! r = b - A x,  z = D^-1 r,  p = z
//! s = (r . z) / (p . A p),  x += s p,  r -= s A p
//! z' = D^-1 r',  p = z' + (r' . z') / (r . z) p
//! ```

/// How far [`conjugate_gradient`] goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// It ends after this many products `A p`, whatever is left.
    pub steps: usize,
    /// It ends when `|b - A x|` has fallen to this share of `|b|`.
    pub tolerance: f64,
}

/// Improves `x` towards the solution of `A x = right`, with `A` symmetric and positive semidefinite.
///
/// `apply(x, image)` writes `A x` into `image`, whose former contents mean nothing. `diagonal` is that of
/// `A`, or `None` to go without a preconditioner; where an entry is 0 the unknown keeps its value. The
/// iteration also ends where `A` has no curvature along the next direction.
///
/// Sums run in the order of the unknowns, so the result is the same on any number of cores.
///
/// # Panics
/// If the lengths of `right`, `x` and `diagonal` differ.
pub fn conjugate_gradient(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    right: &[f64],
    diagonal: Option<&[f64]>,
    x: &mut [f64],
    until: Until,
) {
    let count = right.len();
    assert_eq!(x.len(), count, "unknowns and equations");
    assert_eq!(
        diagonal.map_or(count, <[_]>::len),
        count,
        "the diagonal and the equations"
    );
    let precondition = |residual: &[f64], into: &mut Vec<f64>| {
        into.clear();
        match diagonal {
            None => into.extend_from_slice(residual),
            Some(diagonal) => into.extend(residual.iter().zip(diagonal).map(|(r, d)| {
                // An unknown without an entry of its own takes part in nothing.
                if *d > 0.0 { r / d } else { 0.0 }
            })),
        }
    };
    let mut image = vec![0.0; count];
    apply(x, &mut image);
    let mut residual: Vec<f64> = right.iter().zip(&image).map(|(b, ax)| b - ax).collect();
    let mut conditioned = Vec::with_capacity(count);
    precondition(&residual, &mut conditioned);
    let mut direction = conditioned.clone();
    let mut slope = dot(&residual, &conditioned);
    let enough = until.tolerance * until.tolerance * dot(right, right);
    for _ in 0..until.steps {
        if dot(&residual, &residual) <= enough || slope <= 0.0 {
            return;
        }
        apply(&direction, &mut image);
        let curvature = dot(&direction, &image);
        if curvature <= 0.0 {
            return;
        }
        let step = slope / curvature;
        for k in 0..count {
            x[k] += step * direction[k];
            residual[k] -= step * image[k];
        }
        precondition(&residual, &mut conditioned);
        let next = dot(&residual, &conditioned);
        let turn = next / slope;
        for (along, steepest) in direction.iter_mut().zip(&conditioned) {
            *along = steepest + turn * *along;
        }
        slope = next;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// `A x` of a matrix by rows.
    fn product(matrix: &[Vec<f64>]) -> impl FnMut(&[f64], &mut [f64]) {
        move |x, image| {
            for (image, row) in image.iter_mut().zip(matrix) {
                *image = dot(row, x);
            }
        }
    }

    fn diagonal(matrix: &[Vec<f64>]) -> Vec<f64> {
        (0..matrix.len()).map(|k| matrix[k][k]).collect()
    }

    const FULLY: Until = Until {
        steps: 100,
        tolerance: 1e-12,
    };

    #[test]
    fn three_equations_are_solved_in_three_steps() {
        // (1, -2, 3) solves it: 4 - 2 + 0 = 2, 1 - 6 + 3 = -2, 0 - 2 + 6 = 4.
        let matrix = [
            vec![4.0, 1.0, 0.0],
            vec![1.0, 3.0, 1.0],
            vec![0.0, 1.0, 2.0],
        ];
        let right = [2.0, -2.0, 4.0];
        let until = Until { steps: 3, ..FULLY };
        for diagonal in [None, Some(diagonal(&matrix))] {
            let mut x = [0.0; 3];
            conjugate_gradient(product(&matrix), &right, diagonal.as_deref(), &mut x, until);
            for (found, expected) in x.iter().zip([1.0, -2.0, 3.0]) {
                // Exact after as many steps as unknowns, but for a few dozen roundings.
                assert!((found - expected).abs() < 1e-13, "{x:?}");
            }
        }
    }

    #[test]
    fn a_step_goes_to_the_least_energy_along_the_residual() {
        // From (0, 0), b = (1, 1) and A = diag(1, 3): |b|^2 / b.Ab = 2/4, so x = b / 2.
        let matrix = [vec![1.0, 0.0], vec![0.0, 3.0]];
        let mut x = [0.0; 2];
        let until = Until { steps: 1, ..FULLY };
        conjugate_gradient(product(&matrix), &[1.0, 1.0], None, &mut x, until);
        assert_eq!(x, [0.5, 0.5]);
        // Divided by the diagonal the direction leads straight to the solution.
        let mut x = [0.0; 2];
        let diagonal = Some(&[1.0, 3.0][..]);
        conjugate_gradient(product(&matrix), &[1.0, 1.0], diagonal, &mut x, until);
        assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_random_positive_definite_system_is_solved_from_any_start() {
        let count = 40;
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let mut draw = || rng.random_range(-1.0..1.0);
        let factor: Vec<Vec<f64>> = (0..count)
            .map(|_| (0..count).map(|_| draw()).collect())
            .collect();
        // B B^T + I: eigenvalues from 1 to about 60.
        let entry = |i: usize, j: usize| dot(&factor[i], &factor[j]) + f64::from(u8::from(i == j));
        let matrix: Vec<Vec<f64>> = (0..count)
            .map(|i| (0..count).map(|j| entry(i, j)).collect())
            .collect();
        let expected: Vec<f64> = (0..count).map(|_| draw()).collect();
        let mut right = vec![0.0; count];
        product(&matrix)(&expected, &mut right);
        let diagonal = diagonal(&matrix);
        for diagonal in [None, Some(&diagonal[..])] {
            let mut x: Vec<f64> = (0..count).map(|_| draw()).collect();
            conjugate_gradient(product(&matrix), &right, diagonal, &mut x, FULLY);
            let worst =
                (x.iter().zip(&expected)).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            // The residual is 1e-12 of |b|, about 100; the least eigenvalue is at least 1.
            assert!(worst < 1e-9, "{worst}");
        }
    }

    #[test]
    fn an_unknown_that_no_equation_holds_keeps_its_value() {
        let matrix = [vec![2.0, 0.0], vec![0.0, 0.0]];
        let mut x = [0.0, 7.0];
        let diagonal = Some(&[2.0, 0.0][..]);
        conjugate_gradient(product(&matrix), &[4.0, 0.0], diagonal, &mut x, FULLY);
        assert_eq!(x, [2.0, 7.0]);
    }
}
