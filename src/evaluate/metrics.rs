//! Two sampled surfaces compared: Chamfer and Hausdorff distances, normals, volume, area, pieces.
//!
//! With `d(p, B)` the distance of a sample p of A from the nearest sample of B:
//!
//! ```text
//! chamfer         = (mean_A d(p, B) + mean_B d(q, A)) / 2
//! chamfer_squared =  mean_A d(p, B)^2 + mean_B d(q, A)^2
//! hausdorff       = max(max_A d(p, B), max_B d(q, A))
//! ```
//!
//! Samples never meet: on the same surface with density rho the expected distance is `1 / (2 sqrt
//! rho)` and the expected squared distance `1 / (pi rho)`, which is what the `floor` shows.

use super::Metrics;
use super::sampled::SampledSurface;

/// What is said of the distances from the samples of one surface to those of another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OneWay {
    mean: f64,
    mean_squared: f64,
    largest: f64,
    /// The distance that 95 % of the samples do not exceed.
    percentile95: f64,
    /// Mean of `|<n, n'>|`.
    normal_consistency: f64,
}

impl OneWay {
    fn between(from: &SampledSurface, to: &SampledSurface) -> Self {
        let nearest = to.search.nearest_one_of_each(&from.points);
        let count = nearest.len() as f64;
        let mut squared: Vec<f64> = nearest.iter().map(|found| found.squared_distance).collect();
        let normals = from.normals.iter().zip(&nearest);
        let agreement = normals.map(|(&normal, found)| {
            let other = to.normals[found.index as usize];
            let dot = (0..3).map(|axis| f64::from(normal[axis]) * f64::from(other[axis]));
            dot.sum::<f64>().abs()
        });
        Self {
            mean: squared.iter().map(|square| square.sqrt()).sum::<f64>() / count,
            mean_squared: squared.iter().sum::<f64>() / count,
            largest: squared.iter().copied().fold(0.0, f64::max).sqrt(),
            normal_consistency: agreement.sum::<f64>() / count,
            percentile95: {
                // The nearest rank: the least value that at least 95 % do not exceed.
                let rank = (squared.len() * 95).div_ceil(100) - 1;
                squared
                    .select_nth_unstable_by(rank, f64::total_cmp)
                    .1
                    .sqrt()
            },
        }
    }
}

/// A surface, taken at `time`, against the true one.
pub(super) fn compare(surface: &SampledSurface, truth: &SampledSurface, time: f64) -> Metrics {
    let there = OneWay::between(surface, truth);
    let back = OneWay::between(truth, surface);
    let hausdorff = there.largest.max(back.largest);
    // A flat sheet encloses nothing, and a ratio to it says nothing.
    let volume_ratio = match truth.volume {
        0.0 => 0.0,
        volume => surface.volume / volume,
    };
    Metrics {
        time,
        chamfer: (there.mean + back.mean) / 2.0,
        chamfer_squared: there.mean_squared + back.mean_squared,
        hausdorff,
        hausdorff_squared: hausdorff * hausdorff,
        hausdorff95: there.percentile95.max(back.percentile95),
        normal_consistency: (there.normal_consistency + back.normal_consistency) / 2.0,
        volume_ratio,
        area_ratio: surface.area / truth.area,
        components: surface.pieces.count as f64,
        outside_largest: surface.pieces.outside_largest,
        slope_error: None,
        tracked_rmse: None,
    }
}

/// Mean squared distance between vertices that are the same ones.
///
/// # Panics
/// If the numbers of vertices differ or are zero.
pub(crate) fn mean_squared_error(found: &[[f32; 3]], truth: &[[f32; 3]]) -> f64 {
    assert_eq!(found.len(), truth.len(), "vertices found and true ones");
    assert!(!truth.is_empty(), "the error of no vertices");
    let squared = found.iter().zip(truth).map(|(a, b)| {
        let axes = (0..3).map(|axis| f64::from(a[axis]) - f64::from(b[axis]));
        axes.map(|difference| difference * difference).sum::<f64>()
    });
    squared.sum::<f64>() / truth.len() as f64
}

#[cfg(test)]
mod tests;
