//! Trajectories by Runge and Kutta's fourth-order method, and their exact discrete derivatives.
//!
//! ```text
//! k_g = V(y + f_g dt k_(g-1), t + f_g dt),   f = 0, 1/2, 1/2, 1
//! y  <- y + dt/6 (k_1 + 2 k_2 + 2 k_3 + k_4)
//! ```
//!
//! [`gradient`] carries `d y / d x` forward. [`sense`] goes backward, which gives for every stage the matrix
//! `M` by which a change of V there moves the end: `d end = sum_stages M dV(stage)`.

use crate::basis::TimeBasis;
use crate::cell::{Jet, Lanes, Node, first_three, jet, value};
use crate::grid::Grid;
use crate::real::{Fuse, Real};

/// Stages of a step.
pub(crate) const STAGES: usize = 4;

pub(crate) type Matrix<R> = [[R; 3]; 3];

/// What a trajectory goes through.
#[derive(Clone, Copy)]
pub(crate) struct Flow<'a, R: Real, const H: usize> {
    pub grid: &'a Grid<R>,
    pub strides: [usize; 2],
    pub nodes: &'a [Node<R, H>],
    pub basis: TimeBasis,
}

/// A place that moves the end of a trajectory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Influence<R> {
    pub point: [R; 3],
    pub time: R,
    pub matrix: Matrix<R>,
}

/// `a + factor b`.
#[inline(always)]
fn moved<R: Real, const N: usize>(a: [R; N], factor: R, b: [R; N]) -> [R; N] {
    let mut out = a;
    for i in 0..N {
        out[i] += factor * b[i];
    }
    out
}

/// The identity times a number.
#[inline(always)]
pub(crate) fn diagonal<R: Real>(factor: R) -> Matrix<R> {
    let mut out = [[R::ZERO; 3]; 3];
    for i in 0..3 {
        out[i][i] = factor;
    }
    out
}

/// `c += factor a b`.
#[inline(always)]
fn add_product<R: Real>(c: &mut Matrix<R>, factor: R, a: &Matrix<R>, b: &Matrix<R>) {
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] += factor * (a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]);
        }
    }
}

impl<R: Real, const H: usize> Flow<'_, R, H> {
    #[inline(always)]
    fn value<F: Fuse>(&self, f: F, x: Lanes<R>, t: R) -> Lanes<R> {
        let place = self.grid.locate(first_three(x));
        let time = self.basis.values(t);
        value(
            f,
            self.nodes,
            self.strides,
            place.first,
            &place.weights,
            time,
        )
    }

    /// V, its rate and its Jacobian.
    #[inline(always)]
    pub(crate) fn jet<F: Fuse>(&self, f: F, x: [R; 3], t: R) -> Jet<R> {
        let place = self.grid.locate(x);
        let times = [self.basis.values(t), self.basis.rates(t)];
        jet(f, self.nodes, self.strides, &place, times).narrow()
    }

    /// Where a point is carried.
    #[inline(always)]
    pub(crate) fn carry<F: Fuse>(
        &self,
        f: F,
        x: Lanes<R>,
        times: [R; 2],
        steps: usize,
    ) -> Lanes<R> {
        let (mut y, mut t) = (x, times[0]);
        let dt = (times[1] - times[0]) / R::of(steps as f64);
        let half = dt * R::HALF;
        for _ in 0..steps {
            let k1 = self.value(f, y, t);
            let k2 = self.value(f, moved(y, half, k1), t + half);
            let k3 = self.value(f, moved(y, half, k2), t + half);
            let k4 = self.value(f, moved(y, dt, k3), t + dt);
            y = advanced(y, dt, &[k1, k2, k3, k4]);
            t += dt;
        }
        y
    }

    /// Where a point is carried, and the derivative by the point.
    #[inline(always)]
    pub(crate) fn gradient<F: Fuse>(
        &self,
        f: F,
        x: [R; 3],
        times: [R; 2],
        steps: usize,
    ) -> ([R; 3], Matrix<R>) {
        let (mut y, mut t, mut total) = (x, times[0], diagonal(R::ONE));
        let dt = (times[1] - times[0]) / R::of(steps as f64);
        for _ in 0..steps {
            let (k, jacobians, _) = self.stages(f, y, t, dt);
            // The derivative of each stage by y, and the sum that the step takes.
            let (mut stage, mut step) = ([[R::ZERO; 3]; 3], diagonal(R::ONE));
            for g in 0..STAGES {
                let (fraction, share) = fraction_and_share::<R>(g);
                let mut inner = diagonal(R::ONE);
                add_product(&mut inner, fraction * dt, &stage, &diagonal(R::ONE));
                stage = [[R::ZERO; 3]; 3];
                add_product(&mut stage, R::ONE, &jacobians[g], &inner);
                add_product(&mut step, share * dt, &stage, &diagonal(R::ONE));
            }
            let mut product = [[R::ZERO; 3]; 3];
            add_product(&mut product, R::ONE, &step, &total);
            total = product;
            y = advanced(y, dt, &k);
            t += dt;
        }
        (y, total)
    }

    /// Velocities, Jacobians and points of the stages of a step.
    #[inline(always)]
    fn stages<F: Fuse>(&self, f: F, y: [R; 3], t: R, dt: R) -> Stages<R> {
        let mut k = [[R::ZERO; 3]; STAGES];
        let mut jacobians = [[[R::ZERO; 3]; 3]; STAGES];
        let mut points = [y; STAGES];
        for g in 0..STAGES {
            let step = fraction_and_share::<R>(g).0 * dt;
            if g > 0 {
                points[g] = moved(y, step, k[g - 1]);
            }
            let jet = self.jet(f, points[g], t + step);
            (k[g], jacobians[g]) = (jet.value, jet.jacobian);
        }
        (k, jacobians, points)
    }

    /// Where a point is carried, the derivative by the point, and the influence of each stage of each step,
    /// in order; `out` has `4 steps` entries.
    #[inline(always)]
    pub(crate) fn sense<F: Fuse>(
        &self,
        f: F,
        x: [R; 3],
        times: [R; 2],
        steps: usize,
        out: &mut [Influence<R>],
    ) -> ([R; 3], Matrix<R>) {
        let dt = (times[1] - times[0]) / R::of(steps as f64);
        let (mut y, mut t) = (x, times[0]);
        for stages in out.chunks_exact_mut(STAGES) {
            let (k, jacobians, points) = self.stages(f, y, t, dt);
            for (g, stage) in stages.iter_mut().enumerate() {
                *stage = Influence {
                    point: points[g],
                    time: t + fraction_and_share::<R>(g).0 * dt,
                    // Kept here until the way back.
                    matrix: jacobians[g],
                };
            }
            y = advanced(y, dt, &k);
            t += dt;
        }
        let mut end = diagonal(R::ONE);
        for stages in out.chunks_exact_mut(STAGES).rev() {
            let mut total = end;
            let mut after: Option<(Matrix<R>, Matrix<R>, R)> = None;
            for (g, stage) in stages.iter_mut().enumerate().rev() {
                let (fraction, share) = fraction_and_share::<R>(g);
                let mut matrix = [[R::ZERO; 3]; 3];
                add_product(&mut matrix, share * dt, &end, &diagonal(R::ONE));
                if let Some((later, jacobian, fraction)) = after {
                    add_product(&mut matrix, fraction * dt, &later, &jacobian);
                }
                add_product(&mut total, R::ONE, &matrix, &stage.matrix);
                after = Some((matrix, stage.matrix, fraction));
                stage.matrix = matrix;
            }
            end = total;
        }
        (y, end)
    }
}

