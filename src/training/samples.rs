//! The samples of one step, on the host: a function of recipe, seed and step alone, so that every backend
//! and every resumed run has the same ones.
//!
//! | samples | what they are | share of `training.batch` |
//! |---|---|---|
//! | ends | given points of all key frames at their times | 4/11 |
//! | carried | given points of all key frames and the times to which `V` carries them | 3/11 |
//! | collocation | points near the carried ones (the band), and in the box, with times | 4/11 |
//! | matched | correspondences | beside it, `training.correspondence-batch` |
//!
//! The band needs the carried positions, which only the device has: here stand its offsets from them.
//! These shares gave the least error of those that were tried before the first release.
//!
//! Each kind of sample comes from a random stream of its own (`stream`): no two kinds share a draw, and
//! what one kind takes does not shift another. A step's samples are drawn once; where the step is divided,
//! each part takes its share of them ([`Drawn::part`]).

use std::num::NonZeroUsize;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::data::{Bounds, KeyPoints, TrainingData};
use crate::guided::Guided;
use crate::recipe::{TimeSampling, TrainingRecipe};

/// What samples are drawn for. The numbers name the streams: they stay, so that a seed keeps its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Purpose {
    Ends = 0,
    Starts = 1,
    Stops = 2,
    Offsets = 3,
    Uniform = 4,
    Matched = 5,
    Surface = 6,
    Space = 7,
    Between = 8,
    Neighbours = 9,
    Turns = 10,
}

/// Bits of a stream's number that name the purpose.
const PURPOSE_BITS: u32 = 4;

/// The random numbers of one purpose in one step. Streams below those of the first step are left to the
/// sampling of the shapes.
pub(crate) fn stream(seed: u64, step: usize, purpose: Purpose) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((step as u64 + 1) << PURPOSE_BITS | purpose as u64);
    rng
}

/// The least batch that is divided: a quarter of fewer points would not pay for its operations.
const DIVIDED: usize = 512;

/// Points of a part, about: enough to pay for a layer's weights, few enough that the values of some
/// layers stay in a core's cache.
const POINTS_OF_A_PART: usize = 512;

/// Into how many equal parts the samples of a step can be divided: a function of the batch alone, so that
/// the samples are the same on any backend and any number of cores, divided or not.
pub fn parts(batch: usize) -> usize {
    if batch < DIVIDED {
        return 1;
    }
    // A multiple of four, so that two, four or eight cores have the same amount of work each.
    ((batch / POINTS_OF_A_PART + 2) / 4 * 4).max(4)
}

/// How many samples of each kind a step takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchSizes {
    /// Given points of each key frame.
    pub ends: usize,
    /// Carried points from each key frame.
    pub carried: usize,
    /// Collocation points near the surface.
    pub band: usize,
    /// Collocation points in the box.
    pub uniform: usize,
    /// Correspondences.
    pub matched: usize,
}

impl BatchSizes {
    /// The sizes that a recipe gives for this data; each the nearest multiple of [`parts`], so that equal
    /// parts of the batch hold all kinds in equal numbers.
    pub fn new(training: &TrainingRecipe, data: &TrainingData) -> Self {
        let (keys, parts) = (data.keys.len(), parts(training.batch));
        let ends = (training.batch * 4 / 11 / keys).max(1);
        let carried = (training.batch * 3 / 11 / keys).max(1);
        let collocation = training.batch.saturating_sub(keys * (ends + carried));
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
            matched: whole(training.correspondence_batch.min(data.pair_count())),
        }
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
    pub(crate) fn share<T: Copy>(self, rows: &[T]) -> Vec<T> {
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
    pub(crate) fn part(&self, part: Part) -> Self {
        Self {
            points: part.share(&self.points),
            normals: part.share(&self.normals),
            times: part.share(&self.times),
        }
    }
}

/// Corresponding places, each pair with the times of both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matched {
    /// Places in the earlier key frames, `[n, 3]`.
    pub sources: Vec<[f32; 3]>,
    /// Places in the later ones, `[n, 3]`.
    pub targets: Vec<[f32; 3]>,
    /// Times of the earlier ones, `[n]`.
    pub from: Vec<f32>,
    /// Times of the later ones, `[n]`.
    pub to: Vec<f32>,
}

