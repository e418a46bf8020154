//! The true frames: a sequence of one mesh, vertex by vertex, and the two frames that a run is
//! given.

use std::path::{Path, PathBuf};

use isomorph_training::recipe::files_in;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::TruthError;
use crate::formats::{self, Sequence, Shape, ShapeError};
use crate::geometry::{Mesh, NeighbourSearch};
use crate::shape::{Normalisation, sample_surface};

/// The ends and one frame in between.
pub(super) const FEWEST_FRAMES: usize = 3;

/// Farther than this on average, in normalised units, an end of a run is not the frame it is said
/// to be. The samples of the same surface come out at 0.0016.
pub(super) const SAME_SHAPE_WITHIN: f64 = 0.01;

/// Samples of a frame that an end of a run is held against.
const END_SAMPLES: usize = 100_000;

/// Frames of one mesh in the user's coordinates; every frame has the same vertices in the same
/// order.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruth {
    path: PathBuf,
    frames: Vec<Vec<[f64; 3]>>,
    triangles: Vec<[u32; 3]>,
}

impl GroundTruth {
    /// Reads a `.anime` sequence, or a folder whose PLY and OBJ meshes are the frames in the
    /// natural order of their names: `frame-2` before `frame-10`. Other files in the folder are
    /// passed over.
    ///
    /// # Errors
    /// One line: a frame that cannot be read or has no triangles or no area, fewer than three
    /// frames, two frames that differ in their number of vertices or in their triangles.
    pub fn read(path: &Path) -> Result<Self, TruthError> {
        if path.is_dir() {
            return Self::read_folder(path);
        }
        let extension = path.extension().unwrap_or_default();
        if !extension.eq_ignore_ascii_case("anime") {
            return Err(match path.metadata() {
                Ok(_) => TruthError::NoSequence { path: path.into() },
                Err(reason) => unreadable(path, reason),
            });
        }
        let sequence = Sequence::read(path)?;
        let vertices = |frame| Ok(sequence.shape(frame)?.mesh.vertices);
        let frames = (0..sequence.frames.len()).map(vertices);
        let frames = frames.collect::<Result<_, ShapeError>>()?;
        Self::new(path.to_owned(), frames, sequence.triangles)
    }

    fn read_folder(folder: &Path) -> Result<Self, TruthError> {
        let mut shapes = Vec::new();
        for path in meshes_in(folder)? {
            let shape = formats::read(&path)?;
            if !shape.is_mesh() {
                return Err(TruthError::Cloud { path });
            }
            if let Some(first) = shapes.first() {
                consistent(first, &shape)?;
            }
            shapes.push(shape);
        }
        let triangles = shapes
            .first()
            .map_or_else(Vec::new, |first| first.mesh.triangles.clone());
        let frames = shapes
            .into_iter()
            .map(|shape| shape.mesh.vertices)
            .collect();
        Self::new(folder.to_owned(), frames, triangles)
    }

