//! Groups of points, and pieces of meshes, that lie far from all others.

use super::{AROUND, FAR_OF_MOST, NEIGHBOUR, Step, count, distance};
use crate::formats::Shape;
use crate::geometry::{NeighbourSearch, parts_apart};

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
    let boxes: Vec<Extent> = pieces
        .iter()
        .map(|piece| {
            let mut extent = Extent::NONE;
            for &triangle in &piece.triangles {
                for vertex in shape.mesh.triangles[triangle] {
                    extent.include(shape.mesh.vertices[vertex as usize]);
                }
            }
            extent
        })
        .collect();
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

/// A box with its sides along the axes.
#[derive(Clone, Copy)]
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    const NONE: Self = Self {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
    };

    fn include(&mut self, point: [f64; 3]) {
        self.low = [0, 1, 2].map(|axis| self.low[axis].min(point[axis]));
        self.high = [0, 1, 2].map(|axis| self.high[axis].max(point[axis]));
    }

    fn diagonal(&self) -> f64 {
        let sides = [0, 1, 2].map(|axis| self.high[axis] - self.low[axis]);
        sides.iter().map(|side| side * side).sum::<f64>().sqrt()
    }

    /// How far the boxes are apart; 0 where they meet.
    fn gap(&self, other: &Self) -> f64 {
        let along = |axis: usize| {
            let (below, above) = (
                other.low[axis] - self.high[axis],
                self.low[axis] - other.high[axis],
            );
            below.max(above).max(0.0)
        };
        let gaps = [0, 1, 2].map(along);
        gaps.iter().map(|gap| gap * gap).sum::<f64>().sqrt()
    }
}
