//! The objective with its draws held still: what tests take differences of.

use crate::band;
use crate::cell::Node;
use crate::ends::Ends;
use crate::prior::Sample;
use crate::real::Real;
use crate::targets::Targets;
use crate::{Solver, SplineError, SplineField};

/// The draws of a step, the nearest samples at a field, and the gradient there.
pub(crate) struct Frozen<R: Real> {
    targets: Targets<R>,
    /// For each on-surface sample, the nearest place, its normal, and the agreement.
    planes: Vec<([f64; 3], [f64; 3], f64)>,
    samples: Vec<Sample<R>>,
    /// Of each trajectory.
    steps: usize,
    ridge: f64,
    pub gradient: Vec<Node<R>>,
}

impl<R: Real> Node<R> {
    pub(crate) fn add_plain(&mut self, factor: R, other: &Self) {
        for (value, other) in self.0.iter_mut().zip(other.0) {
            *value += factor * other;
        }
    }
}

impl<R: Real> Solver<R> {
    pub(crate) fn frozen(
        &self,
        field: &SplineField<R>,
        level: usize,
        step: usize,
    ) -> Result<Frozen<R>, SplineError> {
        let (problem, surfaces, clouds) = self.given();
        let (options, weights) = (self.options(), self.weights());
        let targets = Targets::new(problem, options, weights, step);
        let steps = self.trajectory_steps(field);
        let ends = Ends::new(field, &targets.starts, &targets.times, steps, false);
        let (mut system, _) = self.linearise(field, level, step, false)?;
        Ok(Frozen {
            planes: targets.planes(&ends, surfaces),
            samples: band::samples(
                field,
                clouds,
                options,
                [options.band.div_ceil(2), steps],
                step,
            ),
            steps,
            targets,
            ridge: system.ridge().wide(),
            gradient: system.gradient(field),
        })
    }
}

impl<R: Real> Frozen<R> {
    /// The objective, written out from its formula.
    pub(crate) fn objective(&self, solver: &Solver<R>, field: &SplineField<R>) -> f64 {
        let (options, weights) = (solver.options(), solver.weights());
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
        let squares = field.nodes.iter().flat_map(|node| node.0);
        sum + self.ridge / 2.0 * squares.map(|c| c.wide().powi(2)).sum::<f64>()
    }
}
