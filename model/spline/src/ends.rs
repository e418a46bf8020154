//! The terms on where trajectories end: matching and on-surface.
//!
//! ```text
//! E = 1/2 sum_q r_q . W_q r_q,   d r_q = sum_s M_qs dV(place qs)
//! ```
//!
//! `W` is a number times the identity for a distance, and times `n n^T` for a distance from a plane. Places
//! are sorted by cell; the trajectory of each is kept beside it.

use rayon::prelude::*;

use crate::basis::{SUPPORT, Times};
use crate::cell::{Lanes, Node, add_value, first_three, value};
use crate::field::SplineField;
use crate::real::{Fuse, Kernel, Real, run};
use crate::scatter::{Part, by_first, each_run, parts, run_length};
use crate::trajectory::{Flow, Influence, Matrix, STAGES, merged, merged_places};

/// Trajectories that a thread takes at a time.
const PIECE: usize = 64;

/// Where a trajectory ends, the derivative by where it starts, and its places.
#[derive(Debug, Clone)]
pub(crate) struct Ends<R> {
    pub points: Vec<[R; 3]>,
    pub gradients: Vec<Matrix<R>>,
    influences: Vec<Influence<R>>,
    each: usize,
}

impl<R: Real> Ends<R> {
    /// Carries the points from one end of time to the other; `merge`: with places merged.
    pub(crate) fn new<const H: usize>(
        field: &SplineField<R, H>,
        starts: &[[R; 3]],
        times: &[[R; 2]],
        steps: usize,
        merge: bool,
    ) -> Self {
        let pieces: Vec<Self> = starts
            .par_chunks(PIECE)
            .zip(times.par_chunks(PIECE))
            .map(|(starts, times)| {
                let mut out = Self::empty(steps, merge);
                run(Sense {
                    flow: field.flow(),
                    starts,
                    times,
                    steps,
                    merge,
                    out: &mut out,
                });
                out
            })
            .collect();
        let mut out = Self::empty(steps, merge);
        for piece in pieces {
            out.points.extend(piece.points);
            out.gradients.extend(piece.gradients);
            out.influences.extend(piece.influences);
        }
        out
    }

    fn empty(steps: usize, merge: bool) -> Self {
        Self {
            points: Vec::new(),
            gradients: Vec::new(),
            influences: Vec::new(),
            each: if merge {
                merged_places(steps)
            } else {
                STAGES * steps
            },
        }
    }
}

struct Sense<'a, R: Real, const H: usize> {
    flow: Flow<'a, R, H>,
    starts: &'a [[R; 3]],
    times: &'a [[R; 2]],
    steps: usize,
    merge: bool,
    out: &'a mut Ends<R>,
}

impl<R: Real, const H: usize> Kernel for Sense<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        let none = Influence {
            point: [R::ZERO; 3],
            time: R::ZERO,
            matrix: [[R::ZERO; 3]; 3],
        };
        let mut stages = vec![none; STAGES * self.steps];
        for (&start, &times) in self.starts.iter().zip(self.times) {
            let (end, gradient) = self.flow.sense(f, start, times, self.steps, &mut stages);
            self.out.points.push(end);
            self.out.gradients.push(gradient);
            if self.merge {
                merged(&stages, &mut self.out.influences);
            } else {
                self.out.influences.extend_from_slice(&stages);
            }
        }
    }
}

/// A place of a trajectory on the grid.
#[derive(Clone, Copy)]
pub(crate) struct EndPlace<R, const H: usize> {
    pub first: u32,
    pub trajectory: u32,
    pub weights: [[R; SUPPORT]; 3],
    pub time: Times<R, H>,
    pub matrix: Matrix<R>,
}

/// The quadratic form of the terms at the present field.
pub(crate) struct EndTerms<R: Real, const H: usize> {
    pub places: Vec<EndPlace<R, H>>,
    /// For each trajectory in turn, where its places are in `places`.
    slots: Vec<u32>,
    each: usize,
    residuals: Vec<[R; 3]>,
    pub weights: Vec<Matrix<R>>,
    /// With the idle lane of V.
    moves: Vec<Lanes<R>>,
    pulls: Vec<[R; 3]>,
    parts: Vec<Part<Node<R, H>>>,
}

impl<R: Real, const H: usize> EndTerms<R, H> {
    pub(crate) fn new(
        field: &SplineField<R, H>,
        ends: &Ends<R>,
        residuals: Vec<[R; 3]>,
        weights: Vec<Matrix<R>>,
    ) -> Self {
        let (grid, basis) = (field.grid(), field.time_basis());
        let influences = ends.influences.iter();
        let order = by_first(influences.map(|influence| grid.locate(influence.point).first));
        let mut slots = vec![0; order.len()];
        let mut places = Vec::with_capacity(order.len());
        for &(first, at) in &order {
            slots[at as usize] = places.len() as u32;
            let influence = &ends.influences[at as usize];
            places.push(EndPlace {
                first,
                trajectory: at / ends.each as u32,
                weights: grid.locate(influence.point).weights,
                time: basis.values(influence.time),
                matrix: influence.matrix,
            });
        }
        let firsts: Vec<u32> = order.iter().map(|&(first, _)| first).collect();
        Self {
            moves: vec![[R::ZERO; 4]; places.len()],
            pulls: vec![[R::ZERO; 3]; residuals.len()],
            parts: parts::<_, H>(&firsts, grid.strides(), &Node::ZERO),
            places,
            slots,
            each: ends.each,
            residuals,
            weights,
        }
    }

