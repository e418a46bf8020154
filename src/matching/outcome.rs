//! What is known of two shapes after matching.

use std::path::Path;

use serde::Serialize;

use super::pairs::MatchedPair;
use super::rigid::Alignment;
use crate::formats::Kept;
use crate::geometry::linear::times;
use crate::shape::{Correspondences, Normalisation};

/// What is known of two shapes after matching.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Matching {
    /// The pairs kept, by vertex of the source.
    #[serde(skip)]
    pub pairs: Vec<MatchedPair>,
    /// How many mutual nearest neighbours there were, sure or not.
    pub mutual: usize,
    /// How many pairs were given, which are among those kept.
    pub given: usize,
    /// The share of each surface that has a matched vertex near it.
    pub coverage: Coverage,
    /// How far points come back from where they began.
    pub cycle: Cycle,
    /// The rigid motion from the source to the target that registration began with, in the user's
    /// coordinates.
    pub rigid: Rigid,
    /// Normalised length per unit of the user's length.
    pub scale: f64,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Which vertices of its file each shape has.
    #[serde(skip)]
    pub(super) kept: [Option<Kept>; 2],
}

/// The share of each surface within `radius` of a matched vertex.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coverage {
    /// Distance, in normalised units.
    pub radius: f64,
    /// Share of the source, 0 to 1.
    pub source: f64,
    /// Share of the target, 0 to 1.
    pub target: f64,
}

/// Cycle consistency: how far from itself a point comes back that is carried by both registrations,
/// in normalised units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cycle {
    /// From the source to the target and back.
    pub source: Quantiles,
    /// From the target to the source and back.
    pub target: Quantiles,
}

/// A distribution in short and in full.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quantiles {
    /// Half of the values are below.
    pub median: f64,
    /// 95 % of the values are below.
    pub quantile_95: f64,
    /// All values, from least to greatest.
    #[serde(skip)]
    pub sorted: Vec<f64>,
}

impl Quantiles {
    pub(super) fn of(sorted: Vec<f64>) -> Self {
        let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
        Self {
            median: at(0.5),
            quantile_95: at(0.95),
            sorted,
        }
    }
}

/// The rigid part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rigid {
    /// By rows; proper.
    pub rotation: [[f64; 3]; 3],
    /// In the user's unit.
    pub translation: [f64; 3],
    /// The angle of the rotation.
    pub degrees: f64,
    /// Mean distance of closest points after it, in normalised units, the farthest fifth left out.
    pub distance: f64,
    /// The same without it.
    pub distance_unmoved: f64,
}

impl Matching {
    /// The pairs with their confidences.
    pub fn correspondences(&self) -> Correspondences {
        Correspondences {
            pairs: self
                .pairs
                .iter()
                .map(|pair| [pair.source, pair.target])
                .collect(),
            confidence: self
                .pairs
                .iter()
                .map(|pair| as_stored(pair.confidence))
                .collect(),
            notes: Vec::new(),
        }
    }

    /// Writes `source_index,target_index,confidence`, a line of these names first, as
    /// `data.correspondences` takes it.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub fn write_csv(&self, path: &Path) -> std::io::Result<()> {
        crate::atomic::write_atomically(path, |out| {
            writeln!(out, "source_index,target_index,confidence")?;
            for pair in &self.pairs {
                let confidence = written(pair.confidence);
                let [from, to] = [(0, pair.source), (1, pair.target)]
                    .map(|(side, vertex)| Kept::number_of(self.kept[side].as_ref(), vertex));
                writeln!(out, "{from},{to},{confidence}")?;
            }
            Ok(())
        })
    }
}

/// A confidence as it stands in a file.
fn written(confidence: f64) -> String {
    format!("{confidence:.4}")
}

/// A confidence as it is read from a file: a run that finds pairs has the bits of one that reads them.
fn as_stored(confidence: f64) -> f32 {
    written(confidence).parse().expect("a number was written")
}

impl Rigid {
    /// `R (x - c) s + t` in normalised coordinates is `R x + (c - R c + t / s)` in the user's.
    pub(super) fn new(alignment: &Alignment, frame: &Normalisation) -> Self {
        let motion = alignment.motion;
        let turned = times(&motion.rotation, frame.centre);
        let axis = |k: usize| frame.centre[k] - turned[k] + motion.translation[k] / frame.scale;
        Self {
            rotation: motion.rotation,
            translation: [axis(0), axis(1), axis(2)],
            degrees: motion.angle().to_degrees(),
            distance: alignment.distance,
            distance_unmoved: alignment.unmoved,
        }
    }
}
