//! Points of a band about the moving surface, as a quadrature of it.
//!
//! Samples of both surfaces are carried to random times and moved off by a normal deviate. Too few of them
//! would let the field strain between them. So many are drawn, and gathered: those in one cube and one
//! interval of time become their mean, weighted by their number.
//!
//! One point in each cell of the band and around it, at a small weight, extends the field smoothly.

use std::sync::Arc;

use rand::seq::index;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::field::SplineField;
use crate::grid::Grid;
use crate::options::Options;
use crate::prior::Sample;
use crate::real::Real;

/// Samples that share one stream of random numbers.
const PIECE: usize = 1024;

/// The purposes of random numbers: each has streams of its own.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Surface,
    Order,
    Band,
    Extension,
}

/// Random numbers of a step, for a purpose and a piece of it.
pub(crate) fn random(seed: u64, step: usize, purpose: Purpose, piece: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((step as u64) << 32 | (piece as u64) << 2 | purpose as u64);
    rng
}

/// The points in the order of their cells.
pub(crate) fn by_cell<R: Real>(mut points: Vec<[R; 3]>, grid: &Grid<R>) -> Vec<[R; 3]> {
    points.sort_by_cached_key(|&point| grid.locate(point).first);
    points
}

/// `amount` of `length` indices in random order, each as often as any other or once more.
fn spread_indices(rng: &mut ChaCha8Rng, length: usize, amount: usize) -> Vec<usize> {
    let mut out = Vec::with_capacity(amount);
    while out.len() < amount {
        let more = (amount - out.len()).min(length);
        out.extend(index::sample(rng, length, more));
    }
    out
}

/// The band of a step; the clouds in the order of [`by_cell`]. Samples are not finite where the field carries them to infinity.
pub(crate) fn samples<R: Real, const H: usize>(
    field: &SplineField<R, H>,
    clouds: &[Arc<Vec<[R; 3]>>; 2],
    options: &Options,
    [amount, trajectory_steps]: [usize; 2],
    step: usize,
) -> Vec<Sample<R>> {
    let half = amount.div_ceil(2);
    let (mut starts, mut from, mut to) = (Vec::new(), Vec::new(), Vec::new());
    for (end, cloud) in clouds.iter().enumerate() {
        let mut rng = random(options.seed, step, Purpose::Order, end);
        let mut drawn: Vec<(u32, R)> = spread_indices(&mut rng, cloud.len(), half)
            .into_iter()
            .enumerate()
            // Even in time: the order of the points is random.
            .map(|(at, index)| {
                let time = (at as f64 + rng.random::<f64>()) / half as f64;
                (index as u32, R::of(time))
            })
            .collect();
        // The cloud is in the order of cells: neighbours are carried one after the other.
        drawn.sort_by_key(|&(index, _)| index);
        for (index, time) in drawn {
            starts.push(cloud[index as usize]);
            from.push(R::of(end as f64));
            to.push(time);
        }
    }
    // Half as exact as the ends of trajectories: where a sample lies exactly matters little.
    let steps = trajectory_steps.div_ceil(2);
    let mut points = field.carry_each(&starts, &from, &to, steps);
    points
        .par_chunks_mut(PIECE)
        .enumerate()
        .for_each(|(piece, points)| {
            let mut rng = random(options.seed, step, Purpose::Band, piece);
            for point in points {
                let widths = &options.band_spread;
                let deviation = widths[rng.random_range(0..widths.len())];
                for x in point {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    *x += R::of(deviation * normal);
                }
            }
        });
    let mut out = gathered(field, &points, &to, options);
    extend(field, &mut out, options, step);
    out
}

/// The means of the points in each cube and interval of time.
fn gathered<R: Real, const H: usize>(
    field: &SplineField<R, H>,
    points: &[[R; 3]],
    times: &[R],
    options: &Options,
) -> Vec<Sample<R>> {
    let grid = field.grid();
    // Points beyond the box are gathered with those at its border.
    let inverse = 1.0 / (options.voxel * grid.spacing.wide());
    let voxels = grid
        .cells
        .map(|n| (f64::from(n) / options.voxel).ceil().max(1.0) as usize);
    let bins = options.time_bins;
    let mut slots = vec![u32::MAX; voxels.iter().product::<usize>() * bins];
    let mut sums: Vec<([f64; 4], f64)> = Vec::new();
    for (point, &time) in points.iter().zip(times) {
        let mut slot = 0;
        for i in 0..3 {
            let at = (point[i] - grid.lower[i]).wide() * inverse;
            slot = slot * voxels[i] + (at as usize).min(voxels[i] - 1);
        }
        slot = slot * bins + ((time.wide() * bins as f64) as usize).min(bins - 1);
        if slots[slot] == u32::MAX {
            slots[slot] = sums.len() as u32;
            sums.push(([0.0; 4], 0.0));
        }
        let (sum, count) = &mut sums[slots[slot] as usize];
        for (sum, x) in sum
            .iter_mut()
            .zip([point[0], point[1], point[2], time].map(R::wide))
        {
            *sum += x;
        }
        *count += 1.0;
    }
    let mean = |&(sum, count): &([f64; 4], f64)| {
        let [x, y, z, t] = sum.map(|sum| R::of(sum / count));
        Sample {
            point: [x, y, z],
            time: t,
            share: count / points.len() as f64,
            inside: true,
        }
    };
    sums.iter().map(mean).collect()
}

/// Appends a point in each cell of the band and around it.
fn extend<R: Real, const H: usize>(
    field: &SplineField<R, H>,
    samples: &mut Vec<Sample<R>>,
    options: &Options,
    step: usize,
) {
    let grid = field.grid();
    let [nx, ny, nz] = grid.cells.map(|n| n as usize);
    let mut near = vec![false; nx * ny * nz];
    for sample in samples.iter() {
        let mut at = [0; 3];
        for i in 0..3 {
            let s = (sample.point[i] - grid.lower[i]).wide() / grid.spacing.wide();
            at[i] = (s as usize).min(grid.cells[i] as usize - 1);
        }
        let around = |at: usize, n: usize| at.saturating_sub(1)..(at + 2).min(n);
        for x in around(at[0], nx) {
            for y in around(at[1], ny) {
                let row = (x * ny + y) * nz;
                for z in around(at[2], nz) {
                    near[row + z] = true;
                }
            }
        }
    }
    let count = near.iter().filter(|&&near| near).count();
    let mut rng = random(options.seed, step, Purpose::Extension, 0);
    let cells = near.iter().enumerate().filter(|(_, near)| **near);
    for (cell, _) in cells {
        let at = [cell / (ny * nz), cell / nz % ny, cell % nz];
        let mut point = grid.lower;
        for i in 0..3 {
            point[i] += R::of((at[i] as f64 + rng.random::<f64>()) * grid.spacing.wide());
        }
        samples.push(Sample {
            point,
            time: R::of(rng.random()),
            share: options.extension / count as f64,
            inside: false,
        });
    }
}
