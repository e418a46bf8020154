//! Key frames as methods sample them: points with what lies around them.

use std::num::NonZeroUsize;
use std::sync::{Arc, OnceLock};

use isomorph_training::data::{KeyPoints, Surroundings, TrainingData};

use super::distance::SignedDistance;
use super::keyframes::{Keyframes, PointCloud};
use crate::geometry::NeighbourSearch;

impl Keyframes {
    /// The points as methods sample them.
    pub fn training_data(&self) -> TrainingData {
        let keys = self.keys.iter().map(|key| trained(key.time, &key.cloud));
        TrainingData::new(keys.collect(), self.between.clone())
    }
}

/// The points of a cloud at a time as methods sample them.
pub(crate) fn trained(time: f64, cloud: &PointCloud) -> KeyPoints {
    let around = Arc::new(Around::new(cloud));
    KeyPoints::new(
        time as f32,
        cloud.points.clone(),
        cloud.normals.clone(),
        around,
    )
}

/// Searches around a cloud, each made on its first use: most methods need none.
struct Around {
    cloud: PointCloud,
    distance: OnceLock<SignedDistance>,
    search: OnceLock<NeighbourSearch>,
}

impl Around {
    fn new(cloud: &PointCloud) -> Self {
        Self {
            cloud: cloud.clone(),
            distance: OnceLock::new(),
            search: OnceLock::new(),
        }
    }
}

impl Surroundings for Around {
    fn signed_distance(&self, x: [f32; 3]) -> Option<f32> {
        let normals = self.cloud.normals.as_ref()?;
        let distance = self
            .distance
            .get_or_init(|| SignedDistance::new(&self.cloud.points, normals));
        Some(distance.at(x))
    }

    fn nearest(&self, point: usize, count: NonZeroUsize) -> Vec<usize> {
        let search = self.search.get_or_init(|| {
            let points = self.cloud.points.iter();
            let points: Vec<[f64; 3]> = points.map(|point| point.map(f64::from)).collect();
            NeighbourSearch::new(&points)
        });
        let found = search.nearest(self.cloud.points[point].map(f64::from), count);
        found.iter().map(|found| found.index as usize).collect()
    }
}
