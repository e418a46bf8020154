//! What does not depend on the method: the true frames in normalised coordinates, the straight
//! lines between the true ends, and the floor that sampling sets.

use super::align::evenly_spaced;
use super::metrics::{compare, mean_squared_error};
use super::natural;
use super::sampled::{NoArea, SampledSurface, Use, generator};
use super::vertex_path::VertexPath;
use super::{Compared, GroundTruth, Metrics, Span, TruthError};
use crate::geometry::Mesh;
use crate::shape::Normalisation;

/// The fewest times to align with: with fewer none would be within a quarter of a frame's own.
const FEWEST_TIMES: usize = 9;

/// How closely to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Options {
    /// Area-uniform samples per surface.
    pub samples: usize,
    /// Whether the best times are sought; without, the frames' own stand for them.
    pub align: bool,
    /// Evenly spaced times that the aligned ones are chosen from.
    pub alignment_times: usize,
    /// Every n-th frame between the ends is evaluated, counted from the first end.
    pub every: usize,
    /// Of all samples.
    pub seed: u64,
}

impl Default for Options {
    /// The protocol's.
    fn default() -> Self {
        Self {
            samples: 100_000,
            align: true,
            alignment_times: 129,
            every: 1,
            seed: 0,
        }
    }
}

impl Options {
    fn check(&self, span: Span) -> Result<(), TruthError> {
        let between = span.between().len();
        let allowed = [
            ("samples", self.samples, 1, usize::MAX),
            (
                "alignment_times",
                self.alignment_times,
                FEWEST_TIMES,
                usize::MAX,
            ),
            ("every", self.every, 1, between),
        ];
        for (option, found, least, most) in allowed {
            if found < least || found > most {
                let allowed = match most {
                    usize::MAX => format!("{least} or more"),
                    _ => format!("{least} to {most}, the number of frames between the ends"),
                };
                return Err(TruthError::Option {
                    option,
                    found,
                    allowed,
                });
            }
        }
        Ok(())
    }
}

/// One true frame and what can be said of it without a method.
#[derive(Debug)]
pub(super) struct TrueFrame {
    pub frame: usize,
    pub time: f64,
    /// Normalised.
    pub vertices: Vec<[f32; 3]>,
    pub linear: Compared,
    /// Where the span is one of many.
    pub natural: Option<Compared>,
    pub floor: Metrics,
}

/// A ground truth ready for any number of methods to be measured against.
#[derive(Debug)]
pub(crate) struct Reference {
    pub(super) options: Options,
    pub(super) from: usize,
    /// The vertices at time 0, normalised.
    pub(super) start: Vec<[f32; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) frames: Vec<TrueFrame>,
    /// The two that a method has seen, at times 0 and 1.
    pub(super) ends: [TrueFrame; 2],
    /// The times that the aligned ones are chosen from.
    pub(super) grid: Vec<f64>,
}

impl Reference {
    /// Prepares the frames between the ends: straight lines, their alignment, and the floor. It
    /// takes about three comparisons of surfaces per frame.
    ///
    /// `normalisation` is that of the run, whose ends are the ends of the span
    /// ([`GroundTruth::check_ends`]).
    ///
    /// # Errors
    /// [`TruthError::Option`] for an option out of range, [`TruthError::Collapsed`] if the straight
    /// lines pass through a shape without area.
    ///
    /// # Panics
    /// If the span is of another, longer sequence.
    pub(crate) fn new(
        truth: &GroundTruth,
        span: Span,
        normalisation: &Normalisation,
        options: Options,
    ) -> Result<Self, TruthError> {
        options.check(span)?;
        let vertices = |frame| truth.normalised(frame, normalisation);
        let unmeasured = |frame| TrueFrame {
            frame,
            time: span.time(frame),
            vertices: vertices(frame),
            linear: Compared::default(),
            natural: None,
            floor: Metrics::default(),
        };
        let mut reference = Self {
            options,
            from: span.from(),
            start: vertices(span.from()),
            triangles: truth.triangles().to_vec(),
            frames: Vec::new(),
            ends: [span.from(), span.to()].map(unmeasured),
            grid: match options.align {
                true => evenly_spaced(options.alignment_times),
                false => Vec::new(),
            },
        };
        let compared = span
            .between()
            .skip(options.every - 1)
            .step_by(options.every);
        reference.frames.extend(compared.map(unmeasured));
        let times = reference.all_times();
        let straight = VertexPath::straight(&reference.start, &vertices(span.to()), &times);
        reference
            .fill(&straight)
            .map_err(|frame| TruthError::Collapsed {
                path: truth.path().to_owned(),
                frame,
            })?;
        Ok(reference)
    }