type Stages<R> = ([[R; 3]; STAGES], [Matrix<R>; STAGES], [[R; 3]; STAGES]);

/// Where in the step a stage is, and its share of the step.
#[inline(always)]
fn fraction_and_share<R: Real>(stage: usize) -> (R, R) {
    match stage {
        0 => (R::ZERO, R::of(1.0 / 6.0)),
        1 | 2 => (R::HALF, R::of(1.0 / 3.0)),
        _ => (R::ONE, R::of(1.0 / 6.0)),
    }
}

#[inline(always)]
fn advanced<R: Real, const N: usize>(y: [R; N], dt: R, k: &[[R; N]; STAGES]) -> [R; N] {
    let (outer, inner) = (dt * R::of(1.0 / 6.0), dt * R::of(1.0 / 3.0));
    let mut out = y;
    for i in 0..N {
        out[i] += outer * (k[0][i] + k[3][i]) + inner * (k[1][i] + k[2][i]);
    }
    out
}

/// Places that a trajectory of so many steps has after [`merged`].
pub(crate) fn merged_places(steps: usize) -> usize {
    2 * steps + 1
}

/// The stages of a trajectory at fewer places: the middle two of a step at their mean, and the last of a
/// step with the first of the next. The two differ by the order of `dt^2`, and so little that Gauss-Newton
/// does not take another step for it.
pub(crate) fn merged<R: Real>(stages: &[Influence<R>], out: &mut Vec<Influence<R>>) {
    let last = stages.len() - 1;
    for at in (0..stages.len()).step_by(2) {
        // Pairs are (0), (1, 2), (3, 4), ...: one stage before each step's middle, two in it.
        if at == 0 {
            out.push(stages[0]);
        } else {
            out.push(mean(&stages[at - 1], &stages[at]));
        }
    }
    out.push(stages[last]);
}

fn mean<R: Real>(a: &Influence<R>, b: &Influence<R>) -> Influence<R> {
    let mut out = *a;
    for i in 0..3 {
        out.point[i] = R::HALF * (a.point[i] + b.point[i]);
        for j in 0..3 {
            out.matrix[i][j] = a.matrix[i][j] + b.matrix[i][j];
        }
    }
    out.time = R::HALF * (a.time + b.time);
    out
}
