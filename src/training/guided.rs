//! What a velocity field learns from a field that is there already: places near the moving surface and in the
//! box, with the velocities there.

use crate::data::TrainingData;
use crate::recipe::TrainingRecipe;
use crate::samples::{Batch, BatchSizes, Part, Samples};

/// Places with times and velocities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Guided {
    /// Places and times, no normals.
    pub at: Samples,
    /// The velocities there, `[n, 3]`.
    pub velocities: Vec<[f32; 3]>,
}

impl Guided {
    /// The samples of `step`: the points that a step carries, where the guide carries them, those around them,
    /// and those of the box.
    ///
    /// # Panics
    /// If the data has no guide.
    pub fn draw(
        data: &TrainingData,
        training: &TrainingRecipe,
        sizes: BatchSizes,
        step: usize,
    ) -> Self {
        let guide = data.guide.as_ref();
        let guide = guide.expect("whoever trains guided steps gives the data a guide");
        let sizes = BatchSizes {
            ends: 0,
            matched: 0,
            ..sizes
        };
        let batch = Batch::draw(data, training, sizes, step);
        let (starts, stops) = (&batch.starts, &batch.stops);
        let carried = guide.carried(&starts.points, &starts.times, stops);
        let mut at = batch.uniform;
        for (k, by) in batch.offsets.iter().enumerate() {
            let k = k % carried.len();
            at.points
                .push([0, 1, 2].map(|axis| carried[k][axis] + by[axis]));
            at.times.push(stops[k]);
        }
        at.points.extend(carried);
        at.times.extend(stops);
        Self {
            velocities: guide.velocities(&at.points, &at.times),
            at,
        }
    }

    /// One of the equal parts.
    #[must_use]
    pub fn part(&self, part: Part) -> Self {
        Self {
            at: self.at.part(part),
            velocities: part.share(&self.velocities),
        }
    }
}
