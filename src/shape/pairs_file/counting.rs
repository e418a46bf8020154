//! Whether vertices count from 0 or from 1, where their numbers alone do not say.

use std::num::NonZeroUsize;

use crate::formats::Shape;
use crate::geometry::NeighbourSearch;
use crate::geometry::linear::{difference, length};

/// Fewer pairs say nothing.
const FEWEST: usize = 16;

/// The most pairs at which distances are compared.
const MOST: usize = 1000;

/// Neighbours of each, itself among them.
const NEAR: NonZeroUsize = NonZeroUsize::new(6).expect("6 is not 0");

/// One way of counting is taken to be right if its distortion is below this share of the other's, and
const BETTER: f64 = 0.5;

/// the other's is above this: a twentieth.
const DISTORTED: f64 = 0.05;

/// Whether pairs keep the distances of near places far better if their vertices count from 1 than from 0. Where the order of
/// vertices is the same in both files, or means nothing, one is as good as the other.
pub(super) fn is_from_one(pairs: &[[u64; 2]], shapes: [&Shape; 2]) -> bool {
    let [zero, one] = [0, 1].map(|first| distortion(pairs, shapes, first));
    let (Some(zero), Some(one)) = (zero, one) else {
        return false;
    };
    zero > DISTORTED && one < BETTER * zero
}

/// By how much distances of near places change, in the median of their logarithms.
fn distortion(pairs: &[[u64; 2]], shapes: [&Shape; 2], first: u64) -> Option<f64> {
    let place = |k: usize, number: u64| {
        let number = u32::try_from(number.checked_sub(first)?).ok()?;
        let vertex = shapes[k].vertex_of_number(number)?;
        shapes[k].mesh.vertices.get(vertex as usize).copied()
    };
    let both = pairs
        .iter()
        .filter_map(|[from, to]| Some((place(0, *from)?, place(1, *to)?)));
    let (sources, targets): (Vec<[f64; 3]>, Vec<[f64; 3]>) = both.unzip();
    if sources.len() < FEWEST {
        return None;
    }
    let search = NeighbourSearch::new(&sources);
    let apart = |of: &[[f64; 3]], a: usize, b: usize| length(difference(of[a], of[b]));
    let mut changes = Vec::new();
    for k in (0..sources.len()).step_by(sources.len().div_ceil(MOST)) {
        for near in search.nearest(sources[k], NEAR) {
            let other = near.index as usize;
            let (before, after) = (apart(&sources, k, other), apart(&targets, k, other));
            if before > 0.0 && after > 0.0 {
                changes.push((after / before).ln().abs());
            }
        }
    }
    if changes.is_empty() {
        return None;
    }
    let middle = changes.len() / 2;
    Some(*changes.select_nth_unstable_by(middle, f64::total_cmp).1)
}
