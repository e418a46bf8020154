//! The terms on the field itself, at points of a band about the moving surface.
//!
//! ```text
//! E = sum_q w_q (strain |D|^2 + divergence |tr J| + screw |V_t + D V|^2),   D = (J + J^T) / 2
//! ```
//!
//! Strain and screw vanish for rigid motion along a screw. `|tr J|` is `sqrt((tr J)^2 + 0.05^2)`, by
//! iteratively reweighted squares. The screw term is linearised at the present field.

use crate::basis::Times;
use crate::cell::{Jet, Node, WideJet, add_jet, jet};
use crate::field::SplineField;
use crate::grid::Located;
use crate::options::Weights;
use crate::real::{Fuse, Kernel, Real, run};
use crate::scatter::{Part, by_first, each_run, parts};
use crate::trajectory::Matrix;

/// Below this the divergence counts by its square.
const DIVERGENCE_SCALE: f64 = 0.05;

/// A point of the band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample<R> {
    pub point: [R; 3],
    pub time: R,
    /// Its share of the means; all shares within the band sum to 1.
    pub share: f64,
    /// Whether it is in the band, not beside it.
    pub inside: bool,
}

/// A point of the band on the grid, with what is linearised there.
pub(crate) struct PriorPlace<R: Real, const H: usize> {
    pub located: Located<R>,
    /// The functions of time, and their derivatives.
    pub times: [Times<R, H>; 2],
    /// Of strain, divergence and screw.
    pub factors: [R; 3],
    value: [R; 3],
    symmetric: Matrix<R>,
    base: Jet<R>,
}

/// Means over the band, without weights.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PriorMeans {
    pub strain: f64,
    pub divergence: f64,
    pub screw: f64,
}

/// The quadratic form of the terms at the present field.
pub(crate) struct PriorTerms<R: Real, const H: usize> {
    pub places: Vec<PriorPlace<R, H>>,
    pub means: PriorMeans,
    parts: Vec<Part<Node<R, H>>>,
}

impl<R: Real, const H: usize> PriorTerms<R, H> {
    pub(crate) fn new(field: &SplineField<R, H>, samples: &[Sample<R>], weights: &Weights) -> Self {
        let first = |sample: &Sample<R>| field.grid().locate(sample.point).first;
        let order = by_first(samples.iter().map(first));
        let sorted: Vec<&Sample<R>> = order.iter().map(|&(_, at)| &samples[at as usize]).collect();
        let points: Vec<[R; 3]> = sorted.iter().map(|sample| sample.point).collect();
        let times: Vec<R> = sorted.iter().map(|sample| sample.time).collect();
        let jets = field.jets(&points, &times);
        let mut means = PriorMeans::default();
        let mut places = Vec::with_capacity(samples.len());
        for (sample, base) in sorted.into_iter().zip(jets) {
            let place = PriorPlace::new(field, sample, base, weights);
            if sample.inside {
                let [strain, divergence, screw] = place.densities();
                means.strain += sample.share * strain;
                means.divergence += sample.share * divergence.abs();
                means.screw += sample.share * screw;
            }
            places.push(place);
        }
        let firsts: Vec<u32> = order.iter().map(|&(first, _)| first).collect();
        Self {
            parts: parts::<_, H>(&firsts, field.grid().strides(), &Node::ZERO),
            places,
            means,
        }
    }

    pub(crate) fn parts(&self) -> &[Part<Node<R, H>>] {
        &self.parts
    }

    /// Gives up the private copies of nodes until they are needed again.
    pub(crate) fn release(&mut self) {
        self.parts = Vec::new();
    }

    /// The private copies are there.
    fn ensure_parts(&mut self, strides: [usize; 2]) {
        if self.parts.is_empty() {
            let places = self.places.iter();
            let firsts: Vec<u32> = places.map(|place| place.located.first).collect();
            self.parts = parts::<_, H>(&firsts, strides, &Node::ZERO);
        }
    }

    /// The parts of the product with the Gauss-Newton matrix.
    pub(crate) fn spread_product(&mut self, nodes: &[Node<R, H>], strides: [usize; 2]) {
        self.ensure_parts(strides);
        each_run::<_, _, H>(&mut self.parts, &self.places, |part, places| {
            run(Product {
                nodes,
                strides,
                places,
                part,
            });
        });
    }

    /// The parts of the gradient.
    pub(crate) fn spread_gradient(&mut self, strides: [usize; 2]) {
        self.ensure_parts(strides);
        each_run::<_, _, H>(&mut self.parts, &self.places, |part, places| {
            run(Gradient {
                strides,
                places,
                part,
            });
        });
    }
}