    /// Frames that are in memory: the vertices of each, and the triangles of all.
    ///
    /// # Errors
    /// One line: no triangles, one with a vertex that is not there, fewer than three frames, two that differ in their
    /// number of vertices, a coordinate that is no number.
    pub fn of(frames: Vec<Vec<[f64; 3]>>, triangles: Vec<[u32; 3]>) -> Result<Self, TruthError> {
        let named = |frame: usize| PathBuf::from(format!("frame {frame}"));
        let wrong = |frame: usize, problem: String| TruthError::Inconsistent {
            path: named(frame),
            problem,
            first: named(0),
        };
        if triangles.is_empty() {
            return Err(TruthError::Cloud { path: named(0) });
        }
        let needed = frames.first().map_or(0, Vec::len);
        for (k, frame) in frames.iter().enumerate() {
            if frame.len() != needed {
                let found = frame.len();
                return Err(wrong(
                    k,
                    format!("{found} vertices instead of the {needed}"),
                ));
            }
            if let Some(at) = frame.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
                let problem = format!("vertex {at} is {:?} instead of the numbers", frame[at]);
                return Err(wrong(k, problem));
            }
        }
        let greatest = triangles.iter().flatten().max();
        if let Some(corner) = greatest.filter(|corner| **corner as usize >= needed) {
            let problem = format!("a triangle has vertex {corner} instead of one of the {needed}");
            return Err(wrong(0, problem));
        }
        Self::new(PathBuf::from("frames"), frames, triangles)
    }

    /// Frames that are known to be of one mesh.
    pub(super) fn new(
        path: PathBuf,
        frames: Vec<Vec<[f64; 3]>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, TruthError> {
        if frames.len() < FEWEST_FRAMES {
            let found = frames.len();
            return Err(TruthError::TooFewFrames { path, found });
        }
        Ok(Self {
            path,
            frames,
            triangles,
        })
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many frames there are.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// The triangles of every frame.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The vertices of one frame, in the user's coordinates.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn vertices(&self, frame: usize) -> &[[f64; 3]] {
        &self.frames[frame]
    }

    /// One frame as a shape.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn shape(&self, frame: usize) -> Shape {
        let mesh = Mesh::new(self.frames[frame].clone(), self.triangles.clone());
        Shape::at(&self.path, mesh)
    }

    /// The stretch between two frames that a run was given as its ends.
    ///
    /// # Errors
    /// [`TruthError::Span`] unless both exist and at least one frame lies between them.
    pub(crate) fn span(&self, from: usize, to: usize) -> Result<Span, TruthError> {
        let last = self.frames.len() - 1;
        if to > last || from >= to || to - from < 2 {
            let path = self.path.clone();
            return Err(TruthError::Span {
                path,
                from,
                to,
                last,
            });
        }
        Ok(Span { from, to })
    }

    /// Whether the ends of a run are the ends of the span: points on both, in the run's normalised
    /// coordinates, must lie on the frames.
    ///
    /// # Errors
    /// [`TruthError::OtherShape`] if the points of one are too far from its frame: another
    /// sequence, other frames or other coordinates.
    ///
    /// # Panics
    /// If the span is of another sequence, or there are no points.
    pub(crate) fn check_ends(
        &self,
        span: Span,
        normalisation: &Normalisation,
        source: &[[f32; 3]],
        target: &[[f32; 3]],
    ) -> Result<(), TruthError> {
        for (end, frame, points) in [("source", span.from, source), ("target", span.to, target)] {
            let distance = self.distance(frame, normalisation, points);
            // Points that are not finite numbers are not on the frame either.
            if distance.is_nan() || distance > SAME_SHAPE_WITHIN {
                let path = self.path.clone();
                return Err(TruthError::OtherShape {
                    path,
                    frame,
                    end,
                    distance,
                });
            }
        }
        Ok(())
    }

    /// Mean distance of points from a frame, both normalised: to the nearest of 100,000 samples of
    /// the frame, which is 0.0016 for points that lie on it.
    ///
    /// # Panics
    /// If there is no such frame, or no points.
    pub fn distance(
        &self,
        frame: usize,
        normalisation: &Normalisation,
        points: &[[f32; 3]],
    ) -> f64 {
        assert!(!points.is_empty(), "the distance of no points");
        let mesh = Mesh::of_points(&self.normalised(frame, normalisation), &self.triangles);
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let samples = sample_surface(&mesh, END_SAMPLES, &mut rng);
        let points: Vec<_> = points.iter().map(|point| point.map(f64::from)).collect();
        let nearest = NeighbourSearch::new(&samples.points).nearest_one_of_each(&points);
        let distances = nearest.iter().map(|found| found.squared_distance.sqrt());
        distances.sum::<f64>() / points.len() as f64
    }

    /// The vertices of one frame in normalised coordinates.
    pub(crate) fn normalised(&self, frame: usize, normalisation: &Normalisation) -> Vec<[f32; 3]> {
        let vertices = self.frames[frame].iter();
        vertices
            .map(|&vertex| normalisation.apply(vertex))
            .collect()
    }
}

/// Two frames with at least one between them; made by [`GroundTruth::span`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    from: usize,
    to: usize,
}

impl Span {
    /// The frame at time 0.
    pub(crate) fn from(&self) -> usize {
        self.from
    }

    /// The frame at time 1.
    pub(crate) fn to(&self) -> usize {
        self.to
    }

    /// The frames strictly between the ends.
    pub(crate) fn between(&self) -> std::ops::Range<usize> {
        self.from + 1..self.to
    }

    /// The time of a frame: `(frame - from) / (to - from)`.
    pub(crate) fn time(&self, frame: usize) -> f64 {
        (frame as f64 - self.from as f64) / (self.to - self.from) as f64
    }
}

fn unreadable(path: &Path, reason: std::io::Error) -> TruthError {
    TruthError::Shape(ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    })
}

/// The PLY, OBJ and OFF files of a folder, in natural order.
fn meshes_in(folder: &Path) -> Result<Vec<PathBuf>, TruthError> {
    let found = files_in(folder, &["ply", "obj", "off"]);
    found.map_err(|reason| unreadable(folder, reason))
}

/// Whether a shape is the first one with its vertices moved.
fn consistent(first: &Shape, shape: &Shape) -> Result<(), TruthError> {
    let problem = if shape.mesh.vertices.len() != first.mesh.vertices.len() {
        let (found, needed) = (shape.mesh.vertices.len(), first.mesh.vertices.len());
        format!("{found} vertices instead of the {needed}")
    } else if shape.mesh.triangles.len() != first.mesh.triangles.len() {
        let (found, needed) = (shape.mesh.triangles.len(), first.mesh.triangles.len());
        format!("{found} triangles instead of the {needed}")
    } else {
        let pairs = shape.mesh.triangles.iter().zip(&first.mesh.triangles);
        let Some((triangle, (found, needed))) = pairs.enumerate().find(|(_, (a, b))| a != b) else {
            return Ok(());
        };
        format!("triangle {triangle} is {found:?} instead of the {needed:?}")
    };
    Err(TruthError::Inconsistent {
        path: shape.path.clone(),
        problem,
        first: first.path.clone(),
    })
}

#[cfg(test)]
mod tests;
