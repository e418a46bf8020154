//! The velocity field: `V(x, t) = sum_n sum_k c[n, k] B_n(x) T_k(t)`.
//!
//! | symbol | what |
//! |---|---|
//! | `B_n` | tensor products of quadratic B-splines on a [`Grid`] |
//! | `T_k` | Legendre polynomials of time on `[0, 1]`, one or two ([`TimeBasis`]) |
//! | `c` | the coefficients, `[node, k, axis]`, the node of the third axis fastest |
//!
//! A point outside the grid's box has the velocity of the nearest point in the box.

use rayon::prelude::*;

use crate::basis::{TimeBasis, halved};
use crate::cell::{Jet, LANES, Node, first_three};
use crate::error::SplineError;
use crate::grid::Grid;
use crate::levels::OnGrid;
use crate::real::{Fuse, Kernel, Real, run};
use crate::trajectory::{Flow, Matrix, diagonal};

/// Points that a thread takes at a time.
const PIECE: usize = 256;

/// A velocity field of quadratic B-splines.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineField<R: Real = f32, const H: usize = 1> {
    grid: Grid<R>,
    basis: TimeBasis,
    pub(crate) nodes: Vec<Node<R, H>>,
}

/// Where a point was carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried<R: Real = f32> {
    /// The place.
    pub point: [R; 3],
    /// The derivative of the place by the point, `gradient[i][j] = d place_i / d point_j`.
    pub gradient: [[R; 3]; 3],
}

impl<R: Real> SplineField<R> {
    /// The field that is zero, on cells of one edge over a box with `margin` cells around it.
    ///
    /// # Errors
    /// If the box is none, or the grid has too many nodes.
    pub fn at_rest(
        [lower, upper]: [[f64; 3]; 2],
        spacing: f64,
        margin: usize,
        basis: TimeBasis,
    ) -> Result<Self, SplineError> {
        let grid = Grid::around(lower, upper, spacing, margin)?;
        Ok(Self::zero(grid, basis))
    }

    /// The field that is zero, on a grid.
    ///
    /// # Errors
    /// If the grid is none, or has too many nodes.
    pub fn at_rest_on(grid: Grid<R>, basis: TimeBasis) -> Result<Self, SplineError> {
        Ok(Self::zero(grid.checked()?, basis))
    }

    /// The field of these coefficients, as [`Self::coefficients`] gives them.
    ///
    /// # Errors
    /// If the grid is none, or the coefficients are not finite or not as many as the grid's.
    pub fn from_parts(
        grid: Grid<R>,
        basis: TimeBasis,
        coefficients: &[R],
    ) -> Result<Self, SplineError> {
        let mut out = Self::at_rest_on(grid, basis)?;
        let wanted = out.nodes.len() * basis.functions() * 3;
        check_coefficients(coefficients, wanted)?;
        let each = coefficients.chunks_exact(basis.functions() * 3);
        for (node, values) in out.nodes.iter_mut().zip(each) {
            for (k, values) in values.chunks_exact(3).enumerate() {
                node.flat_mut()[4 * k..4 * k + 3].copy_from_slice(values);
            }
        }
        Ok(out)
    }
}

impl<R: Real, const H: usize> SplineField<R, H> {
    /// The field that is zero everywhere.
    ///
    /// # Panics
    /// If nodes have no room for the functions of time.
    pub(crate) fn zero(grid: Grid<R>, basis: TimeBasis) -> Self {
        assert!(basis.functions() <= 2 * H, "room for each function");
        let nodes = vec![Node::ZERO; grid.size()];
        Self { grid, basis, nodes }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<R> {
        &self.grid
    }

    /// The functions of time.
    pub fn time_basis(&self) -> TimeBasis {
        self.basis
    }

    /// The coefficients, `[nodes x, nodes y, nodes z, functions of time, 3]`.
    pub fn coefficients(&self) -> Vec<R> {
        let functions = self.basis.functions();
        let mut out = Vec::with_capacity(3 * functions * self.nodes.len());
        for node in &self.nodes {
            for vector in node.flat().chunks_exact(4).take(functions) {
                out.extend_from_slice(&vector[..3]);
            }
        }
        out
    }

    pub(crate) fn flow(&self) -> Flow<'_, R, H> {
        Flow {
            grid: &self.grid,
            strides: self.grid.strides(),
            nodes: &self.nodes,
            basis: self.basis,
        }
    }