impl<R: Real, const H: usize> PriorPlace<R, H> {
    fn new(field: &SplineField<R, H>, sample: &Sample<R>, base: Jet<R>, weights: &Weights) -> Self {
        let j = &base.jacobian;
        let trace = (j[0][0] + j[1][1] + j[2][2]).wide();
        let divergence = weights.divergence / trace.hypot(DIVERGENCE_SCALE);
        let basis = field.time_basis();
        let factor = |weight: f64| R::of(weight * sample.share);
        Self {
            located: field.grid().locate(sample.point),
            times: [basis.values(sample.time), basis.rates(sample.time)],
            factors: [
                factor(2.0 * weights.strain),
                factor(divergence),
                factor(2.0 * weights.screw),
            ],
            value: base.value,
            symmetric: symmetric(j),
            base,
        }
    }

    /// `|D|^2`, `tr J` and `|V_t + D V|^2` of the present field.
    fn densities(&self) -> [f64; 3] {
        let square = |row: &[R; 3]| row.iter().map(|x| x.wide().powi(2)).sum::<f64>();
        let j = &self.base.jacobian;
        let trace = (j[0][0] + j[1][1] + j[2][2]).wide();
        let strain = self.symmetric.iter().map(square).sum();
        [strain, trace, square(&self.screw())]
    }

    /// `V_t + D V` of the present field.
    #[inline(always)]
    fn screw(&self) -> [R; 3] {
        let mut out = self.base.rate;
        for i in 0..3 {
            for j in 0..3 {
                out[i] += self.symmetric[i][j] * self.value[j];
            }
        }
        out
    }

    /// What multiplies a variation's jet: from the symmetric part of a Jacobian, its divergence and the
    /// screw residual. `idle` is what the idle lanes hold.
    #[inline(always)]
    fn pull(&self, d: &Matrix<R>, residual: [R; 3], idle: &WideJet<R>) -> WideJet<R> {
        let [strain, divergence, screw] = self.factors;
        let trace = divergence * (d[0][0] + d[1][1] + d[2][2]);
        let r = [
            screw * residual[0],
            screw * residual[1],
            screw * residual[2],
        ];
        let (v, s) = (self.value, &self.symmetric);
        let mut out = *idle;
        for i in 0..3 {
            out.value[i] = s[i][0] * r[0] + s[i][1] * r[1] + s[i][2] * r[2];
            out.rate[i] = r[i];
            for j in 0..3 {
                out.columns[j][i] = strain * d[i][j] + R::HALF * (r[i] * v[j] + r[j] * v[i]);
            }
            out.columns[i][i] += trace;
        }
        out
    }
}

#[inline(always)]
fn symmetric<R: Real>(j: &Matrix<R>) -> Matrix<R> {
    let mut out = *j;
    for a in 0..3 {
        for b in 0..3 {
            out[a][b] = R::HALF * (j[a][b] + j[b][a]);
        }
    }
    out
}

struct Product<'a, R: Real, const H: usize> {
    nodes: &'a [Node<R, H>],
    strides: [usize; 2],
    places: &'a [PriorPlace<R, H>],
    part: &'a mut Part<Node<R, H>>,
}

impl<R: Real, const H: usize> Kernel for Product<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        let (start, nodes) = self.part.cleared();
        for place in self.places {
            let (located, times) = (&place.located, place.times);
            let u = jet(f, self.nodes, self.strides, located, times);
            let jet = u.narrow();
            let d = symmetric(&jet.jacobian);
            let mut r = jet.rate;
            for i in 0..3 {
                for j in 0..3 {
                    r[i] += d[i][j] * place.value[j] + place.symmetric[i][j] * u.value[j];
                }
            }
            let pull = place.pull(&d, r, &u);
            let first = located.first as usize - start;
            add_jet(f, nodes, self.strides, located, first, times, &pull);
        }
    }
}

struct Gradient<'a, R: Real, const H: usize> {
    strides: [usize; 2],
    places: &'a [PriorPlace<R, H>],
    part: &'a mut Part<Node<R, H>>,
}

impl<R: Real, const H: usize> Kernel for Gradient<'_, R, H> {
    #[inline(always)]
    fn run<F: Fuse>(self, f: F) {
        let (start, nodes) = self.part.cleared();
        let none = WideJet {
            value: [R::ZERO; 4],
            rate: [R::ZERO; 4],
            columns: [[R::ZERO; 4]; 3],
        };
        for place in self.places {
            let (located, times) = (&place.located, place.times);
            let pull = place.pull(&place.symmetric, place.screw(), &none);
            let first = located.first as usize - start;
            add_jet(f, nodes, self.strides, located, first, times, &pull);
        }
    }
}
