//! The linear system whose solution moves tied nodes, by preconditioned conjugate gradients.

use isomorph_model::linear::{Until, conjugate_gradient};

use crate::geometry::linear::{Matrix, add, difference, scaled};

/// Where conjugate gradients end, relative to the forces that the round began with; the next round
/// starts from there.
const UNTIL: Until = Until {
    steps: 60,
    tolerance: 0.03,
};

/// The normal equations of the places: a 3 x 3 block for each node, and a multiple of the identity
/// for each tie. With the blocks' Cholesky factors, `D = L L^T`, the unknowns are `L^T z`: pulls
/// differ by orders of magnitude between nodes and between the directions along and across a
/// surface, and conjugate gradients need few steps if no unknown is stiffer than others.
pub(super) struct System<'a> {
    pub factors: Vec<InverseFactor>,
    pub neighbours: &'a Neighbours,
    pub couplings: Vec<f64>,
}

impl System<'_> {
    pub(super) fn solve(&self, forces: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let scaled = self.factors.iter().zip(forces);
        let scaled: Vec<[f64; 3]> = scaled.map(|(factor, force)| factor.apply(*force)).collect();
        let mut unknowns = vec![[0.0; 3]; forces.len()];
        let mut changes = unknowns.clone();
        let apply = |x: &[f64], image: &mut [f64]| {
            let (x, _) = x.as_chunks::<3>();
            let (image, _) = image.as_chunks_mut::<3>();
            self.apply(x, image, &mut changes);
        };
        let right = scaled.as_flattened();
        conjugate_gradient(apply, right, None, unknowns.as_flattened_mut(), UNTIL);
        self.changes(&unknowns, &mut changes);
        changes
    }

    /// `L^-T x`.
    fn changes(&self, x: &[[f64; 3]], changes: &mut [[f64; 3]]) {
        for ((change, factor), x) in changes.iter_mut().zip(&self.factors).zip(x) {
            *change = factor.apply_transposed(*x);
        }
    }

    /// The matrix times `x`: of each block the identity is left.
    fn apply(&self, x: &[[f64; 3]], image: &mut [[f64; 3]], changes: &mut [[f64; 3]]) {
        self.changes(x, changes);
        for (k, image) in image.iter_mut().enumerate() {
            let mut drawn = [0.0; 3];
            for &(other, tie) in self.neighbours.of(k) {
                let coupling = self.couplings[tie as usize];
                drawn = add(drawn, scaled(changes[other as usize], coupling));
            }
            *image = difference(x[k], self.factors[k].apply(drawn));
        }
    }
}

/// The inverse of the lower Cholesky factor of a positive semidefinite matrix.
#[derive(Clone, Copy)]
pub(super) struct InverseFactor {
    diagonal: [f64; 3],
    /// Below it: `[1][0]`, `[2][0]`, `[2][1]`.
    lower: [f64; 3],
}

impl InverseFactor {
    /// A direction in which the matrix is 0 is left out: nothing moves there.
    pub(super) fn of(m: &Matrix) -> Self {
        let least = f64::EPSILON * (m[0][0] + m[1][1] + m[2][2]);
        let inverse = |square: f64| {
            if square > least {
                square.sqrt().recip()
            } else {
                0.0
            }
        };
        let a = inverse(m[0][0]);
        let (l10, l20) = (a * m[1][0], a * m[2][0]);
        let b = inverse(m[1][1] - l10 * l10);
        let l21 = b * (m[2][1] - l20 * l10);
        let c = inverse(m[2][2] - l20 * l20 - l21 * l21);
        let lower = [-b * l10 * a, -c * (l20 - l21 * b * l10) * a, -c * l21 * b];
        Self {
            diagonal: [a, b, c],
            lower,
        }
    }

    fn apply(&self, x: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], [d, e, f]) = (self.diagonal, self.lower);
        [
            a * x[0],
            d * x[0] + b * x[1],
            e * x[0] + f * x[1] + c * x[2],
        ]
    }

    fn apply_transposed(&self, x: [f64; 3]) -> [f64; 3] {
        let ([a, b, c], [d, e, f]) = (self.diagonal, self.lower);
        [
            a * x[0] + d * x[1] + e * x[2],
            b * x[1] + f * x[2],
            c * x[2],
        ]
    }
}

/// For each node those that it is tied to, and by which tie.
#[derive(Debug, Clone)]
pub(super) struct Neighbours {
    /// Where those of each node begin; one more than nodes.
    starts: Vec<u32>,
    ends: Vec<(u32, u32)>,
}

impl Neighbours {
    pub(super) fn new(nodes: usize, ties: &[[u32; 2]]) -> Self {
        let mut starts = vec![0; nodes + 1];
        for &node in ties.as_flattened() {
            starts[node as usize + 1] += 1;
        }
        for k in 0..nodes {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut ends = vec![(0, 0); 2 * ties.len()];
        for (tie, &[i, j]) in (0..).zip(ties) {
            for (from, to) in [(i, j), (j, i)] {
                let place = &mut next[from as usize];
                ends[*place as usize] = (to, tie);
                *place += 1;
            }
        }
        Self { starts, ends }
    }

    fn of(&self, node: usize) -> &[(u32, u32)] {
        &self.ends[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::linear::{IDENTITY, length, times};

    #[test]
    fn the_inverse_factor_makes_the_identity_of_a_block() {
        let m = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.2], [-0.5, 0.2, 2.0]];
        let factor = InverseFactor::of(&m);
        for axis in IDENTITY {
            let image = factor.apply(times(&m, factor.apply_transposed(axis)));
            // A few roundings of numbers up to 4.
            assert!(length(difference(image, axis)) < 1e-14, "{image:?}");
        }
        // Nothing holds a node that has neither ties nor pulls: it stays.
        let nothing = InverseFactor::of(&[[0.0; 3]; 3]);
        assert_eq!(nothing.apply([1.0, 2.0, 3.0]), [0.0; 3]);
        // Along one axis only.
        let flat = InverseFactor::of(&[[0.0; 3], [0.0; 3], [0.0, 0.0, 4.0]]);
        assert_eq!(flat.apply([1.0, 2.0, 3.0]), [0.0, 0.0, 1.5]);
    }
}
