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
    let points: Arc<[[f32; 3]]> = cloud.points.as_slice().into();
    let normals: Option<Arc<[[f32; 3]]>> = cloud.normals.as_deref().map(Arc::from);
    let around = Around {
        points: points.clone(),
        normals: normals.clone(),
        distance: OnceLock::new(),
        search: OnceLock::new(),
    };
    KeyPoints::new(time as f32, points, normals, Arc::new(around))
}

/// Searches around a cloud, each made on its first use: most methods need none.
struct Around {
    points: Arc<[[f32; 3]]>,
    normals: Option<Arc<[[f32; 3]]>>,
    distance: OnceLock<SignedDistance>,
    search: OnceLock<NeighbourSearch>,
}

impl Surroundings for Around {
    fn signed_distance(&self, x: [f32; 3]) -> Option<f32> {
        let normals = self.normals.as_ref()?;
        let distance = self
            .distance
            .get_or_init(|| SignedDistance::new(&self.points, normals));
        Some(distance.at(x))
    }

    fn nearest(&self, point: usize, count: NonZeroUsize) -> Vec<usize> {
        let search = self.search.get_or_init(|| {
            let points = self.points.iter();
            let points: Vec<[f64; 3]> = points.map(|point| point.map(f64::from)).collect();
            NeighbourSearch::new(&points)
        });
        let found = search.nearest(self.points[point].map(f64::from), count);
        found.iter().map(|found| found.index as usize).collect()
    }
}