    pub(crate) fn parts(&self) -> &[Part<Node<R, H>>] {
        &self.parts
    }

    /// Gives up the private copies of nodes until they are needed again.
    pub(crate) fn release(&mut self) {
        self.parts = Vec::new();
    }

    /// How far each place moves its trajectory's end, if the field moves by `nodes`.
    pub(crate) fn move_ends(&mut self, nodes: &[Node<R, H>], strides: [usize; 2]) {
        let length = run_length::<H>(self.places.len());
        self.moves
            .par_chunks_mut(length)
            .zip(self.places.par_chunks(length))
            .for_each(|(out, places)| {
                run(Move {
                    nodes,
                    strides,
                    places,
                    out,
                });
            });
    }

    /// How far each end moves, if the field moves by `nodes`.
    #[cfg(test)]
    pub(crate) fn end_moves(&mut self, nodes: &[Node<R, H>], strides: [usize; 2]) -> Vec<[R; 3]> {
        self.move_ends(nodes, strides);
        let ones = vec![crate::trajectory::diagonal(R::ONE); self.weights.len()];
        let weights = std::mem::replace(&mut self.weights, ones);
        self.spread_moves(strides);
        self.weights = weights;
        self.pulls.clone()
    }

    /// The parts of the product with the Gauss-Newton matrix, after [`Self::move_ends`].
    pub(crate) fn spread_moves(&mut self, strides: [usize; 2]) {
        let slots = self.slots.chunks_exact(self.each);
        for ((pull, weight), slots) in self.pulls.iter_mut().zip(&self.weights).zip(slots) {
            let mut sum = [R::ZERO; 3];
            for &slot in slots {
                let [x, y, z, _] = self.moves[slot as usize];
                sum = [sum[0] + x, sum[1] + y, sum[2] + z];
            }
            *pull = product(weight, sum);
        }
        self.spread(strides);
    }

    /// The parts of the gradient.
    pub(crate) fn spread_residuals(&mut self, strides: [usize; 2]) {
        let each = self.residuals.iter().zip(&self.weights);
        for (pull, (&residual, weight)) in self.pulls.iter_mut().zip(each) {
            *pull = product(weight, residual);
        }
        self.spread(strides);
    }

    fn spread(&mut self, strides: [usize; 2]) {
        if self.parts.is_empty() {
            let firsts: Vec<u32> = self.places.iter().map(|place| place.first).collect();
            self.parts = parts::<_, H>(&firsts, strides, &Node::ZERO);
        }
        let pulls = &self.pulls;
        each_run::<_, _, H>(&mut self.parts, &self.places, |part, places| {
            run(Spread {
                pulls,
                strides,
                places,
                part,
            });
        });
    }
}

#[inline(always)]
fn product<R: Real>(a: &Matrix<R>, x: [R; 3]) -> [R; 3] {
    let row = |i: usize| a[i][0] * x[0] + a[i][1] * x[1] + a[i][2] * x[2];
    [row(0), row(1), row(2)]
}

struct Move<'a, R, const H: usize> {
    nodes: &'a [Node<R, H>],
    strides: [usize; 2],
    places: &'a [EndPlace<R, H>],
    out: &'a mut [Lanes<R>],
}

impl<R: Real, const H: usize> Kernel for Move<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for (out, place) in self.out.iter_mut().zip(self.places) {
            let (weights, time) = (&place.weights, place.time);
            let moved = value(f, self.nodes, self.strides, place.first, weights, time);
            let [x, y, z] = product(&place.matrix, first_three(moved));
            *out = [x, y, z, moved[3]];
        }
    }
}

struct Spread<'a, R, const H: usize> {
    pulls: &'a [[R; 3]],
    strides: [usize; 2],
    places: &'a [EndPlace<R, H>],
    part: &'a mut Part<Node<R, H>>,
}

impl<R: Real, const H: usize> Kernel for Spread<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        let (start, nodes) = self.part.cleared();
        for place in self.places {
            let (m, g) = (&place.matrix, self.pulls[place.trajectory as usize]);
            let column = |j: usize| m[0][j] * g[0] + m[1][j] * g[1] + m[2][j] * g[2];
            let part = Node::outer([column(0), column(1), column(2), R::ZERO], place.time);
            let first = place.first as usize - start;
            add_value(f, nodes, self.strides, first, &place.weights, &part);
        }
    }
}
