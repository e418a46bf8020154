//! What a trained method can do, whatever it is made of: give a surface at a time, and move points with it.

use burn::tensor::Tensor;

use super::trajectory::{Integrator, Steps, integrate};
use crate::autodiff::ModelBackend;

/// Half the step of the central differences of [`Geometry::gradient`], in normalised units: their error,
/// `h^2 f''' / 6` and `eps |f| / h`, is below 1e-3 on fields that vary over a twentieth of a unit.
const DIFFERENCE: f64 = 2e-3;

/// Steps of the Runge-Kutta integrator per unit of time by which points follow a velocity.
const STEPS_PER_TIME: f64 = 32.0;

/// A surface that changes with time: the zero set of `f(., t)`, negative inside.
pub trait Geometry<B: ModelBackend>: Send + Sync {
    /// `f(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`; result `[n, 1]`.
    fn value(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2>;

    /// `grad f` by the position, `[n, 3]`: central differences, unless the method has a better way.
    fn gradient(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let along = |axis: usize| {
            let mut step = [0.0; 3];
            step[axis] = DIFFERENCE;
            let step = Tensor::<B, 1>::from_floats(step, &x.device()).unsqueeze::<2>();
            let ahead = self.value(x.clone() + step.clone(), t.clone());
            let behind = self.value(x.clone() - step, t.clone());
            (ahead - behind) / (2.0 * DIFFERENCE)
        };
        Tensor::cat(vec![along(0), along(1), along(2)], 1)
    }

    /// The same surface by where its points come from and go to, if that is what it is made of.
    fn carried(&self) -> Option<&dyn Carried<B>> {
        None
    }
}

/// A surface that a flow carries: `f(x, t)` is known from the positions at times 0 and 1 of what is at `x`
/// at `t`. These vary more smoothly than `f` does, so they can be interpolated where many values are needed.
pub trait Carried<B: ModelBackend>: Send + Sync {
    /// How far off the true positions may be, in normalised units, for all but one in twenty near the
    /// surface.
    fn tolerance(&self) -> f64;

    /// Where points that are at `x` at `time` are at time 0 and at time 1: `[n, 3]` to `[n, 6]`.
    fn ends(&self, x: Tensor<B, 2>, time: f64) -> Tensor<B, 2>;

    /// `f(x, time)` from what [`Carried::ends`] gives for `x`: `[n, 6]` to `[n, 1]`.
    fn value_from(&self, ends: Tensor<B, 2>, time: f64) -> Tensor<B, 2>;
}

/// A map of space from one time to another: it carries points along with the surface.
pub trait Motion<B: ModelBackend>: Send + Sync {
    /// Where points that are at `x` at time `from` are at time `to`, `[n, 3]` to `[n, 3]`.
    fn carry(&self, x: Tensor<B, 2>, from: f64, to: f64) -> Tensor<B, 2>;

    /// The velocity of what is at `x` at `time`, `[n, 3]`, where the method has one of its own.
    fn velocity(&self, _x: Tensor<B, 2>, _time: f64) -> Option<Tensor<B, 2>> {
        None
    }

    /// Where points that are at `x` at time 0 are at each of `times`, which ascend: from each time to the
    /// next, unless the method has a better way.
    fn path(&self, x: Tensor<B, 2>, times: &[f64]) -> Vec<Tensor<B, 2>> {
        let (mut now, mut at) = (x, 0.0);
        let step = |time: &f64| {
            if *time != at {
                now = self.carry(now.clone(), at, *time);
                at = *time;
            }
            now.clone()
        };
        times.iter().map(step).collect()
    }
}

/// Positions at time `to` of points at `x` at time `from` that move with `velocity`: Runge-Kutta, 32
/// steps per unit of time.
///
/// # Shapes
/// `x`: `[n, 3]`; `velocity` maps `[n, 3]` and `[n, 1]` to `[n, 3]`.
pub(crate) fn follow<B: ModelBackend>(
    velocity: impl Fn(Tensor<B, 2>, Tensor<B, 2>) -> Tensor<B, 2>,
    x: Tensor<B, 2>,
    from: f64,
    to: f64,
) -> Tensor<B, 2> {
    // The steps follow the span: a way in pieces is as exact as the same way at once.
    let steps = Steps::Even(((to - from).abs() * STEPS_PER_TIME).ceil().max(1.0) as usize);
    let full = |time: f64| Tensor::full([x.dims()[0], 1], time, &x.device());
    let (from, to) = (full(from), full(to));
    integrate(velocity, x, from, to, steps, Integrator::Rk4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, column, host, points};

    /// The distance to a sphere of radius `1 + t`.
    struct Growing;

    impl Geometry<Plain> for Growing {
        fn value(&self, x: Tensor<Plain, 2>, t: Tensor<Plain, 2>) -> Tensor<Plain, 2> {
            (x.clone() * x).sum_dim(1).sqrt() - t - 1.0
        }
    }

    #[test]
    fn the_gradient_by_differences_is_that_of_the_distance() {
        let x = points(&[[0.6, 0.0, 0.8], [0.0, -2.0, 0.0]]);
        let gradient = host(Growing.gradient(x, column(&[0.0, 0.5])));
        // Rounding: 1.2e-7 of values up to 1 over twice the step of 2e-3.
        for (found, wanted) in gradient.iter().zip([0.6, 0.0, 0.8, 0.0, -1.0, 0.0]) {
            assert!((found - wanted).abs() < 2e-4, "{gradient:?}");
        }
    }

    #[test]
    fn points_follow_a_velocity_and_come_back() {
        let turn = |x: Tensor<Plain, 2>, _: Tensor<Plain, 2>| {
            let n = x.dims()[0];
            let (a, b) = (x.clone().slice([0..n, 0..1]), x.slice([0..n, 1..2]));
            Tensor::cat(vec![-b, a.clone(), a.zeros_like()], 1)
        };
        let start = points(&[[1.0, 0.0, 0.5]]);
        let there = follow(turn, start, 0.0, 1.0);
        for (found, wanted) in host(there.clone())
            .iter()
            .zip([1f64.cos(), 1f64.sin(), 0.5])
        {
            // RK4 with h = 1/32 on a turn of one radian: below f32 rounding of some 40 operations.
            assert!((found - wanted).abs() < 2e-6);
        }
        let back = host(follow(turn, there, 1.0, 0.0));
        assert!(
            (back[0] - 1.0).abs() < 4e-6 && back[1].abs() < 4e-6,
            "{back:?}"
        );
    }
}
