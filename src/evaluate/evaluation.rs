//! What an evaluation says: the numbers of every frame and their means, as `evaluate --json` prints
//! them.
//!
//! Lengths are in normalised units: both end shapes together have their bounding box centred on the
//! origin and a mean surface area of 1. *Squared* and unsquared distances never share a name.

use serde::{Deserialize, Serialize};

/// How far one surface is from the true one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// The time at which the surface was taken, 0 to 1: the frame's own, or the aligned one.
    pub time: f64,
    /// Mean over both directions of the mean distance to the nearest sample.
    pub chamfer: f64,
    /// Sum over both directions of the mean squared distance: the paper's CD.
    pub chamfer_squared: f64,
    /// Largest distance in either direction.
    pub hausdorff: f64,
    /// Its square: the paper's HD as inferred.
    pub hausdorff_squared: f64,
    /// The larger of the two directions' 95th percentiles of the distance.
    pub hausdorff95: f64,
    /// Mean over both directions of `|<n, n'>|` between a sample's normal and that of its nearest
    /// one.
    pub normal_consistency: f64,
    /// Enclosed volume over the true one.
    pub volume_ratio: f64,
    /// Area over the true one.
    pub area_ratio: f64,
    /// Connected pieces.
    pub components: f64,
    /// Share of the area that is not on the largest piece.
    pub outside_largest: f64,
    /// Mean of `||grad f| - 1|` near the true surface, of methods that have an `f`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slope_error: Option<f64>,
    /// Root mean square distance of carried vertices from the true ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracked_rmse: Option<f64>,
}

/// The metrics at a frame's own time, with those at the best time beside them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// At the frame's own time.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// At the best of 129 evenly spaced times, in the order of the frames: an animation's speed
    /// profile cannot be known from its ends. Between key frames at the frame's own time.
    pub aligned: Metrics,
}

/// One true frame and what was compared with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameResult {
    /// Its number in the sequence; none in the mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
    /// `(frame - from) / (to - from)`; none in the mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// The zero set of `f`, where the method has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<Compared>,
    /// The source's own mesh, carried along; where the method carries one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carried: Option<Compared>,
    /// Straight lines between all true corresponding vertices of the two ends.
    pub linear: Compared,
    /// The natural cubic spline through all true vertices of the key frames, where a run has more than two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub natural: Option<Compared>,
    /// Two independent samplings of the true surface: no method can be below it.
    pub floor: Metrics,
}

/// Everything that `evaluate` measures of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// The frames strictly between the ends, in order.
    pub frames: Vec<FrameResult>,
    /// Their means, entry by entry.
    pub mean: FrameResult,
    /// The two ends, which the run has seen: how well it fits them, and how far from the true ones its
    /// vertices arrive. At times 0 and 1, so that `aligned` is the same. Empty in what earlier versions
    /// wrote.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<FrameResult>,
}

/// Everything that `evaluate --keys` measures of a run through many key frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeysEvaluation {
    /// The frames that are the key frames.
    pub keys: Vec<usize>,
    /// From each key frame to the next: the frames between, carried vertices starting at the earlier key frame.
    pub segments: Vec<Evaluation>,
    /// The mean over all frames between, entry by entry.
    pub mean: FrameResult,
    /// Vertices carried from the first key frame through all of the others; where the method carries any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drift: Option<Drift>,
}

/// How far vertices are from the true ones that are carried from the first key frame: root mean squares over
/// vertices.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// The mean over all frames between key frames.
    pub mean: f64,
    /// At the last key frame.
    pub last: f64,
    /// Where they started, once they are carried back from there.
    pub there_and_back: f64,
}
