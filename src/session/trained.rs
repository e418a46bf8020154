//! A run that is opened, and what can be asked of it: surfaces, distances, velocities, and where points go.

use std::path::{Path, PathBuf};

use super::checkpoint::Checkpoint;
use super::clock::Clock;
use super::extract::even_times;
use super::folder::RunFolder;
use super::learned;
use super::metrics::{self, Metrics};
use crate::backend::Backend;
use crate::cubes::Grid;
use crate::error::{Error, Result};
use crate::geometry::Mesh;
use crate::recipe::Recipe;
use crate::shape::Place;
use crate::surface::learned::Learned;

/// A trained run. Everything goes in and comes out in the coordinates of its shapes.
///
/// # Examples
/// Opening a run and moving points of one's own from the first shape to half-way:
/// ```
/// # use isomorph::{Recipe, Session, Shape};
/// use isomorph::{Backend, Trained};
///
/// # fn main() -> Result<(), isomorph::Error> {
/// # let place = tempfile::tempdir().expect("a temporary folder");
/// # for (name, x) in [("a.ply", 0.0), ("b.ply", 0.5)] {
/// #     let points = (0..300).map(|k| {
/// #         let z = 1.0 - (2 * k + 1) as f64 / 300.0;
/// #         let (ring, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f64);
/// #         [x + ring * angle.cos(), ring * angle.sin(), z]
/// #     });
/// #     Shape::cloud(points.collect()).write(place.path().join(name))?;
/// # }
/// # let mut recipe = Recipe::between(place.path().join("a.ply"), place.path().join("b.ply"))?;
/// # for key in ["preset=quick", "training.steps=2", "training.batch=100", "implicit.width=8", "result.frames=0"] {
/// #     recipe.with(key)?;
/// # }
/// # let folder = place.path().join("run");
/// # Session::prepare(recipe, &folder, Backend::Flex)?.train(|_| {})?;
/// let trained = Trained::open(&folder, Backend::Flex)?;
/// let points = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
/// let moved = trained.carry(&points, 0.0, 0.5)?;
/// let velocities = trained.velocity(&moved, 0.5)?;
/// let found = trained.distance(&moved, 0.5)?;
/// assert_eq!((moved.len(), velocities.len(), found.distances.len()), (2, 2, 2));
/// # Ok(())
/// # }
/// ```
pub struct Trained {
    learned: Learned,
    recipe: Recipe,
    folder: RunFolder,
}

/// A surface at one time, in the coordinates of the run's shapes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// The time, between those of the first and the last shape.
    pub time: f64,
    /// Vertices, triangles that are counter-clockwise seen from outside, and unit normals that point
    /// outwards.
    pub mesh: Mesh<f64>,
    /// Connected pieces.
    pub components: usize,
    /// Pieces that were too small to be kept (`result.smallest-component`).
    pub left_out: usize,
    /// Whether the box that was searched cuts it off.
    pub touches_box: bool,
}

/// The signed distance field at points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distances {
    /// Signed distances from the surface, negative inside; as exact as the field is a distance.
    pub distances: Vec<f64>,
    /// Their gradients by the position: near the surface unit vectors that point outwards.
    pub gradients: Vec<[f64; 3]>,
}

/// Points that are moved between two reports of progress.
const CARRIED_AT_A_TIME: usize = 1 << 15;

impl Trained {
    /// Opens the newest checkpoint of a run.
    ///
    /// # Errors
    /// A folder that is no run, a checkpoint that is missing or damaged, a backend that cannot be opened.
    pub fn open(folder: impl AsRef<Path>, backend: Backend) -> Result<Self> {
        let folder = RunFolder::open(folder.as_ref())?;
        let checkpoint = Checkpoint::newest(&folder.checkpoints())?;
        let recipe = checkpoint.recipe()?;
        let learned = learned::load(&checkpoint, &recipe, &*backend.open()?)?;
        Ok(Self::new(learned, recipe, folder))
    }

    pub(super) fn new(learned: Learned, recipe: Recipe, folder: RunFolder) -> Self {
        Self {
            learned,
            recipe,
            folder,
        }
    }

    /// The recipe, every key with its value.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The folder of the run.
    pub fn path(&self) -> PathBuf {
        self.folder.path().to_path_buf()
    }

    pub(crate) fn learned(&self) -> &Learned {
        &self.learned
    }

    pub(super) fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// What the run has logged of its steps.
    ///
    /// # Errors
    /// A file that cannot be read, or holds something else.
    pub fn metrics(&self) -> Result<Vec<Metrics>> {
        Ok(Metrics::read(&self.folder.path().join(metrics::FILE))?)
    }

    /// The times of the first and of the last shape: 0 and 1 unless the recipe gives others.
    pub fn span(&self) -> [f64; 2] {
        self.clock().span()
    }

    /// So many times, evenly from the first shape to the last.
    pub fn even_times(&self, count: usize) -> Vec<f64> {
        let clock = self.clock();
        even_times(count)
            .into_iter()
            .map(|unit| clock.own(unit))
            .collect()
    }

