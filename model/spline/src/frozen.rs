//! The objective with its draws held still: what tests take differences of.

use crate::SplineField;
use crate::band;
use crate::cell::Node;
use crate::ends::Ends;
use crate::hop::{Hop, Pass};
use crate::options::Options;
use crate::prior::Sample;
use crate::real::Real;
use crate::targets::Targets;

/// The draws of a step between two shapes, and the nearest samples at a field.
pub(crate) struct Frozen<R: Real> {
    targets: Targets<R>,
    /// For each on-surface sample, the nearest place, its normal, and the agreement.
    planes: Vec<([f64; 3], [f64; 3], f64)>,
    samples: Vec<Sample<R>>,
    /// Of each trajectory.
    steps: usize,
}

impl<R: Real, const H: usize> Node<R, H> {
    pub(crate) fn add_plain(&mut self, factor: R, other: &Self) {
        for (value, &other) in self.flat_mut().iter_mut().zip(other.flat()) {
            *value += factor * other;
        }
    }
}

/// Half the sum of the squares of all coefficients.
pub(crate) fn half_squares<R: Real>(nodes: &[Node<R>]) -> f64 {
    let squares = nodes.iter().flat_map(|node| node.0[0]);
    0.5 * squares.map(|c| c.wide().powi(2)).sum::<f64>()
}

impl<R: Real> Frozen<R> {
    pub(crate) fn new<const H: usize>(
        hop: &Hop<R>,
        field: &SplineField<R, H>,
        options: &Options,
        pass: Pass,
    ) -> Self {
        let targets = Targets::new(&hop.shapes, &hop.pairs, options, &hop.weights, pass.draw);
        let steps = hop.trajectory_steps(field, options);
        let ends = Ends::new(field, &targets.starts, &targets.times, steps, false);
        let amount = [options.band_at(pass.level), steps];
        Self {
            planes: targets.planes(&ends, &hop.surfaces),
            samples: band::samples(field, &hop.clouds, options, amount, pass.draw),
            steps,
            targets,
        }
    }

    /// The objective without the ridge, written out from its formula.
    pub(crate) fn objective<const H: usize>(
        &self,
        hop: &Hop<R>,
        field: &SplineField<R, H>,
        options: &Options,
    ) -> f64 {
        let weights = &hop.weights;
        let from: Vec<R> = self.targets.times.iter().map(|times| times[0]).collect();
        let to: Vec<R> = self.targets.times.iter().map(|times| times[1]).collect();
        let ends = field.carry_each(&self.targets.starts, &from, &to, self.steps);
        let goals = self.targets.goals();
        let (of_pairs, of_samples) = ends.split_at(goals.len());
        let robust = |r: f64| r.hypot(options.robust_scale);
        let mut sum = 0.0;
        for (end, goal) in of_pairs.iter().zip(goals) {
            let square: f64 = (0..3).map(|i| (end[i].wide() - goal[i]).powi(2)).sum();
            sum += weights.matching / goals.len() as f64 * robust(square.sqrt());
        }
        for (end, (place, normal, agreement)) in of_samples.iter().zip(&self.planes) {
            let r: f64 = (0..3).map(|i| (end[i].wide() - place[i]) * normal[i]).sum();
            sum += weights.on_surface / of_samples.len() as f64 * agreement * robust(r);
        }
        let points: Vec<[R; 3]> = self.samples.iter().map(|sample| sample.point).collect();
        let times: Vec<R> = self.samples.iter().map(|sample| sample.time).collect();
        for (jet, sample) in field.jets(&points, &times).iter().zip(&self.samples) {
            let j = jet.jacobian.map(|row| row.map(R::wide));
            let d = [0, 1, 2].map(|a| [0, 1, 2].map(|b| (j[a][b] + j[b][a]) / 2.0));
            let strain: f64 = d.as_flattened().iter().map(|x| x * x).sum();
            let screw: f64 = (0..3)
                .map(|a| (0..3).fold(jet.rate[a].wide(), |r, b| r + d[a][b] * jet.value[b].wide()))
                .map(|r| r * r)
                .sum();
            let divergence = (j[0][0] + j[1][1] + j[2][2]).hypot(0.05);
            sum += sample.share
                * (weights.strain * strain
                    + weights.screw * screw
                    + weights.divergence * divergence);
        }
        sum
    }
}
