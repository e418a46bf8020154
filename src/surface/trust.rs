//! How far to believe a surface, place by place: what [`Learned::agreement_of_each`] says of its vertices, in the
//! user's unit of length.

use super::error::FramesError;
use super::learned::Learned;
use crate::formats::Attribute;
use crate::geometry::Mesh;

/// Of each vertex of a surface, in the user's unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrustMap {
    /// How far the surface is from those of the ends carried to its time.
    disagreement: Vec<f32>,
    /// How far a point that is carried to an end and back misses itself.
    round_trip: Vec<f32>,
}

/// The same in few numbers, in the user's unit and coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// The median over the vertices of the distance between the surface and those of the ends, carried to its
    /// time.
    pub median: f64,
    /// The distance that 95 % of the vertices do not exceed.
    pub most: f64,
    /// The greatest distance.
    pub greatest: f64,
    /// Where that is.
    pub place: [f64; 3],
}

/// The names in a PLY file. MeshLab shows `quality` in colours.
const IN_PLY: [&str; 2] = ["quality", "round_trip"];

/// The names in a glTF file.
const IN_GLTF: [&str; 2] = ["_DISAGREEMENT", "_ROUND_TRIP"];

impl TrustMap {
    /// Of the vertices of a surface at a time, normalised; `None` where nothing can be said.
    pub(super) fn of(
        learned: &Learned,
        mesh: &Mesh<f32>,
        time: f64,
    ) -> Result<Option<Self>, FramesError> {
        let found = learned.agreement_of_each(&mesh.vertices, time)?;
        let place = learned.coordinates.at(time);
        let own = |values: Vec<f32>| -> Vec<f32> {
            let length = |value: f32| place.invert_length(f64::from(value)) as f32;
            values.into_iter().map(length).collect()
        };
        Ok(found.map(|found| Self {
            disagreement: own(found.consistency),
            round_trip: own(found.round_trip),
        }))
    }

    /// For a PLY file.
    pub(super) fn for_ply(&self) -> [Attribute<'_>; 2] {
        let of = |name, values| Attribute { name, values };
        [
            of(IN_PLY[0], &self.disagreement),
            of(IN_PLY[1], &self.round_trip),
        ]
    }

    /// For a glTF file.
    pub(super) fn for_gltf(&self) -> Vec<(&'static str, Vec<f32>)> {
        let both = [&self.disagreement, &self.round_trip];
        let pairs = IN_GLTF.into_iter().zip(both);
        pairs.map(|(name, values)| (name, values.clone())).collect()
    }

    /// In few numbers; the vertices are in the user's coordinates. `None` if there are none.
    pub(super) fn summary(&self, vertices: &[[f64; 3]]) -> Option<Trust> {
        let mut order: Vec<usize> = (0..self.disagreement.len()).collect();
        order.sort_by(|a, b| self.disagreement[*a].total_cmp(&self.disagreement[*b]));
        let at = |share: f64| order[(share * (order.len() - 1) as f64).round() as usize];
        let worst = *order.last()?;
        let value = |vertex: usize| f64::from(self.disagreement[vertex]);
        Some(Trust {
            median: value(at(0.5)),
            most: value(at(0.95)),
            greatest: value(worst),
            place: vertices[worst],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_has_the_quantiles_and_the_worst_place() {
        let count = 101;
        let map = TrustMap {
            // Backwards, so that the order of the vertices plays no part.
            disagreement: (0..count).rev().map(|k| k as f32).collect(),
            round_trip: vec![0.0; count],
        };
        let vertices: Vec<[f64; 3]> = (0..count).map(|k| [k as f64, 0.0, 0.0]).collect();
        let found = map.summary(&vertices).expect("vertices");
        assert_eq!((found.median, found.most), (50.0, 95.0));
        assert_eq!((found.greatest, found.place), (100.0, [0.0; 3]));
        let empty = TrustMap {
            disagreement: Vec::new(),
            round_trip: Vec::new(),
        };
        assert_eq!(empty.summary(&[]), None);
    }
}
