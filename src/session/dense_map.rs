//! The point-to-point map of a run: for each vertex of the first shape the vertex of the last one that it goes
//! to.

use std::path::Path;

use super::prepare;
use super::trained::Trained;
use crate::atomic::write_atomically;
use crate::error::{Error, Result};
use crate::geometry::NeighbourSearch;
use crate::geometry::linear::{difference, length};
use crate::shape::Correspondences;

/// Misses beyond the spacing of the vertices of this size, in normalised units, halve a confidence.
const HALVES: f64 = 0.02;

/// The map of all vertices of the first shape.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseMap {
    /// For each vertex of the first shape, in its order.
    pub pairs: Vec<MappedVertex>,
    /// Share of the last shape's vertices that a vertex goes to, 0 to 1.
    pub reached: f64,
}

/// Where a vertex goes; lengths in the shapes' unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedVertex {
    /// The vertex of the first shape, by its number in the file.
    pub source: u32,
    /// The vertex of the last shape, by its number in the file, that is nearest to where the motion carries it.
    pub target: u32,
    /// How far that is away.
    pub distance: f64,
    /// How far that vertex, carried back, misses this one.
    pub round_trip: f64,
    /// How far to trust it, 0 to 1: 1 where both misses are within the spacing of the last shape's vertices
    /// there, a half where they exceed it by 0.02 in normalised units.
    pub confidence: f64,
}

impl Trained {
    /// Where each vertex of the first shape goes.
    ///
    /// # Errors
    /// A shape that cannot be read any more, a method that moves no points.
    pub fn dense_map(&self) -> Result<DenseMap> {
        let shapes = prepare::read(self.recipe())?;
        let [source, target] = [0, shapes.len() - 1].map(|k| &shapes[k].mesh.vertices);
        if target.len() < 2 {
            let name = shapes[shapes.len() - 1].path.display();
            return Err(Error::usage(format!("{name}: needs two vertices or more")));
        }
        let numbers = [0, shapes.len() - 1].map(|k| {
            let shape = &shapes[k];
            move |vertex: u32| shape.number_in_file(vertex)
        });
        let search = NeighbourSearch::new(target);
        let [first, last] = self.span();
        let arrived = self.carry(source, first, last)?;
        let found = search.nearest_one_of_each(&arrived);
        let goals: Vec<[f64; 3]> = (found.iter())
            .map(|near| target[near.index as usize])
            .collect();
        let back = self.carry(&goals, last, first)?;
        let two = std::num::NonZeroUsize::MIN.saturating_add(1);
        let spacing = search.nearest_of_each(&goals, two);
        let halves = self.learned().coordinates.at(1.0).invert_length(HALVES);
        let pairs = found.iter().enumerate().map(|(k, near)| {
            let distance = near.squared_distance.sqrt();
            let round_trip = length(difference(back[k], source[k]));
            // The first is the vertex itself.
            let spacing = spacing[k]
                .last()
                .map_or(0.0, |other| other.squared_distance.sqrt());
            let miss = (distance.max(round_trip) - spacing).max(0.0) / halves;
            MappedVertex {
                source: numbers[0](k as u32),
                target: numbers[1](near.index),
                distance,
                round_trip,
                confidence: 1.0 / (1.0 + miss * miss),
            }
        });
        let pairs: Vec<MappedVertex> = pairs.collect();
        let mut reached = vec![false; target.len()];
        found
            .iter()
            .for_each(|near| reached[near.index as usize] = true);
        let count = reached.iter().filter(|is| **is).count();
        Ok(DenseMap {
            pairs,
            reached: count as f64 / target.len() as f64,
        })
    }
}

impl DenseMap {
    /// Writes `source_index,target_index,confidence` for each vertex, a line of these names first, as
    /// `data.correspondences` takes it.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let pairs = self.pairs.iter();
        let known = Correspondences {
            pairs: pairs.map(|pair| [pair.source, pair.target]).collect(),
            confidence: self
                .pairs
                .iter()
                .map(|pair| pair.confidence as f32)
                .collect(),
            notes: Vec::new(),
        };
        write_atomically(path, |out| out.write_all(known.text().as_bytes()))?;
        Ok(())
    }

    /// A quantile of the round trip, 0 to 1, in the shapes' unit.
    ///
    /// # Panics
    /// If there are no vertices, which no shape lacks.
    pub fn round_trip(&self, quantile: f64) -> f64 {
        let mut ways: Vec<f64> = self.pairs.iter().map(|pair| pair.round_trip).collect();
        ways.sort_by(f64::total_cmp);
        ways[(quantile.clamp(0.0, 1.0) * (ways.len() - 1) as f64).round() as usize]
    }
}