    /// [`Self::new`] of a span between two of many key frames, with the natural cubic spline through all of them.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub(crate) fn between_keys(
        truth: &GroundTruth,
        span: Span,
        keys: &[usize],
        normalisation: &Normalisation,
        options: Options,
    ) -> Result<Self, TruthError> {
        let mut reference = Self::new(truth, span, normalisation, options)?;
        let vertices: Vec<_> = keys
            .iter()
            .map(|key| truth.normalised(*key, normalisation))
            .collect();
        let keys: Vec<f64> = keys.iter().map(|key| *key as f64).collect();
        let [from, to] = [span.from(), span.to()].map(|frame| frame as f64);
        let times = reference.all_times();
        let path = natural::through(&keys, &vertices, &times, |t| from + t * (to - from));
        let aligned = reference.best_times(&path);
        for (place, aligned) in aligned.into_iter().enumerate() {
            let frame = &reference.frames[place];
            let measure = || -> Result<Compared, NoArea> {
                let truth = reference.true_surface(frame, Use::Truth)?;
                reference.compare_vertices(frame, &truth, &path, aligned)
            };
            let found = measure().map_err(|_no_area| TruthError::Collapsed {
                path: truth.path().to_owned(),
                frame: frame.frame,
            })?;
            reference.frames[place].natural = Some(found);
        }
        Ok(reference)
    }

    /// The frames that are evaluated.
    #[cfg(test)]
    pub(crate) fn frames(&self) -> impl ExactSizeIterator<Item = usize> {
        self.frames.iter().map(|frame| frame.frame)
    }

    /// Measures the straight lines and the floor; in error, the frame where there is nothing to
    /// measure.
    fn fill(&mut self, straight: &VertexPath) -> Result<(), usize> {
        let aligned = self.best_times(straight);
        for (place, aligned) in aligned.into_iter().enumerate() {
            let frame = &self.frames[place];
            let (linear, floor) = self.measure_reference(frame, straight, aligned)?;
            (self.frames[place].linear, self.frames[place].floor) = (linear, floor);
        }
        for place in 0..self.ends.len() {
            let end = &self.ends[place];
            let (linear, floor) = self.measure_reference(end, straight, end.time)?;
            (self.ends[place].linear, self.ends[place].floor) = (linear, floor);
        }
        Ok(())
    }

    fn measure_reference(
        &self,
        frame: &TrueFrame,
        straight: &VertexPath,
        aligned: f64,
    ) -> Result<(Compared, Metrics), usize> {
        let measure = || -> Result<(Compared, Metrics), NoArea> {
            let truth = self.true_surface(frame, Use::Truth)?;
            let linear = self.compare_vertices(frame, &truth, straight, aligned)?;
            let again = self.true_surface(frame, Use::Floor)?;
            Ok((linear, compare(&again, &truth, frame.time)))
        };
        measure().map_err(|_no_area| frame.frame)
    }

    /// The best times of vertices, or the frames' own.
    pub(super) fn best_times(&self, path: &VertexPath) -> Vec<f64> {
        match self.options.align {
            true => path.align(&self.true_vertices(), &self.grid),
            false => self.own_times(),
        }
    }

    /// The time of each frame.
    pub(super) fn own_times(&self) -> Vec<f64> {
        self.frames.iter().map(|frame| frame.time).collect()
    }

    /// The true vertices of each frame.
    pub(super) fn true_vertices(&self) -> Vec<&[[f32; 3]]> {
        let frames = self.frames.iter();
        frames.map(|frame| frame.vertices.as_slice()).collect()
    }

    /// The frames' own times and those of the grid, ascending, each once.
    pub(super) fn all_times(&self) -> Vec<f64> {
        let own = self.frames.iter().chain(&self.ends);
        let own = own.map(|frame| frame.time);
        let mut times: Vec<f64> = own.chain(self.grid.iter().copied()).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The true surface of a frame, sampled.
    pub(super) fn true_surface(
        &self,
        frame: &TrueFrame,
        purpose: Use,
    ) -> Result<SampledSurface, NoArea> {
        self.sampled(&self.mesh(&frame.vertices), frame, purpose)
    }

    /// A surface, sampled for a frame.
    pub(super) fn sampled(
        &self,
        mesh: &Mesh<f64>,
        frame: &TrueFrame,
        purpose: Use,
    ) -> Result<SampledSurface, NoArea> {
        let rng = generator(self.options.seed, frame.frame, purpose);
        SampledSurface::new(mesh, self.options.samples, rng)
    }

    /// Vertices of the true mesh, wherever they are, as a mesh.
    pub(super) fn mesh(&self, vertices: &[[f32; 3]]) -> Mesh<f64> {
        Mesh::of_points(vertices, &self.triangles)
    }

    /// The true mesh with other vertices, at the frame's own time and at the aligned one.
    pub(super) fn compare_vertices(
        &self,
        frame: &TrueFrame,
        truth: &SampledSurface,
        path: &VertexPath,
        aligned: f64,
    ) -> Result<Compared, NoArea> {
        let at = |time: f64| {
            let vertices = path.at(time);
            let surface = self.sampled(&self.mesh(vertices), frame, Use::Compared)?;
            let squared = mean_squared_error(vertices, &frame.vertices);
            Ok(Metrics {
                tracked_rmse: Some(squared.sqrt()),
                ..compare(&surface, truth, time)
            })
        };
        let metrics = at(frame.time)?;
        let aligned = if aligned == frame.time {
            metrics.clone()
        } else {
            at(aligned)?
        };
        Ok(Compared { metrics, aligned })
    }
}