impl Matched {
    /// `count` correspondences drawn from all that are known.
    pub fn draw(data: &TrainingData, seed: u64, step: usize, count: usize) -> Self {
        let rng = &mut stream(seed, step, Purpose::Matched);
        let mut drawn = Self::default();
        for _ in 0..count {
            let ((source, target), [from, to]) = data.pair(rng.random_range(0..data.pair_count()));
            drawn.sources.push(source);
            drawn.targets.push(target);
            drawn.from.push(from);
            drawn.to.push(to);
        }
        drawn
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    fn part(&self, part: Part) -> Self {
        Self {
            sources: part.share(&self.sources),
            targets: part.share(&self.targets),
            from: part.share(&self.from),
            to: part.share(&self.to),
        }
    }
}

/// The samples of a step of a method that has a motion and a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Given points at the times of their key frames, in the order of these.
    pub ends: Samples,
    /// Given points and the times where they start, in the same order.
    pub starts: Samples,
    /// The times to which the starts are carried.
    pub stops: Vec<f32>,
    /// The times of the key frames onto whose surfaces the starts must arrive.
    pub goals: Vec<f32>,
    /// Offsets of the band from carried positions; row `k` belongs to carried row `k mod carried`.
    pub offsets: Vec<[f32; 3]>,
    /// Points of the box with their times.
    pub uniform: Samples,
    /// Correspondences.
    pub matched: Matched,
}

impl Batch {
    /// The samples of `step`.
    pub fn draw(
        data: &TrainingData,
        training: &TrainingRecipe,
        sizes: BatchSizes,
        step: usize,
    ) -> Self {
        let stream = |purpose| stream(training.seed, step, purpose);
        let (mut ends, mut starts) = (Samples::default(), Samples::default());
        let (of_ends, of_starts) = (&mut stream(Purpose::Ends), &mut stream(Purpose::Starts));
        let mut goals = Vec::new();
        for (k, key) in data.keys.iter().enumerate() {
            pick(key, sizes.ends, &mut ends, of_ends);
            pick(key, sizes.carried, &mut starts, of_starts);
            goals.resize(starts.points.len(), data.neighbour(k));
        }
        let of_stops = &mut stream(Purpose::Stops);
        let stops = starts.points.iter().map(|_| time(training, of_stops));
        let stops = stops.collect();
        let of_offsets = &mut stream(Purpose::Offsets);
        let offsets = (0..sizes.band).map(|_| offset(training, of_offsets));
        let offsets = offsets.collect();
        let bounds = data.bounds.padded(training.box_margin as f32);
        let of_uniform = &mut stream(Purpose::Uniform);
        let mut uniform = Samples::default();
        for _ in 0..sizes.uniform {
            uniform.points.push(within(&bounds, of_uniform));
            uniform.times.push(time(training, of_uniform));
        }
        Self {
            ends,
            starts,
            stops,
            goals,
            offsets,
            uniform,
            matched: Matched::draw(data, training.seed, step, sizes.matched),
        }
    }

    /// One of the equal parts of a batch whose sizes are multiples of their number
    /// ([`BatchSizes::new`]).
    ///
    /// It has the shape of a batch of its own: the key frames are in their order, and row `k` of the
    /// offsets belongs to carried row `k mod carried` of the part, because their number is a multiple too.
    pub fn part(&self, part: Part) -> Self {
        Self {
            ends: self.ends.part(part),
            starts: self.starts.part(part),
            stops: part.share(&self.stops),
            goals: part.share(&self.goals),
            offsets: part.share(&self.offsets),
            uniform: self.uniform.part(part),
            matched: self.matched.part(part),
        }
    }
}

/// The samples of one step of what is fitted at the key frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EndBatch {
    /// Given points, half of `training.batch`, in equal numbers for each key frame and in their order.
    pub surface: Samples,
    /// Points near each surface (the band) and in the box, the other half; the same times and order. Of those
    /// in the box, a part lies in the hollows of a shape that has some.
    pub space: Samples,
    /// Times in `[0, 1]`, one for each point of `space`: for terms between the key frames.
    pub between: Vec<f32>,
}

/// The share of a key frame's samples of the box that lie in its hollows, where it has some.
const IN_HOLLOWS: f64 = 0.5;