    /// V at each point, at one time.
    pub fn values(&self, points: &[[R; 3]], t: R) -> Vec<[R; 3]> {
        let times = vec![t; points.len()];
        let jets = self.jets(points, &times);
        jets.into_iter().map(|jet| jet.value).collect()
    }

    /// V, its rate and its Jacobian at each point, each at its own time.
    ///
    /// # Panics
    /// If there is not one time for each point.
    pub fn jets(&self, points: &[[R; 3]], times: &[R]) -> Vec<Jet<R>> {
        same_length(points, times);
        let zero = Jet {
            value: [R::ZERO; 3],
            rate: [R::ZERO; 3],
            jacobian: [[R::ZERO; 3]; 3],
        };
        let mut out = vec![zero; points.len()];
        let pieces = out.par_chunks_mut(PIECE).zip(points.par_chunks(PIECE));
        pieces
            .zip(times.par_chunks(PIECE))
            .for_each(|((out, points), times)| {
                run(Jets {
                    flow: self.flow(),
                    points,
                    times,
                    out,
                });
            });
        out
    }

    /// Where the points at time `from` are carried to at time `to`, by `steps` steps.
    ///
    /// # Panics
    /// If there are no steps.
    pub fn carry(&self, points: &[[R; 3]], from: R, to: R, steps: usize) -> Vec<[R; 3]> {
        let times = |t: R| vec![t; points.len()];
        self.carry_each(points, &times(from), &times(to), steps)
    }

    /// [`Self::carry`] with times of their own for each point.
    ///
    /// # Panics
    /// If there is not one time for each point in `from` and `to`, or no steps.
    pub fn carry_each(&self, points: &[[R; 3]], from: &[R], to: &[R], steps: usize) -> Vec<[R; 3]> {
        same_length(points, from);
        same_length(points, to);
        assert!(steps > 0, "trajectories of no steps");
        let mut out = points.to_vec();
        out.par_chunks_mut(PIECE)
            .zip(from.par_chunks(PIECE).zip(to.par_chunks(PIECE)))
            .for_each(|(points, (from, to))| {
                let mut idle = R::ZERO;
                run(Carry {
                    flow: self.flow(),
                    from,
                    to,
                    steps,
                    points,
                    idle: &mut idle,
                });
                debug_assert!(idle == R::ZERO || !idle.wide().is_finite());
            });
        out
    }

    /// Where the points are carried, and the exact derivative of these steps by the points.
    ///
    /// # Panics
    /// If there are no steps.
    pub fn carry_with_gradient(
        &self,
        points: &[[R; 3]],
        from: R,
        to: R,
        steps: usize,
    ) -> Vec<Carried<R>> {
        assert!(steps > 0, "trajectories of no steps");
        let start = |&point: &[R; 3]| Carried {
            point,
            gradient: diagonal(R::ONE),
        };
        let mut out: Vec<Carried<R>> = points.iter().map(start).collect();
        out.par_chunks_mut(PIECE).for_each(|points| {
            run(CarryWithGradient {
                flow: self.flow(),
                times: [from, to],
                steps,
                points,
            });
        });
        out
    }

    /// How many steps from time 0 to 1 follow the field closely: `least`, doubled until all but a twentieth of
    /// the probes end within `tolerance` of where twice the steps take them, at most `most`. The first probes
    /// start at time 0, the others at time 1.
    pub fn steps_within(
        &self,
        probes: [&[[R; 3]]; 2],
        tolerance: f64,
        [least, most]: [usize; 2],
    ) -> usize {
        let mut steps = least;
        for (probes, [from, to]) in probes
            .into_iter()
            .zip([[R::ZERO, R::ONE], [R::ONE, R::ZERO]])
        {
            let mut ends = self.carry(probes, from, to, steps);
            while 2 * steps <= most {
                let finer = self.carry(probes, from, to, 2 * steps);
                let far = |(a, b): &(&[R; 3], &[R; 3])| {
                    let square = |i: usize| (a[i] - b[i]).wide().powi(2);
                    // What is not finite is far.
                    let near = square(0) + square(1) + square(2) <= tolerance * tolerance;
                    !near
                };
                if ends.iter().zip(&finer).filter(far).count() * 20 <= probes.len() {
                    break;
                }
                steps *= 2;
                ends = finer;
            }
        }
        steps
    }

