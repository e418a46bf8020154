//! Straight lines between corresponding points: `x(t) = (1 - t) x_0 + t x_1`.
//!
//! The comparison applies it to all vertices of the two end meshes: the one row of its tables that uses the
//! dense true correspondences, which no other method is given. It is exact for translations, and shrinks
//! whatever turns.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// Where points on their way from `x0` to `x1` are at time `t`.
///
/// # Shapes
/// `x0`, `x1` and the result: `[n, 3]`; `t` in `[0, 1]`.
///
/// # Panics
/// If `x0` and `x1` differ in shape.
pub fn straight_lines<B: Backend>(x0: Tensor<B, 2>, x1: Tensor<B, 2>, t: f64) -> Tensor<B, 2> {
    assert_eq!(x0.dims(), x1.dims(), "points at t = 0 and at t = 1");
    x0 * (1.0 - t) + x1 * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, host, points};

    #[test]
    fn a_point_is_a_third_of_its_way_on_at_a_third_and_exactly_at_its_ends_at_the_ends() {
        let (from, to) = ([[1.0, 2.0, -3.0]], [[4.0, 2.0, 3.0]]);
        let at = |t| host(straight_lines(points::<Plain>(&from), points(&to), t));
        assert_eq!(at(0.0), from[0]);
        assert_eq!(at(1.0), to[0]);
        for (got, wanted) in at(1.0 / 3.0).into_iter().zip([2.0, 2.0, -1.0]) {
            // f32 rounding of numbers below 4.
            assert!((got - wanted).abs() < 1e-6, "{got}, wanted {wanted}");
        }
    }
}
