//! A surface ready to be compared: points on it, a search among them, and the measures of its mesh.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::pieces::Pieces;
use crate::geometry::{Mesh, NeighbourSearch};
use crate::shape::{SurfaceSamples, sample_surface};

/// What a set of samples is for: samples for different uses are independent of each other.
#[derive(Clone, Copy, Debug)]
pub(super) enum Use {
    /// The true surface.
    Truth,
    /// The true surface a second time, for the floor.
    Floor,
    /// Whatever is compared with it.
    Compared,
    /// The displacement of points off the true surface.
    Displacement,
    /// The true surface, coarsely, to find the best times.
    CoarseTruth,
    /// What is compared with it for that.
    CoarseCompared,
}

/// The generator of one frame and use: a stream of its own of the seed's.
pub(super) fn generator(seed: u64, frame: usize, purpose: Use) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((frame as u64) << 3 | purpose as u64);
    rng
}

/// A mesh that cannot be sampled: its area is not positive and finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoArea {
    /// Its area.
    pub area: f64,
}

/// Area-uniform points on a mesh, or why there are none.
pub(super) fn sample(
    mesh: &Mesh<f64>,
    count: usize,
    rng: &mut ChaCha8Rng,
) -> Result<SurfaceSamples, NoArea> {
    // The sum of nothing is -0, which would look odd in a message.
    let area = mesh.area() + 0.0;
    if area > 0.0 && area.is_finite() {
        Ok(sample_surface(mesh, count, rng))
    } else {
        Err(NoArea { area })
    }
}

/// A surface ready to be compared.
#[derive(Debug)]
pub(super) struct SampledSurface {
    /// Area-uniform, independent.
    pub points: Vec<[f64; 3]>,
    /// Unit normals of the triangles that they lie on.
    pub normals: Vec<[f32; 3]>,
    /// Finds the nearest of `points`.
    pub search: NeighbourSearch,
    /// Area of the mesh.
    pub area: f64,
    /// Volume that the mesh encloses, positive if it is wound outwards.
    pub volume: f64,
    /// Its connected pieces.
    pub pieces: Pieces,
}

impl SampledSurface {
    /// Draws `count` samples and measures the mesh.
    pub(super) fn new(mesh: &Mesh<f64>, count: usize, mut rng: ChaCha8Rng) -> Result<Self, NoArea> {
        let samples = sample(mesh, count, &mut rng)?;
        Ok(Self {
            search: NeighbourSearch::new(&samples.points),
            points: samples.points,
            normals: samples.normals,
            area: mesh.area(),
            volume: mesh.volume(),
            pieces: Pieces::of(mesh),
        })
    }
}
