//! The functions of space and of time.
//!
//! Space: quadratic B-splines on a regular grid. At the part `u` of a cell, with `v = 1 - u`, its three
//! nodes of an axis have
//!
//! ```text
//! weights  v^2 / 2    1/2 + u v    u^2 / 2
//! slopes   -v         1 - 2 u      u
//! ```
//!
//! Time: Legendre polynomials on `[0, 1]`, `T_0 = 1` and `T_1 = 2 t - 1`; or the three B-splines that an
//! interval between two of many key frames has, as polynomials on `[0, 1]`.

use crate::real::Real;

/// Nodes of a cell along an axis.
pub(crate) const SUPPORT: usize = 3;

/// What functions of time are at a place, two in each half of a node.
pub(crate) type Times<R, const H: usize> = [[R; 2]; H];

/// The functions of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeBasis {
    /// One constant: the field is stationary.
    Constant,
    /// Two polynomials: the field is linear in time.
    Linear,
    /// Three polynomials: the part of quadratic B-splines between two neighbouring key frames. Of each its
    /// coefficients of 1, `t` and `t^2`.
    Quadratic([[f64; 3]; 3]),
}

impl TimeBasis {
    /// How many functions there are.
    pub fn functions(self) -> usize {
        match self {
            Self::Constant => 1,
            Self::Linear => 2,
            Self::Quadratic(_) => 3,
        }
    }

    /// The functions at a time. A node has room for them in its halves.
    #[inline(always)]
    pub(crate) fn values<R: Real, const H: usize>(self, t: R) -> Times<R, H> {
        let mut out = [[R::ZERO; 2]; H];
        match self {
            Self::Constant => out[0][0] = R::ONE,
            Self::Linear => out[0] = [R::ONE, t + t - R::ONE],
            Self::Quadratic(functions) => {
                for (k, [a, b, c]) in functions.into_iter().enumerate() {
                    out[k / 2][k % 2] = R::of(a) + t * (R::of(b) + t * R::of(c));
                }
            }
        }
        out
    }

    /// Their derivatives.
    #[inline(always)]
    pub(crate) fn rates<R: Real, const H: usize>(self, t: R) -> Times<R, H> {
        let mut out = [[R::ZERO; 2]; H];
        match self {
            Self::Constant => {}
            Self::Linear => out[0][1] = R::ONE + R::ONE,
            Self::Quadratic(functions) => {
                for (k, [_, b, c]) in functions.into_iter().enumerate() {
                    out[k / 2][k % 2] = R::of(b) + (t + t) * R::of(c);
                }
            }
        }
        out
    }
}

/// The weights of an axis.
#[inline(always)]
pub(crate) fn weights<R: Real>(u: R) -> [R; SUPPORT] {
    let v = R::ONE - u;
    [v * v * R::HALF, R::HALF + u * v, u * u * R::HALF]
}

/// The slopes of an axis, by `u`.
#[inline(always)]
pub(crate) fn slopes<R: Real>(u: R) -> [R; SUPPORT] {
    [u - R::ONE, R::ONE - u - u, u]
}

/// What a fine node takes from the coarse nodes of an axis: the first of two neighbours, and the shares of
/// both. `B(x) = (B(2x + 1) + 3 B(2x) + 3 B(2x - 1) + B(2x - 2)) / 4` halves the cells exactly.
pub(crate) fn halved(fine: usize) -> (usize, [f64; 2]) {
    if fine.is_multiple_of(2) {
        (fine / 2, [0.75, 0.25])
    } else {
        (fine / 2, [0.25, 0.75])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_slopes_are_their_derivatives() {
        for u in [0.0, 0.25, 0.5, 0.8, 1.0f64] {
            assert!((weights(u).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for (a, slope) in slopes(u).into_iter().enumerate() {
                // Weights are quadratic, so that central differences are exact but for rounding.
                let difference = (weights(u + 1e-3)[a] - weights(u - 1e-3)[a]) / 2e-3;
                assert!((slope - difference).abs() < 1e-12);
            }
        }
    }
}