    /// The same field on a grid of half the spacing.
    ///
    /// # Errors
    /// If that grid has too many nodes.
    pub fn refined(&self) -> Result<Self, SplineError> {
        let mut out = Self::zero(self.grid.halved()?, self.basis);
        refine(&self.grid, &self.nodes, 1, &out.grid, &mut out.nodes);
        Ok(out)
    }
}

/// # Errors
/// If coefficients are not so many, or not finite.
pub(crate) fn check_coefficients<R: Real>(
    coefficients: &[R],
    wanted: usize,
) -> Result<(), SplineError> {
    if coefficients.len() != wanted {
        return Err(SplineError::Lengths {
            what: "coefficients",
            found: coefficients.len(),
            wanted,
        });
    }
    let wrong = coefficients.iter().position(|c| !c.wide().is_finite());
    match wrong {
        None => Ok(()),
        Some(index) => Err(SplineError::Input {
            what: "coefficient",
            index,
            found: format!("{:?}", coefficients[index]),
            also: "",
        }),
    }
}

impl<R: Real> OnGrid<R> for SplineField<R> {
    fn grid(&self) -> &Grid<R> {
        &self.grid
    }

    fn refined(&self) -> Result<Self, SplineError> {
        self.refined()
    }
}

/// Fills the nodes of the grid of half the spacing; each node is `each` entries.
pub(crate) fn refine<R: Real, const H: usize>(
    grid: &Grid<R>,
    coarse: &[Node<R, H>],
    each: usize,
    finer: &Grid<R>,
    fine: &mut [Node<R, H>],
) {
    let [coarse_y, coarse_z] = grid.strides();
    let [_, ny, nz] = finer.nodes();
    fine.par_chunks_mut(ny * nz * each)
        .enumerate()
        .for_each(|(x, nodes)| {
            let x = halved(x);
            for (at, node) in nodes.iter_mut().enumerate() {
                let (at, entry) = (at / each, at % each);
                let (y, z) = (halved(at / nz), halved(at % nz));
                let first = x.0 * coarse_y + y.0 * coarse_z + z.0;
                let mut sum = [[0.0; LANES]; H];
                for corner in 0..8 {
                    let [a, b, c] = [corner >> 2, corner >> 1 & 1, corner & 1];
                    let share = x.1[a] * y.1[b] * z.1[c];
                    let from = first + a * coarse_y + b * coarse_z + c;
                    let sums = sum.as_flattened_mut().iter_mut();
                    for (sum, value) in sums.zip(coarse[from * each + entry].flat()) {
                        *sum += share * value.wide();
                    }
                }
                node.0 = sum.map(|half| half.map(R::of));
            }
        });
}

#[track_caller]
fn same_length<A, B>(points: &[A], times: &[B]) {
    assert_eq!(points.len(), times.len(), "one time for each point");
}

struct Jets<'a, R: Real, const H: usize> {
    flow: Flow<'a, R, H>,
    points: &'a [[R; 3]],
    times: &'a [R],
    out: &'a mut [Jet<R>],
}

impl<R: Real, const H: usize> Kernel for Jets<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for ((out, &x), &t) in self.out.iter_mut().zip(self.points).zip(self.times) {
            *out = self.flow.jet(f, x, t);
        }
    }
}

struct Carry<'a, R: Real, const H: usize> {
    flow: Flow<'a, R, H>,
    from: &'a [R],
    to: &'a [R],
    steps: usize,
    points: &'a mut [[R; 3]],
    /// The sum of the idle lanes: what keeps them.
    idle: &'a mut R,
}

impl<R: Real, const H: usize> Kernel for Carry<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        let mut idle = R::ZERO;
        for ((point, &from), &to) in self.points.iter_mut().zip(self.from).zip(self.to) {
            let [x, y, z] = *point;
            let end = self
                .flow
                .carry(f, [x, y, z, R::ZERO], [from, to], self.steps);
            *point = first_three(end);
            idle += end[3];
        }
        *self.idle = idle;
    }
}

struct CarryWithGradient<'a, R: Real, const H: usize> {
    flow: Flow<'a, R, H>,
    times: [R; 2],
    steps: usize,
    points: &'a mut [Carried<R>],
}

impl<R: Real, const H: usize> Kernel for CarryWithGradient<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        for out in self.points {
            let (point, gradient): ([R; 3], Matrix<R>) =
                self.flow.gradient(f, out.point, self.times, self.steps);
            *out = Carried { point, gradient };
        }
    }
}
