//! From two motions, there and back, to pairs of vertices, each with a confidence.
//!
//! With `F` the motion that lays the source onto the target and `G` the one that lays the target
//! onto the source, a source vertex `x` and a target vertex `y` belong together as far as `F(x) =
//! y` and `x = G(y)`. Both at once are one distance in six dimensions, between `(x, F(x))` and
//! `(G(y), y)`:
//!
//! ```text
//! r^2 = (|F(x) - y|^2 + |x - G(y)|^2) / 2
//! ```
//!
//! A pair is taken if each is the other's nearest by this distance, with the confidence `exp(-r^2 /
//! (2 tau^2)) cos`, where `cos` is the lesser of the two cosines between a carried normal and the
//! normal there, at least 0.

use rayon::prelude::*;
use serde::Serialize;

use super::level::NodeMotion;
use super::surface::Surface;
use crate::geometry::linear::{difference, dot, length};
use crate::shape::{NeighbourSearch, Normalisation, Shape};

/// The distance at which a pair is no longer sure, in normalised units, about the spacing of 2,500
/// points: `tau` in the confidence `exp(-r^2 / (2 tau^2)) cos`.
pub(super) const TOLERANCE: f64 = 0.02;

/// One pair of vertices.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MatchedPair {
    /// Vertex of the source, counted from 0 in the order of the shape, which is that of its file.
    pub source: u32,
    /// Vertex of the target.
    pub target: u32,
    /// How sure the pair is, 0 to 1.
    pub confidence: f64,
}

/// The vertices of a shape that lie on its surface, normalised.
pub(super) struct Sites {
    /// Which vertices.
    pub vertices: Vec<u32>,
    /// Where they are.
    pub places: Vec<[f64; 3]>,
    /// For each the nearest point of the surface.
    anchors: Vec<u32>,
}

impl Sites {
    /// The vertices of a cloud, and those of a mesh that belong to a triangle.
    pub(super) fn of(shape: &Shape, surface: &Surface, normalisation: &Normalisation) -> Self {
        let mut used = vec![!shape.is_mesh(); shape.mesh.vertices.len()];
        for &vertex in shape.mesh.triangles.as_flattened() {
            used[vertex as usize] = true;
        }
        let vertices: Vec<u32> = (0..)
            .zip(&used)
            .filter(|(_, used)| **used)
            .map(|(k, _)| k)
            .collect();
        let place = |&vertex: &u32| {
            normalisation
                .apply(shape.mesh.vertices[vertex as usize])
                .map(f64::from)
        };
        let places: Vec<[f64; 3]> = vertices.iter().map(place).collect();
        let anchors = surface.search.nearest_one_of_each(&places);
        Self {
            vertices,
            anchors: anchors.into_iter().map(|near| near.index).collect(),
            places,
        }
    }

    /// Places and normals of the sites after a motion of their surface.
    fn carried(&self, surface: &Surface, motion: &NodeMotion) -> Vec<([f64; 3], [f64; 3])> {
        let site = |(&place, &anchor): (&[f64; 3], &u32)| {
            surface
                .finest()
                .carry(motion, anchor, (place, surface.normals[anchor as usize]))
        };
        self.places
            .par_iter()
            .zip(&self.anchors)
            .map(site)
            .collect()
    }
}

/// A surface and the motion that lays it onto the other.
#[derive(Clone, Copy)]
pub(super) struct Laid<'a> {
    pub surface: &'a Surface,
    pub motion: &'a NodeMotion,
}

/// The pairs whose vertices are each other's nearest, by vertex of the source.
pub(super) fn mutual(source: (Laid<'_>, &Sites), target: (Laid<'_>, &Sites)) -> Vec<MatchedPair> {
    let there = source.1.carried(source.0.surface, source.0.motion);
    let back = target.1.carried(target.0.surface, target.0.motion);
    let ours: Vec<[f64; 6]> = source
        .1
        .places
        .iter()
        .zip(&there)
        .map(|(x, moved)| joined(*x, moved.0))
        .collect();
    let theirs: Vec<[f64; 6]> = target
        .1
        .places
        .iter()
        .zip(&back)
        .map(|(y, moved)| joined(moved.0, *y))
        .collect();
    let nearest =
        |from: &[[f64; 6]], to: &[[f64; 6]]| NeighbourSearch::new(to).nearest_one_of_each(from);
    let (forth, counter) = (nearest(&ours, &theirs), nearest(&theirs, &ours));
    let normal =
        |side: &(Laid<'_>, &Sites), k: usize| side.0.surface.normals[side.1.anchors[k] as usize];
    let pair = |(i, found): (usize, &crate::geometry::Neighbour)| {
        let j = found.index as usize;
        if counter[j].index as usize != i {
            return None;
        }
        let cosines = [
            dot(there[i].1, normal(&target, j)),
            dot(back[j].1, normal(&source, i)),
        ];
        let cosine = cosines[0].min(cosines[1]).clamp(0.0, 1.0);
        let square = found.squared_distance / 2.0;
        Some(MatchedPair {
            source: source.1.vertices[i],
            target: target.1.vertices[j],
            confidence: (-square / (2.0 * TOLERANCE * TOLERANCE)).exp() * cosine,
        })
    };
    forth.iter().enumerate().filter_map(pair).collect()
}

fn joined(a: [f64; 3], b: [f64; 3]) -> [f64; 6] {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

/// How far from itself each point of a surface comes back that is laid onto the other and, from the
/// place where it arrives, back again; sorted.
pub(super) fn there_and_back(this: Laid<'_>, other: Laid<'_>) -> Vec<f64> {
    let points = 0..this.surface.points.len() as u32;
    let mut distances: Vec<f64> = points
        .into_par_iter()
        .map(|point| round_trip(this, other, point))
        .collect();
    distances.sort_by(f64::total_cmp);
    distances
}

/// The mean over the nodes of both surfaces of how far each comes back from itself.
pub(super) fn disagreement(this: Laid<'_>, other: Laid<'_>) -> f64 {
    let ways = [(this, other), (other, this)].map(|(this, other)| {
        let nodes = &this.surface.finest().nodes;
        let distances = nodes.iter().map(|&node| round_trip(this, other, node));
        distances.sum::<f64>() / nodes.len() as f64
    });
    (ways[0] + ways[1]) / 2.0
}

fn round_trip(this: Laid<'_>, other: Laid<'_>, point: u32) -> f64 {
    let (start, normal) = (
        this.surface.points[point as usize],
        this.surface.normals[point as usize],
    );
    let (place, normal) = this
        .surface
        .finest()
        .carry(this.motion, point, (start, normal));
    let anchor = other.surface.nearest_facing(place, normal);
    let (end, _) = other
        .surface
        .finest()
        .carry(other.motion, anchor, (place, normal));
    length(difference(end, start))
}

/// The share of a surface's points that have one of `places` within `radius`.
pub(super) fn coverage(surface: &Surface, places: &[[f64; 3]], radius: f64) -> f64 {
    if places.is_empty() {
        return 0.0;
    }
    let nearest = NeighbourSearch::new(places).nearest_one_of_each(&surface.points);
    let near = nearest
        .iter()
        .filter(|near| near.squared_distance <= radius * radius);
    near.count() as f64 / surface.points.len() as f64
}
