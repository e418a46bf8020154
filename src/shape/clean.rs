//! Raw scans cleaned: points that are no part of a surface are left out, and it is said.
//!
//! In this order, each on what the one before left:
//!
//! | step | what is left out | why |
//! |---|---|---|
//! | heaps | all points at a place that holds many | depth cameras write (0, 0, 0) where they measured nothing |
//! | repeats | points at, or almost at, the place of another | the neighbours of a point must span its tangent plane |
//! | strays | points much farther from their neighbours than these are from theirs | flying pixels, dust |
//! | strays near by | points somewhat farther, that stand off the plane of their neighbours | the same near the surface |
//! | parts | small groups of points far from all others | the table beneath, the turntable's mark |
//!
//! Of a mesh, small pieces far from all others are left out. Vertices keep their numbers in the file, so that pairs
//! by number stay right.

mod parts;

use std::num::NonZeroUsize;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::normals::tangent_plane;
use crate::formats::{FEWEST_POINTS, Shape};
use crate::geometry::linear::{difference, dot, mean};
use crate::geometry::{Neighbour, NeighbourSearch, weld};

/// What counts as no part of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CleanOptions {
    /// A point is a stray where its neighbours are so many times as far as theirs are; more than 1.
    pub strays: f64,
    /// A part far from all others is left out if it has less than this share of the points, 0 to 1.
    pub part: f64,
}

impl Default for CleanOptions {
    fn default() -> Self {
        Self {
            strays: 5.0,
            part: 0.005,
        }
    }
}

/// The neighbour whose distance is that of a point from its neighbours.
const NEIGHBOUR: usize = 6;

/// As many neighbours as the usual distance is the median of.
const AROUND: usize = 2 * NEIGHBOUR;

/// Points at one place from which on it is a heap, however often other places occur.
const HEAP: usize = 16;

/// A heap holds so many times as many points as most places do: each corner of a soup of triangles occurs six times.
const HEAP_OVER_USUAL: usize = 10;

/// Points nearer to another than this share of the spacing repeat it: rounding, or an error of the writer.
const REPEAT: f64 = 1e-3;

/// The same where many points are as near to another, as in scans that were merged.
const MERGED: f64 = 0.02;

/// Which share of the points that is. Of points at random 0.3 % are.
const MANY: f64 = 0.05;

/// Beyond this many times the usual distance of all points a point is a stray, whatever its neighbours are: strays
/// have strays as neighbours.
const FAR: f64 = 8.0;

/// And beyond so many times the distance that 19 of 20 points have, which is large where the density varies.
const FAR_OF_MOST: f64 = 3.0;

/// A stray near by is farther than usual by this share of what a stray is.
const NEAR_BY: f64 = 0.2;

/// It stands off the plane by more than its neighbours' usual distance and by so many of their standard deviations.
const OFF: f64 = 4.0;

impl Shape {
    /// The shape without what is no part of its surface: of a cloud points in one place, repeated points, stray points
    /// and small parts far from the rest; of a mesh small pieces far from the rest. A note says what was left out.
    ///
    /// Nothing is left out of a cloud that would be too few points without. Points that are left keep their numbers in
    /// pairs of vertices.
    #[must_use]
    pub fn cleaned(self, options: &CleanOptions) -> Self {
        if self.is_mesh() {
            return parts::without_far_pieces(self, options.part);
        }
        clean_cloud(self, options)
    }
}

fn clean_cloud(shape: Shape, options: &CleanOptions) -> Shape {
    let mut left_out = Vec::new();
    let mut now = shape.clone();
    let steps: [&Criterion<'_>; 5] = [
        &heaps,
        &repeats,
        &|points| strays(points, options.strays),
        &|points| strays_near_by(points, options.strays),
        &|points| parts::small(points, options.part),
    ];
    for step in steps {
        if now.mesh.vertices.len() <= AROUND {
            return shape;
        }
        let Step { keep, what } = step(&now.mesh.vertices);
        let lost = keep.iter().filter(|keep| !**keep).count();
        if lost > 0 {
            left_out.push(format!("{lost} {what}"));
            now = now.keeping(&keep);
        }
    }
    if left_out.is_empty() || now.mesh.vertices.len() < FEWEST_POINTS {
        return shape;
    }
    let (name, count) = (now.path.display(), shape.mesh.vertices.len());
    let note = format!(
        "{name}: left out of {count} points: {}; data.clean = \"none\" keeps them",
        left_out.join(", ")
    );
    now.notes.push(note);
    now
}

/// What finds points that are no part of the surface.
type Criterion<'a> = dyn Fn(&[[f64; 3]]) -> Step + 'a;

/// What a step leaves out.
struct Step {
    keep: Vec<bool>,
    /// The points that go, in words.
    what: String,
}

