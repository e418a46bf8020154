//! The samples of one step, on the host: a pure function of the seed and the step, so that every backend
//! and every resumed run sees the same ones.
//!
//! | samples | what they are | share of `training.batch` |
//! |---|---|---|
//! | ends | given points of both shapes at t = 0 and t = 1 | 4/11 |
//! | carried | given points of both shapes and the times to which `V` carries them | 3/11 |
//! | collocation | points near the carried ones (the band), and in the box, with times | 4/11 |
//! | matched | correspondences | beside it, `training.correspondence-batch` |
//!
//! The band needs the carried positions, which only the device knows: here stand its offsets from them.
//! The shares are those of the prototype study (`shared/probes/prototype.md`, section 3).

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::recipe::{TimeSampling, TrainingRecipe};
use crate::shape::{Bounds, Cloud, Pair};

/// How many samples of each kind a step takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchSizes {
    /// Given points of each shape.
    pub ends: usize,
    /// Carried points from each shape.
    pub carried: usize,
    /// Collocation points near the surface.
    pub band: usize,
    /// Collocation points in the box.
    pub uniform: usize,
    /// Correspondences.
    pub matched: usize,
}

impl BatchSizes {
    /// The sizes that a recipe asks for, given how many correspondences there are.
    pub fn new(training: &TrainingRecipe, correspondences: usize) -> Self {
        let ends = (training.batch * 2 / 11).max(1);
        let carried = (training.batch * 3 / 22).max(1);
        let collocation = training.batch - 2 * (ends + carried);
        let band = (collocation as f64 * training.band_share).round() as usize;
        Self {
            ends,
            carried,
            band,
            uniform: collocation - band,
            matched: training.correspondence_batch.min(correspondences),
        }
    }

    /// Points at which f is evaluated: all but the correspondences.
    pub const fn total(&self) -> usize {
        2 * self.ends + 2 * self.carried + self.band + self.uniform
    }
}

/// Points, their times, and their normals where the data has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// `[n, 3]`.
    pub points: Vec<[f32; 3]>,
    /// `[n, 3]`, or empty.
    pub normals: Vec<[f32; 3]>,
    /// `[n]`.
    pub times: Vec<f32>,
}

/// The samples of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// Given points; their times are 0 and 1, source first.
    pub ends: Samples,
    /// Given points and the times where they start, source first.
    pub starts: Samples,
    /// The times to which the starts are carried.
    pub stops: Vec<f32>,
    /// Offsets of the band from carried positions; row `k` belongs to carried row `k mod carried`.
    pub offsets: Vec<[f32; 3]>,
    /// Points of the box with their times.
    pub uniform: Samples,
    /// Corresponding points, of the source and of the target.
    pub matched: (Vec<[f32; 3]>, Vec<[f32; 3]>),
}

/// The samples of `step`.
pub fn draw(pair: &Pair, training: &TrainingRecipe, sizes: BatchSizes, step: usize) -> Batch {
    let rng = &mut ChaCha8Rng::seed_from_u64(training.seed);
    rng.set_stream(step as u64 + 1);
    let mut ends = Samples::default();
    let mut starts = Samples::default();
    for (cloud, time) in [(&pair.source, 0.0), (&pair.target, 1.0)] {
        pick(cloud, time, sizes.ends, &mut ends, rng);
        pick(cloud, time, sizes.carried, &mut starts, rng);
    }
    let stops = (0..2 * sizes.carried)
        .map(|_| time(training, rng))
        .collect();
    let offsets = (0..sizes.band)
        .map(|_| {
            let width = training.band_widths[rng.random_range(0..training.band_widths.len())];
            [(); 3].map(|()| {
                let normal: f32 = StandardNormal.sample(rng);
                normal * width as f32
            })
        })
        .collect();
    let bounds = pair.bounds.padded(training.box_margin as f32);
    let uniform = Samples {
        points: (0..sizes.uniform).map(|_| within(&bounds, rng)).collect(),
        normals: Vec::new(),
        times: (0..sizes.uniform).map(|_| time(training, rng)).collect(),
    };
    let known = &pair.correspondences;
    let matched = (0..sizes.matched)
        .map(|_| known[rng.random_range(0..known.len())])
        .unzip();
    Batch {
        ends,
        starts,
        stops,
        offsets,
        uniform,
        matched,
    }
}

fn pick(cloud: &Cloud, time: f32, count: usize, into: &mut Samples, rng: &mut impl Rng) {
    for _ in 0..count {
        let k = rng.random_range(0..cloud.points.len());
        into.points.push(cloud.points[k]);
        into.times.push(time);
        if let Some(normals) = &cloud.normals {
            into.normals.push(normals[k]);
        }
    }
}

/// A time in `[0, 1]`: of the integrator's grid, or anywhere, with a twelfth of the samples on each end.
fn time(training: &TrainingRecipe, rng: &mut impl Rng) -> f32 {
    match training.times {
        TimeSampling::Random => rng.random_range(-0.1f32..1.1).clamp(0.0, 1.0),
        TimeSampling::Grid => {
            rng.random_range(0..=training.time_steps) as f32 / training.time_steps as f32
        }
    }
}

fn within(bounds: &Bounds, rng: &mut impl Rng) -> [f32; 3] {
    std::array::from_fn(|axis| {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        low + (high - low) * rng.random::<f32>()
    })
}
