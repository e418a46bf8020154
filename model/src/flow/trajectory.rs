//! Trajectories: explicit integration of `dy/dt = rhs(y, t)` for many samples at once, each with a
//! start and an end time of its own, forwards or backwards (the paper, Section 3, "phi(x, t)").
//!
//! The state may be positions, `[n, 3]` with `rhs = V`, or positions and normals side by side, `[n, 6]`
//! with `rhs = [V, -J^T n]` ([`super::transport`]).
//!
//! Method | order | evaluations per step
//! ---|---|---
//! Euler | 1 | 1
//! midpoint | 2 | 2
//! Runge-Kutta | 4 | 4
//!
//! # Differs from the paper
//! The paper takes `T` Euler steps of `1 / T` and uses the states at those times. That is
//! [`Steps::Grid`]. [`Steps::Even`] divides each sample's own span of time into equal steps instead, so
//! that a sample at a random time costs no more than one at the end and no time is preferred.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

use crate::operators::length::length;

/// An explicit Runge-Kutta method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// `y + h k_1`.
    Euler,
    /// `y + h k_2`, `k_2` taken half a step ahead.
    Midpoint,
    /// The classical method of fourth order.
    Rk4,
}

/// How a span of time is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// Each sample's own span into this many equal steps.
    Even(usize),
    /// Steps of one over this number; a sample stops on reaching its end time.
    Grid(usize),
}

impl Steps {
    /// Steps taken, also where a sample needs fewer.
    pub const fn count(self) -> usize {
        match self {
            Self::Even(count) | Self::Grid(count) => count,
        }
    }
}

/// The state at time `to` of what starts as `state` at time `from`.
///
/// # Shapes
/// `state`: `[n, c]`; `from`, `to`: `[n, 1]`, in `[0, 1]`; `rhs` maps `[n, c]` and `[n, 1]` to `[n, c]`.
pub fn integrate<B: Backend>(
    rhs: impl Fn(Tensor<B, 2>, Tensor<B, 2>) -> Tensor<B, 2>,
    state: Tensor<B, 2>,
    from: Tensor<B, 2>,
    to: Tensor<B, 2>,
    steps: Steps,
    integrator: Integrator,
) -> Tensor<B, 2> {
    let (mut y, mut t) = (state, from.clone());
    let even = (to.clone() - from) / steps.count() as f64;
    for _ in 0..steps.count() {
        let h = match steps {
            Steps::Even(_) => even.clone(),
            Steps::Grid(count) => {
                // Beyond its end time a sample takes steps of length 0, whichever way it goes.
                (to.clone() - t.clone()).clamp(-1.0 / count as f64, 1.0 / count as f64)
            }
        };
        y = advance(&rhs, y, t.clone(), h.clone(), integrator);
        t = t + h;
    }
    y
}

/// The least power of two of even steps at which nineteen states in twenty end no farther than
/// `tolerance` from where twice the steps take them; `most` where even that many do not do.
///
/// # Shapes
/// As for [`integrate`].
pub fn steps_within<B: Backend>(
    rhs: impl Fn(Tensor<B, 2>, Tensor<B, 2>) -> Tensor<B, 2>,
    state: Tensor<B, 2>,
    from: Tensor<B, 2>,
    to: Tensor<B, 2>,
    integrator: Integrator,
    tolerance: f64,
    most: usize,
) -> usize {
    let end = |count| {
        let (state, from, to) = (state.clone(), from.clone(), to.clone());
        integrate(&rhs, state, from, to, Steps::Even(count), integrator)
    };
    let (mut count, mut coarse) = (1, end(1));
    while count < most {
        let fine = end(2 * count);
        let off = length(fine.clone() - coarse).into_data();
        let within = off.iter::<f64>().filter(|off| *off <= tolerance).count();
        if 20 * within >= 19 * off.num_elements() {
            return count;
        }
        // What was fine is the coarse one of the next comparison: each number of steps is taken once.
        (count, coarse) = (2 * count, fine);
    }
    most
}

