//! A velocity field through many key frames, and its part between two of them.

use crate::basis::TimeBasis;
use crate::cell::Node;
use crate::error::SplineError;
use crate::field::{SplineField, check_coefficients, refine};
use crate::grid::Grid;
use crate::levels::OnGrid;
use crate::real::Real;
use crate::sequence::length;

/// Functions of time that act between two key frames.
pub(super) const ACTING: usize = 3;

/// A velocity field of quadratic B-splines in space and in time.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceField<R: Real = f32> {
    grid: Grid<R>,
    times: Vec<f64>,
    /// For each node in turn its functions of time, two in each entry.
    pub(super) nodes: Vec<Node<R>>,
}

/// Where function `k` of a node is: its entry, and the first of its lanes there.
#[inline(always)]
pub(super) fn place(k: usize) -> (usize, usize) {
    (k / 2, 4 * (k % 2))
}

impl<R: Real> SequenceField<R> {
    /// The field that is zero everywhere, through key frames at these ascending times.
    pub(super) fn zero(grid: Grid<R>, times: Vec<f64>) -> Self {
        let entries = (times.len() + 1).div_ceil(2);
        let nodes = vec![Node::ZERO; grid.size() * entries];
        Self { grid, times, nodes }
    }

    /// The field of these coefficients, as [`Self::coefficients`] gives them.
    ///
    /// # Errors
    /// If the grid is none, times do not ascend, or the coefficients are not finite or not as many as the
    /// grid's.
    pub fn from_parts(
        grid: Grid<R>,
        times: Vec<f64>,
        coefficients: &[R],
    ) -> Result<Self, SplineError> {
        let ascend = times.windows(2).all(|two| two[0] < two[1]);
        if times.len() < 2 || !ascend || times.iter().any(|time| !time.is_finite()) {
            return Err(SplineError::Option {
                name: "times",
                value: times.first().copied().unwrap_or(f64::NAN),
                allowed: "two or more, ascending",
            });
        }
        let grid = grid.checked()?;
        let functions = times.len() + 1;
        let wanted = grid.size().saturating_mul(3 * functions);
        check_coefficients(coefficients, wanted)?;
        let mut out = Self::zero(grid, times);
        let entries = out.entries();
        let each = coefficients.chunks_exact(3 * functions);
        for (node, values) in out.nodes.chunks_exact_mut(entries).zip(each) {
            for (k, vector) in values.chunks_exact(3).enumerate() {
                let (entry, lane) = place(k);
                node[entry].0[0][lane..lane + 3].copy_from_slice(vector);
            }
        }
        Ok(out)
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<R> {
        &self.grid
    }

    /// The times of the key frames.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Functions of time: one more than key frames.
    pub fn functions(&self) -> usize {
        self.times.len() + 1
    }

    /// Entries of each node.
    pub(super) fn entries(&self) -> usize {
        self.functions().div_ceil(2)
    }

    /// The coefficients, `[nodes x, nodes y, nodes z, functions of time, 3]`.
    pub fn coefficients(&self) -> Vec<R> {
        let (functions, entries) = (self.functions(), self.entries());
        let mut out = Vec::with_capacity(self.grid.size() * functions * 3);
        for node in self.nodes.chunks_exact(entries) {
            for k in 0..functions {
                let (entry, lane) = place(k);
                out.extend_from_slice(&node[entry].0[0][lane..lane + 3]);
            }
        }
        out
    }

    /// The part from key frame `s` to the next: the velocity per length of that interval, over a time from 0
    /// to 1.
    ///
    /// # Panics
    /// If there is no such interval.
    pub fn part(&self, s: usize) -> SplineField<R, 2> {
        let mut out = SplineField::zero(self.grid, self.basis(s));
        take(&self.nodes, self.entries(), s, &mut out.nodes);
        out
    }

    /// The functions that act from key frame `s` to the next, in a time from 0 to 1 there.
    fn basis(&self, s: usize) -> TimeBasis {
        TimeBasis::Quadratic(quadratics(&self.times, s))
    }

    /// The same field on a grid of half the spacing.
    ///
    /// # Errors
    /// If that grid has too many nodes.
    pub fn refined(&self) -> Result<Self, SplineError> {
        let mut out = Self::zero(self.grid.halved()?, self.times.clone());
        let (entries, finer) = (self.entries(), out.grid);
        refine(&self.grid, &self.nodes, entries, &finer, &mut out.nodes);
        Ok(out)
    }
}

/// The three quadratic B-splines in time that act from key frame `s` to the next, each as `a + b u + c u^2` in a time
/// `u` from 0 to 1 there, times the length of that interval, where the mean of all is 1. Their breaks are the times.
///
/// # Panics
/// If there is no such interval.
pub fn quadratics(times: &[f64], s: usize) -> [[f64; 3]; ACTING] {
    // The first and the last interval are repeated beyond the ends.
    let last = times.len() - 2;
    let of = |s: usize| length(times, s);
    let (before, h, after) = (of(s.saturating_sub(1)), of(s), of((s + 1).min(last)));
    // De Boor's recursion.
    let (a, b) = (h / (before + h), h / (h + after));
    let functions = [[a, -2.0 * a, a], [1.0 - a, 2.0 * a, -a - b], [0.0, 0.0, b]];
    functions.map(|function| function.map(|x| x * h))
}

impl<R: Real> OnGrid<R> for SequenceField<R> {
    fn grid(&self) -> &Grid<R> {
        &self.grid
    }

    fn refined(&self) -> Result<Self, SplineError> {
        self.refined()
    }
}

/// What of a vector acts from key frame `s` to the next.
pub(super) fn take<R: Real>(vector: &[Node<R>], entries: usize, s: usize, out: &mut [Node<R, 2>]) {
    for (node, out) in vector.chunks_exact(entries).zip(out) {
        for j in 0..ACTING {
            let (entry, lane) = place(s + j);
            let to = 4 * (j % 2);
            out.0[j / 2][to..to + 4].copy_from_slice(&node[entry].0[0][lane..lane + 4]);
        }
    }
}