    /// The times of all key frames.
    pub fn key_times(&self) -> Vec<f64> {
        let keys = self.recipe.data.keyframes.iter();
        keys.map(|key| key.time).collect()
    }

    /// The times of the key frames from 0 to 1, where there are more than two.
    pub(super) fn key_units(&self) -> Vec<f64> {
        let clock = self.clock();
        let keys = &self.recipe.data.keyframes;
        match keys.len() {
            2 => Vec::new(),
            _ => keys
                .iter()
                .filter_map(|key| clock.unit(key.time).ok())
                .collect(),
        }
    }

    pub(super) fn clock(&self) -> Clock {
        Clock::of(&self.recipe)
    }

    /// The surface at time `t`, from that of the first shape to that of the last ([`Trained::span`]); `resolution`: cells of the extraction
    /// grid along the longest side of the box, 8 or more.
    ///
    /// # Errors
    /// A time or a resolution out of range; a field that is not finite or has no zero in the box.
    pub fn surface(&self, t: f64, resolution: usize) -> Result<Surface> {
        self.surface_with(t, resolution, |_| {})
    }

    /// [`Trained::surface`] that reports how many nodes of the grid have been evaluated so far.
    ///
    /// # Errors
    /// Those of [`Trained::surface`].
    pub fn surface_with(
        &self,
        t: f64,
        resolution: usize,
        mut progress: impl FnMut(usize),
    ) -> Result<Surface> {
        let unit = self.clock().unit(t)?;
        let learned = &self.learned;
        let grid = Grid::new(learned.bounds.min, learned.bounds.max, resolution)?;
        let found = learned.surface_at(
            &grid,
            unit,
            self.recipe.result.smallest_component,
            &mut progress,
        )?;
        let (normals, _) = learned.normals(&found.mesh, unit);
        let place = learned.coordinates.at(unit);
        let mut mesh = found.mesh.moved(|x| place.invert(x));
        mesh.normals = Some(place.invert_normals(normals));
        Ok(Surface {
            time: t,
            mesh,
            components: found.components,
            left_out: found.left_out,
            touches_box: found.touches_box,
        })
    }

    /// Where points that are at `points` at time `from` are at time `to`.
    ///
    /// # Errors
    /// A time out of range; a method that moves no points.
    pub fn carry(&self, points: &[[f64; 3]], from: f64, to: f64) -> Result<Vec<[f64; 3]>> {
        self.carry_with(points, from, to, |_| {})
    }

    /// [`Trained::carry`] that reports how many points have been moved so far.
    ///
    /// # Errors
    /// Those of [`Trained::carry`].
    pub fn carry_with(
        &self,
        points: &[[f64; 3]],
        from: f64,
        to: f64,
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<[f64; 3]>> {
        let from = self.clock().unit(from)?;
        let to = self.clock().unit(to)?;
        if from == to {
            progress(points.len());
            return Ok(points.to_vec());
        }
        let [there, goal] = [from, to].map(|unit| self.learned.coordinates.at(unit));
        let mut moved = Vec::with_capacity(points.len());
        for chunk in points.chunks(CARRIED_AT_A_TIME) {
            let start = normalised(&there, chunk);
            let end = self.learned.carry(&start, from, to)?;
            moved.extend(
                (chunk.iter().zip(start.iter().zip(&end)))
                    .map(|(x, (start, end))| there.displaced(*x, [*start, *end], &goal)),
            );
            progress(moved.len());
        }
        Ok(moved)
    }

    /// The velocity of what is at `points` at time `t`, in the shapes' unit of length per unit of time.
    ///
    /// # Errors
    /// A time out of range; a method that moves no points.
    pub fn velocity(&self, points: &[[f64; 3]], t: f64) -> Result<Vec<[f64; 3]>> {
        let clock = self.clock();
        let unit = clock.unit(t)?;
        let coordinates = &self.learned.coordinates;
        let points = normalised(&coordinates.at(unit), points);
        let found = self.learned.motion()?.velocities(&points, unit);
        let found = coordinates.velocities(unit, &points, &found);
        let length = clock.length();
        let own = |v: [f64; 3]| v.map(|part| part / length);
        Ok(found.into_iter().map(own).collect())
    }

    /// The signed distance field and its gradient at `points` at time `t`.
    ///
    /// # Errors
    /// A time out of range; a method without a field.
    pub fn distance(&self, points: &[[f64; 3]], t: f64) -> Result<Distances> {
        let unit = self.clock().unit(t)?;
        let field = self.learned.deformation.field().ok_or_else(|| {
            Error::usage(format!(
                "method {}: has no distance field; it carries the source's mesh",
                self.recipe.method.name
            ))
        })?;
        let place = self.learned.coordinates.at(unit);
        let points = normalised(&place, points);
        let values = field.values(&points, unit).into_iter();
        let gradients = field.gradients(&points, unit).into_iter();
        Ok(Distances {
            distances: values
                .map(|value| place.invert_length(f64::from(value)))
                .collect(),
            gradients: gradients
                .map(|g| place.invert_direction(g).map(f64::from))
                .collect(),
        })
    }
}

fn normalised(place: &Place, points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|x| place.apply(*x)).collect()
}