/// One step of length `h`, `[n, 1]`.
fn advance<B: Backend>(
    rhs: &impl Fn(Tensor<B, 2>, Tensor<B, 2>) -> Tensor<B, 2>,
    y: Tensor<B, 2>,
    t: Tensor<B, 2>,
    h: Tensor<B, 2>,
    integrator: Integrator,
) -> Tensor<B, 2> {
    let half = h.clone() * 0.5;
    let k1 = rhs(y.clone(), t.clone());
    match integrator {
        Integrator::Euler => y + k1 * h,
        Integrator::Midpoint => {
            let k2 = rhs(y.clone() + k1 * half.clone(), t + half);
            y + k2 * h
        }
        Integrator::Rk4 => {
            let middle = t.clone() + half.clone();
            let k2 = rhs(y.clone() + k1.clone() * half.clone(), middle.clone());
            let k3 = rhs(y.clone() + k2.clone() * half, middle);
            let k4 = rhs(y.clone() + k3.clone() * h.clone(), t + h.clone());
            y + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, column, host, points};

    const METHODS: [(Integrator, f64); 3] = [
        (Integrator::Euler, 1.0),
        (Integrator::Midpoint, 2.0),
        (Integrator::Rk4, 4.0),
    ];

    /// `dy/dt = (1 + t) (-y_2, y_1, 0)`: a turn by `t + t^2 / 2` about the third axis.
    fn turn(y: Tensor<Plain, 2>, t: Tensor<Plain, 2>) -> Tensor<Plain, 2> {
        let [n, _] = y.dims();
        let (a, b) = (y.clone().slice([0..n, 0..1]), y.slice([0..n, 1..2]));
        Tensor::cat(vec![-b, a.clone(), a.zeros_like()], 1) * (t + 1.0)
    }

    fn turned(from: f64, to: f64) -> [f64; 3] {
        let angle = (to + to * to / 2.0) - (from + from * from / 2.0);
        [angle.cos(), angle.sin(), 0.0]
    }

    fn error(steps: Steps, integrator: Integrator, from: f64, to: f64) -> f64 {
        let (from_column, to_column) = (column(&[from]), column(&[to]));
        let start = points(&[[1.0, 0.0, 0.0]]);
        let end = host(integrate(
            turn,
            start,
            from_column,
            to_column,
            steps,
            integrator,
        ));
        let wanted = turned(from, to);
        end.iter()
            .zip(wanted)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    #[test]
    fn the_error_falls_with_the_order_of_the_method() {
        for (integrator, order) in METHODS {
            for (from, to) in [(0.0, 1.0), (1.0, 0.2)] {
                let (coarse, fine) = (Steps::Even(4), Steps::Even(8));
                let ratio = error(coarse, integrator, from, to) / error(fine, integrator, from, to);
                // Halving the step divides the error by 2^order; the next order of the expansion and
                // f32 rounding (1e-7 of errors near 1e-5 for RK4) bend it by less than a third.
                let slope = ratio.log2();
                assert!(
                    (slope - order).abs() < 0.35,
                    "{integrator:?}: slope {slope}"
                );
            }
        }
    }

    #[test]
    fn the_steps_that_keep_within_a_tolerance_are_as_few_as_do() {
        let start = || points(&[[1.0, 0.0, 0.0]]);
        for (integrator, _) in METHODS {
            for tolerance in [1e-2, 1e-3] {
                let count = steps_within(
                    turn,
                    start(),
                    column(&[0.0]),
                    column(&[1.0]),
                    integrator,
                    tolerance,
                    1024,
                );
                let at = |count| error(Steps::Even(count), integrator, 0.0, 1.0);
                // The distance to twice the steps is between half of the error and all of it.
                assert!(at(count) <= 2.1 * tolerance, "{integrator:?}: {count}");
                let fewer = count / 2;
                let enough = fewer > 0 && at(fewer) < 0.9 * tolerance;
                assert!(!enough, "{integrator:?}: {fewer} would do");
            }
        }
        let few = steps_within(
            turn,
            start(),
            column(&[0.0]),
            column(&[1.0]),
            Integrator::Euler,
            1e-6,
            4,
        );
        assert_eq!(few, 4, "no more than allowed");
    }

    #[test]
    fn each_sample_runs_to_its_own_time() {
        let times = [0.0, 0.3, 0.7, 1.0];
        let start = points(&[[1.0, 0.0, 0.0]; 4]);
        let (from, to) = (column(&[0.0; 4]), column(&times));
        for steps in [Steps::Even(6), Steps::Grid(10)] {
            let end = integrate(
                turn,
                start.clone(),
                from.clone(),
                to.clone(),
                steps,
                Integrator::Rk4,
            );
            for (position, time) in host(end).chunks(3).zip(times) {
                let wanted = turned(0.0, time);
                let off: f64 = position
                    .iter()
                    .zip(wanted)
                    .map(|(a, b)| (a - b).powi(2))
                    .sum();
                // RK4 with h = 1/6 or less on a turn below 1.5 radians: below 1e-4.
                assert!(off.sqrt() < 1e-4, "{steps:?} at {time}: {off}");
            }
        }
    }
}
