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

use std::num::NonZeroUsize;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::recipe::{TimeSampling, TrainingRecipe};
use crate::shape::{Bounds, Cloud, NeighbourSearch, Pair};

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
    /// The sizes that a recipe asks for, given how many correspondences there are; each the nearest
    /// multiple of `parts`, so that equal parts of the batch hold all kinds in equal numbers.
    pub fn new(training: &TrainingRecipe, correspondences: usize, parts: usize) -> Self {
        let ends = (training.batch * 2 / 11).max(1);
        let carried = (training.batch * 3 / 22).max(1);
        let collocation = training.batch - 2 * (ends + carried);
        let band = (collocation as f64 * training.band_share).round() as usize;
        let whole = |count: usize| {
            let multiple = (count + parts / 2) / parts * parts;
            if count == 0 { 0 } else { multiple.max(parts) }
        };
        Self {
            ends: whole(ends),
            carried: whole(carried),
            band: whole(band),
            uniform: whole(collocation - band),
            matched: whole(training.correspondence_batch.min(correspondences)),
        }
    }

    /// The sizes of one of so many equal parts.
    pub const fn part(self, parts: usize) -> Self {
        Self {
            ends: self.ends / parts,
            carried: self.carried / parts,
            band: self.band / parts,
            uniform: self.uniform / parts,
            matched: self.matched / parts,
        }
    }

    /// Points at which f is evaluated: all but the correspondences.
    pub const fn total(&self) -> usize {
        2 * self.ends + 2 * self.carried + self.band + self.uniform
    }
}

/// One of the equal parts into which the samples of a step are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Counted from 0.
    pub index: usize,
    /// How many there are, at least 1.
    pub of: usize,
}

impl Part {
    /// The whole.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// This part's share: every `of`-th row, so that the order of what is left stays as it was.
    fn share<T: Copy>(self, rows: &[T]) -> Vec<T> {
        let rows = rows.iter().skip(self.index).step_by(self.of);
        rows.copied().collect()
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

impl Samples {
    fn part(&self, part: Part) -> Self {
        Self {
            points: part.share(&self.points),
            normals: part.share(&self.normals),
            times: part.share(&self.times),
        }
    }
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

impl Batch {
    /// One of the equal parts of a batch whose sizes are multiples of their number
    /// ([`BatchSizes::new`]).
    ///
    /// It has the shape of a batch of its own: the source is first, and row `k` of the offsets belongs to
    /// carried row `k mod carried` of the part, because their number is a multiple too.
    pub fn part(&self, part: Part) -> Self {
        Self {
            ends: self.ends.part(part),
            starts: self.starts.part(part),
            stops: part.share(&self.stops),
            offsets: part.share(&self.offsets),
            uniform: self.uniform.part(part),
            matched: (part.share(&self.matched.0), part.share(&self.matched.1)),
        }
    }
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
    let offsets = (0..sizes.band).map(|_| offset(training, rng)).collect();
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

/// The samples of one step of a method that is fitted at t = 0 and t = 1.
#[derive(Clone, Debug, PartialEq)]
pub struct EndBatch {
    /// Given points, half of `training.batch`; their times are 0 and 1, source first, in equal numbers.
    pub surface: Samples,
    /// Points near each surface (the band) and in the box, the other half; the same times and order.
    pub space: Samples,
    /// Times in `[0, 1]`, one for each point of `space`: for terms between the ends.
    pub between: Vec<f32>,
}

impl EndBatch {
    /// One of the equal parts: as many of the source as of the target, the source first.
    pub fn part(&self, part: Part) -> Self {
        Self {
            surface: self.surface.part(part),
            space: self.space.part(part),
            between: part.share(&self.between),
        }
    }
}

/// The samples of `step` at both ends, of each kind a multiple of `parts`.
pub fn draw_ends(pair: &Pair, training: &TrainingRecipe, step: usize, parts: usize) -> EndBatch {
    let rng = &mut ChaCha8Rng::seed_from_u64(training.seed);
    rng.set_stream(step as u64 + 1);
    let count = (training.batch / 4 / parts).max(1) * parts;
    let band = (count as f64 * training.band_share).round() as usize;
    let bounds = pair.bounds.padded(training.box_margin as f32);
    let (mut surface, mut space) = (Samples::default(), Samples::default());
    for (cloud, time) in [(&pair.source, 0.0), (&pair.target, 1.0)] {
        pick(cloud, time, count, &mut surface, rng);
        for k in 0..count {
            space.points.push(if k < band {
                let near = cloud.points[rng.random_range(0..cloud.points.len())];
                let by = offset(training, rng);
                std::array::from_fn(|axis| near[axis] + by[axis])
            } else {
                within(&bounds, rng)
            });
            space.times.push(time);
        }
    }
    let between = (0..2 * count).map(|_| time(training, rng)).collect();
    EndBatch {
        surface,
        space,
        between,
    }
}

/// A random offset from the surface.
fn offset(training: &TrainingRecipe, rng: &mut impl Rng) -> [f32; 3] {
    let width = training.band_widths[rng.random_range(0..training.band_widths.len())];
    [(); 3].map(|()| {
        let normal: f32 = StandardNormal.sample(rng);
        normal * width as f32
    })
}

/// Correspondences drawn for a step, of the source and of the target; as many as the recipe asks for.
pub fn draw_matched(
    pair: &Pair,
    training: &TrainingRecipe,
    step: usize,
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let rng = &mut ChaCha8Rng::seed_from_u64(training.seed);
    rng.set_stream(step as u64 + 1);
    let known = &pair.correspondences;
    let count = training.correspondence_batch.min(known.len());
    (0..count)
        .map(|_| known[rng.random_range(0..known.len())])
        .unzip()
}

/// Points of one surface with a near neighbour of each, and the normals of both; all `[n, 3]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Neighbouring {
    /// The points.
    pub points: Vec<[f32; 3]>,
    /// Their normals.
    pub normals: Vec<[f32; 3]>,
    /// A near neighbour of each, another point.
    pub neighbours: Vec<[f32; 3]>,
    /// The neighbours' normals.
    pub neighbour_normals: Vec<[f32; 3]>,
}

/// Nearest points among which a neighbour is drawn.
const AROUND: NonZeroUsize = NonZeroUsize::new(9).expect("9 is not 0");

/// A quarter of `training.batch` points of a cloud with normals, each with one of its eight nearest.
pub fn draw_neighbours(
    cloud: &Cloud,
    search: &NeighbourSearch,
    training: &TrainingRecipe,
    step: usize,
) -> Neighbouring {
    let rng = &mut ChaCha8Rng::seed_from_u64(training.seed);
    rng.set_stream(step as u64 + 1);
    let mut drawn = Neighbouring::default();
    let Some(normals) = &cloud.normals else {
        return drawn;
    };
    for _ in 0..(training.batch / 4).max(1) {
        let k = rng.random_range(0..cloud.points.len());
        let around = search.nearest(cloud.points[k].map(f64::from), AROUND);
        // The first is the point itself, or one in the same place.
        let place = rng.random_range(1..around.len());
        let near = around[place].index as usize;
        drawn.points.push(cloud.points[k]);
        drawn.normals.push(normals[k]);
        drawn.neighbours.push(cloud.points[near]);
        drawn.neighbour_normals.push(normals[near]);
    }
    drawn
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
