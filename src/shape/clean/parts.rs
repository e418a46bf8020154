//! Groups of points, and pieces of meshes, that lie far from all others.

use super::{AROUND, FAR_OF_MOST, NEIGHBOUR, Step, count, distance};
use crate::formats::Shape;
use crate::geometry::{Component, Extent, NeighbourSearch, parts_apart};

/// Parts are apart where no two of their points are nearer than so many times the usual distance of neighbours.
const APART: f64 = 10.0;

/// A part of up to this share of the points is left out where it lies farther away than the largest part is large.
const FAR_SHARE: f64 = 0.05;

/// How far that is, as a share of the diagonal of the largest part's box.
const FAR_AWAY: f64 = 0.5;

/// Small parts, and larger ones far away.
pub(super) fn small(points: &[[f64; 3]], share: f64) -> Step {
    let found = NeighbourSearch::new(points).nearest_of_each(points, count(AROUND));
    let mut usual: Vec<f64> = found.iter().map(|near| distance(near, NEIGHBOUR)).collect();
    usual.sort_by(f64::total_cmp);
    let at = |share: f64| usual[((usual.len() - 1) as f64 * share) as usize];
    let apart = (APART * at(0.5)).max(FAR_OF_MOST * at(0.99));
    let part_of = parts_apart(points, apart);
    let count = part_of.iter().max().map_or(0, |last| last + 1);
    let mut boxes = vec![Extent::NONE; count];
    let mut sizes = vec![0_usize; count];
    for (&part, &point) in part_of.iter().zip(points) {
        boxes[part].include(point);
        sizes[part] += 1;
    }
    let largest = (0..count).max_by_key(|part| (sizes[*part], std::cmp::Reverse(*part)));
    let largest = largest.map_or(Extent::NONE, |part| boxes[part]);
    let is_kept = |part: usize| {
        let own = sizes[part] as f64 / points.len() as f64;
        let is_far = boxes[part].gap(&largest) > FAR_AWAY * largest.diagonal();
        own >= share && !(own < FAR_SHARE && is_far)
    };
    let kept: Vec<bool> = (0..count).map(is_kept).collect();
    Step {
        keep: part_of.iter().map(|part| kept[*part]).collect(),
        what: "in small parts far from all others".to_owned(),
    }
}

/// A mesh without its small pieces that lie far away from the rest.
pub(super) fn without_far_pieces(mut shape: Shape, share: f64) -> Shape {
    let pieces = shape.mesh.components_by_place();
    if pieces.len() < 2 {
        return shape;
    }
    let extent = |piece: &Component| {
        let corners = piece
            .triangles
            .iter()
            .flat_map(|t| shape.mesh.triangles[*t]);
        Extent::of(corners.map(|vertex| shape.mesh.vertices[vertex as usize]))
    };
    let boxes: Vec<Extent> = pieces.iter().map(extent).collect();
    let area: f64 = pieces.iter().map(|piece| piece.area).sum();
    // The largest comes first.
    let far = |k: &usize| {
        let is_far = boxes[*k].gap(&boxes[0]) > FAR_AWAY * boxes[0].diagonal();
        is_far && pieces[*k].area < share * area
    };
    let far: Vec<usize> = (1..pieces.len()).filter(far).collect();
    if far.is_empty() {
        return shape;
    }
    let mut keep = vec![true; shape.mesh.triangles.len()];
    let gone = far.iter().flat_map(|k| &pieces[*k].triangles);
    gone.for_each(|triangle| keep[*triangle] = false);
    let mut keep = keep.into_iter();
    shape.mesh.triangles.retain(|_| keep.next().unwrap_or(true));
    let (name, count) = (shape.path.display(), far.len());
    shape.notes.push(format!(
        "{name}: left out: {count} small pieces far from the rest; data.clean = \"none\" keeps them"
    ));
    shape
}