/// Places that hold many points.
fn heaps(points: &[[f64; 3]]) -> Step {
    let first = weld(points);
    let mut counts: FxHashMap<u32, usize> = FxHashMap::default();
    first
        .iter()
        .for_each(|place| *counts.entry(*place).or_default() += 1);
    let mut sorted: Vec<usize> = counts.values().copied().collect();
    sorted.sort_unstable();
    let least = HEAP.max(HEAP_OVER_USUAL * sorted[sorted.len() / 2]);
    let is_heap = |place: &u32| counts[place] >= least;
    let heaps = sorted.iter().filter(|count| **count >= least).count();
    let largest = first
        .iter()
        .max_by_key(|place| (counts[*place], std::cmp::Reverse(**place)));
    let what = match (heaps, largest) {
        (1, Some(&place)) => {
            let [x, y, z] = points[place as usize];
            format!("at the one place ({x}, {y}, {z})")
        }
        _ => format!("at {heaps} places that hold many points each"),
    };
    Step {
        keep: first.iter().map(|place| !is_heap(place)).collect(),
        what,
    }
}

/// Points at, or almost at, the place of another that comes before them.
fn repeats(points: &[[f64; 3]]) -> Step {
    let first = weld(points);
    let mut keep: Vec<bool> = (0..)
        .zip(&first)
        .map(|(k, place): (u32, _)| k == *place)
        .collect();
    let places: Vec<usize> = (0..points.len()).filter(|k| keep[*k]).collect();
    let what = "that repeat the place of another".to_owned();
    if places.len() <= AROUND {
        return Step { keep, what };
    }
    let distinct: Vec<[f64; 3]> = places.iter().map(|&k| points[k]).collect();
    let search = NeighbourSearch::new(&distinct);
    let found = search.nearest_of_each(&distinct, count(NEIGHBOUR));
    let mut spacing: Vec<f64> = found.iter().map(|near| distance(near, NEIGHBOUR)).collect();
    let spacing = median(&mut spacing);
    let nearer = |share: f64| {
        found
            .iter()
            .filter(|near| distance(near, 1) < share * spacing)
            .count()
    };
    let are_many = nearer(MERGED) as f64 > MANY * distinct.len() as f64;
    let radius = spacing * if are_many { MERGED } else { REPEAT };
    // In the order of the file: the first of those that are near each other stays.
    for (k, near) in found.iter().enumerate() {
        if distance(near, 1) >= radius {
            continue;
        }
        let before = near.iter().filter(|other| (other.index as usize) < k);
        let mut near = before.filter(|other| other.squared_distance.sqrt() < radius);
        keep[places[k]] = !near.any(|other| keep[places[other.index as usize]]);
    }
    Step { keep, what }
}

/// Points much farther from their neighbours than these are from theirs, and than all others are.
fn strays(points: &[[f64; 3]], times: f64) -> Step {
    let found = NeighbourSearch::new(points).nearest_of_each(points, count(AROUND));
    let all: Vec<f64> = found.iter().map(|near| distance(near, NEIGHBOUR)).collect();
    let mut sorted = all.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    let far = (FAR * at(0.5)).max(FAR_OF_MOST * at(0.95));
    let is_usual = |(near, own): (&Vec<Neighbour>, &f64)| {
        let theirs = near[1..].iter().map(|other| all[other.index as usize]);
        let mut theirs: Vec<f64> = theirs.collect();
        *own <= far && *own <= times * median(&mut theirs)
    };
    Step {
        keep: found.par_iter().zip(&all).map(is_usual).collect(),
        what: "astray, far from their neighbours".to_owned(),
    }
}

/// Points somewhat farther from their neighbours than these are from theirs, which stand off the plane of these: strays
/// so near the surface that it is among their neighbours.
fn strays_near_by(points: &[[f64; 3]], times: f64) -> Step {
    let found = NeighbourSearch::new(points).nearest_of_each(points, count(AROUND));
    let all: Vec<f64> = found.iter().map(|near| distance(near, NEIGHBOUR)).collect();
    let times = 1.0 + NEAR_BY * (times - 1.0);
    let is_usual = |(k, near): (usize, &Vec<Neighbour>)| {
        let others = &near[1..];
        let theirs = others.iter().map(|other| all[other.index as usize]);
        let usual = median(&mut theirs.collect::<Vec<f64>>());
        if all[k] <= times * usual {
            return true;
        }
        let (normal, variance) = tangent_plane(points, others);
        let mean = mean(others.iter().map(|other| points[other.index as usize]));
        let height = dot(difference(points[k], mean), normal).abs();
        height <= usual || height * height <= OFF * OFF * variance
    };
    Step {
        keep: found.par_iter().enumerate().map(is_usual).collect(),
        what: "astray near the surface".to_owned(),
    }
}

/// How many neighbours to ask for: a point is its own first.
fn count(neighbours: usize) -> NonZeroUsize {
    NonZeroUsize::MIN.saturating_add(neighbours)
}

/// The distance of a neighbour, the point itself being number 0.
fn distance(near: &[Neighbour], number: usize) -> f64 {
    near[number.min(near.len() - 1)].squared_distance.sqrt()
}

/// The middle one of some values.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests;