impl EndBatch {
    /// The samples of `step`, of each kind a multiple of [`parts`]. Hollows are looked after where signed
    /// distances are `measured`: without these nothing is known of them.
    pub fn draw(
        data: &TrainingData,
        training: &TrainingRecipe,
        step: usize,
        measured: bool,
    ) -> Self {
        let stream = |purpose| stream(training.seed, step, purpose);
        let parts = parts(training.batch);
        let count = (training.batch / 2 / data.keys.len() / parts).max(1) * parts;
        let band = (count as f64 * training.band_share).round() as usize;
        let bounds = data.bounds.padded(training.box_margin as f32);
        let (mut surface, mut space) = (Samples::default(), Samples::default());
        let (of_surface, of_space) = (&mut stream(Purpose::Surface), &mut stream(Purpose::Space));
        for key in &data.keys {
            pick(key, count, &mut surface, of_surface);
            let hollow = measured.then(|| data.hollows(key, training));
            let hollow = hollow.filter(|hollow| !hollow.is_empty());
            let filled = band + ((count - band) as f64 * IN_HOLLOWS).round() as usize;
            for k in 0..count {
                space.points.push(if k < band {
                    let near = key.points[of_space.random_range(0..key.points.len())];
                    let by = offset(training, of_space);
                    std::array::from_fn(|axis| near[axis] + by[axis])
                } else if let Some(hollow) = hollow.filter(|_| k < filled) {
                    hollow.draw(of_space)
                } else {
                    within(&bounds, of_space)
                });
                space.times.push(key.time);
            }
        }
        let of_between = &mut stream(Purpose::Between);
        let between = space.points.iter().map(|_| time(training, of_between));
        Self {
            between: between.collect(),
            surface,
            space,
        }
    }

    /// One of the equal parts: as many of each key frame, in their order.
    pub fn part(&self, part: Part) -> Self {
        Self {
            surface: self.surface.part(part),
            space: self.space.part(part),
            between: part.share(&self.between),
        }
    }
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

impl Neighbouring {
    /// A quarter of `training.batch` points of a key frame with normals, each with one of its eight
    /// nearest.
    pub fn draw(key: &KeyPoints, training: &TrainingRecipe, step: usize) -> Self {
        let rng = &mut stream(training.seed, step, Purpose::Neighbours);
        let mut drawn = Self::default();
        let Some(normals) = &key.normals else {
            return drawn;
        };
        for _ in 0..(training.batch / 4).max(1) {
            let k = rng.random_range(0..key.points.len());
            let around = key.around.nearest(k, AROUND);
            // The first is the point itself, or one in the same place.
            let near = around[rng.random_range(1..around.len())];
            drawn.points.push(key.points[k]);
            drawn.normals.push(normals[k]);
            drawn.neighbours.push(key.points[near]);
            drawn.neighbour_normals.push(normals[near]);
        }
        drawn
    }

    fn part(&self, part: Part) -> Self {
        Self {
            points: part.share(&self.points),
            normals: part.share(&self.normals),
            neighbours: part.share(&self.neighbours),
            neighbour_normals: part.share(&self.neighbour_normals),
        }
    }
}

/// All that a method draws for one step; empty what it does not use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Of a motion and a field.
    pub batch: Batch,
    /// Of what is fitted at the key frames.
    pub ends: EndBatch,
    /// Points beside each other on a surface.
    pub neighbours: Neighbouring,
    /// Of a velocity field that is there already.
    pub guided: Guided,
}

impl Drawn {
    /// Correspondences alone, as many as the recipe takes for a step.
    pub fn matched(data: &TrainingData, training: &TrainingRecipe, step: usize) -> Self {
        let count = training.correspondence_batch.min(data.pair_count());
        let matched = Matched::draw(data, training.seed, step, count);
        let batch = Batch {
            matched,
            ..Batch::default()
        };
        Self {
            batch,
            ..Self::default()
        }
    }

    /// One of the equal parts.
    #[must_use]
    pub fn part(&self, part: Part) -> Self {
        Self {
            batch: self.batch.part(part),
            ends: self.ends.part(part),
            neighbours: self.neighbours.part(part),
            guided: self.guided.part(part),
        }
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

/// Adds `count` of a key frame's points, drawn with replacement.
fn pick(key: &KeyPoints, count: usize, into: &mut Samples, rng: &mut impl Rng) {
    for _ in 0..count {
        let k = rng.random_range(0..key.points.len());
        into.points.push(key.points[k]);
        into.times.push(key.time);
        if let Some(normals) = &key.normals {
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
