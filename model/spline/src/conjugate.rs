//! Preconditioned conjugate gradients on the Gauss-Newton system, `A x = -g`.
//!
//! The vectors are `R`, their scalar products float64. The end is a residual, in the norm of the
//! preconditioner, below `tolerance` times the first.

use rayon::prelude::*;

use crate::cell::Node;
use crate::error::SplineError;
use crate::options::Options;
use crate::real::{Fuse, Kernel, Real, run};
use crate::scatter::dot;

/// A symmetric positive matrix with a preconditioner.
pub(crate) trait Linear<R: Real>: Sync {
    /// Entries that are preconditioned and summed together.
    fn block(&self) -> usize;

    /// `q = A p`; gives `p . q`.
    fn product(&mut self, p: &[Node<R>], q: &mut [Node<R>]) -> f64;

    /// `out = P r` for a block of entries that begins at `start`.
    fn precondition<F: Fuse>(&self, f: F, start: usize, r: &[Node<R>], out: &mut [Node<R>]);
}

/// The change of a step and the iterations that it took.
///
/// # Errors
/// If a number on the way is not finite.
pub(crate) fn step<R: Real>(
    system: &mut impl Linear<R>,
    gradient: Vec<Node<R>>,
    options: &Options,
    step: usize,
) -> Result<(Vec<Node<R>>, usize), SplineError> {
    let solution = solve(system, gradient, options.iterations, options.tolerance);
    let what = "the system";
    solution.ok_or(SplineError::NotFinite { step, what })
}

/// The solution and the iterations that it took; nothing if a number on the way is not finite.
fn solve<R: Real>(
    system: &mut impl Linear<R>,
    mut gradient: Vec<Node<R>>,
    most: usize,
    tolerance: f64,
) -> Option<(Vec<Node<R>>, usize)> {
    let length = gradient.len();
    let zero = || vec![Node::ZERO; length];
    let (mut x, mut p, mut q, mut z) = (zero(), zero(), zero(), zero());
    for node in &mut gradient {
        *node = node.scaled(-R::ONE);
    }
    let mut r = gradient;
    let mut rz = update(system, R::ZERO, &p, &q, &mut x, &mut r, &mut z);
    let end = tolerance * tolerance * rz;
    p.copy_from_slice(&z);
    if !rz.is_finite() {
        return None;
    }
    if rz <= 0.0 {
        return Some((x, 0));
    }
    for iteration in 1..=most {
        let curvature = system.product(&p, &mut q);
        if !curvature.is_finite() {
            return None;
        }
        // Rounding only: the matrix is positive.
        if curvature <= 0.0 {
            return Some((x, iteration));
        }
        let next = update(
            system,
            R::of(rz / curvature),
            &p,
            &q,
            &mut x,
            &mut r,
            &mut z,
        );
        if !next.is_finite() {
            return None;
        }
        if next <= end {
            return Some((x, iteration));
        }
        let factor = R::of(next / rz);
        let block = system.block();
        p.par_chunks_mut(block)
            .zip(z.par_chunks(block))
            .for_each(|(p, z)| run(Turn { factor, z, p }));
        rz = next;
    }
    Some((x, most))
}

/// `x += a p`, `r -= a q`, `z = P r`; gives `r . z`.
fn update<R: Real>(
    system: &impl Linear<R>,
    factor: R,
    p: &[Node<R>],
    q: &[Node<R>],
    x: &mut [Node<R>],
    r: &mut [Node<R>],
    z: &mut [Node<R>],
) -> f64 {
    let block = system.block();
    let mut dots = vec![0.0; r.len().div_ceil(block)];
    let inputs = p.par_chunks(block).zip(q.par_chunks(block));
    let outputs = r.par_chunks_mut(block).zip(z.par_chunks_mut(block));
    x.par_chunks_mut(block)
        .zip(inputs)
        .zip(outputs)
        .zip(&mut dots)
        .enumerate()
        .for_each(|(number, (((x, (p, q)), (r, z)), dot))| {
            run(Update {
                system,
                start: number * block,
                factor,
                p,
                q,
                x,
                r,
                z,
                dot,
            });
        });
    dots.iter().sum()
}

struct Update<'a, R: Real, S> {
    system: &'a S,
    start: usize,
    factor: R,
    p: &'a [Node<R>],
    q: &'a [Node<R>],
    x: &'a mut [Node<R>],
    r: &'a mut [Node<R>],
    z: &'a mut [Node<R>],
    dot: &'a mut f64,
}

impl<R: Real, S: Linear<R>> Kernel for Update<'_, R, S> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for (x, p) in self.x.iter_mut().zip(self.p) {
            x.add(f, self.factor, p);
        }
        for (r, q) in self.r.iter_mut().zip(self.q) {
            r.add(f, -self.factor, q);
        }
        self.system.precondition(f, self.start, self.r, self.z);
        *self.dot = dot(self.r, self.z);
    }
}

/// `p = z + factor p`.
struct Turn<'a, R> {
    factor: R,
    z: &'a [Node<R>],
    p: &'a mut [Node<R>],
}

impl<R: Real> Kernel for Turn<'_, R> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for (p, z) in self.p.iter_mut().zip(self.z) {
            let mut next = *z;
            next.add(f, self.factor, p);
            *p = next;
        }
    }
}
