//! One method against the reference, frame by frame: at each frame's own time and at the aligned
//! one.

use std::ops::ControlFlow;

use rand::RngExt;
use rayon::prelude::*;

use super::align::{CoarseSurface, WINDOW, least_in_order};
use super::metrics::compare;
use super::reference::{Reference, TrueFrame};
use super::sampled::{NoArea, SampledSurface, Use, generator};
use super::vertex_path::VertexPath;
use super::{Candidate, Compared, EvaluateError, Evaluation, FrameResult, Metrics, Purpose};
use crate::geometry::Mesh;

/// Points near the true surface at which `|grad f|` is looked at.
const SLOPE_POINTS: usize = 2000;

/// How far off it they are at most, normalised.
const SLOPE_BAND: f64 = 0.02;

type Measured<C, T> = Result<T, EvaluateError<<C as Candidate>::Error>>;

impl Reference {
    /// Measures a method at all frames.
    ///
    /// `progress` is told the frames done and the frames in all: after every surface that is taken
    /// to find the best times and after either end, with no frame done yet, and after every frame.
    /// If it breaks before all are done, measuring ends.
    ///
    /// # Errors
    /// [`EvaluateError::Candidate`] and [`EvaluateError::Carrying`] if the method could not answer,
    /// [`EvaluateError::Count`] and [`EvaluateError::Area`] if its answer cannot be compared,
    /// [`EvaluateError::Stopped`] if `progress` broke.
    pub(crate) fn evaluate<C: Candidate>(
        &self,
        candidate: &mut C,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Measured<C, Evaluation> {
        let total = self.frames.len();
        let mut go_on = |done| match progress(done, total) {
            ControlFlow::Break(()) if done < total => Err(EvaluateError::Stopped { done, total }),
            _ => Ok(()),
        };
        let carried = self.carried(candidate)?;
        let carried_times = carried.as_ref().map(|path| self.best_times(path));
        let surface_times = self.align_surfaces(candidate, &mut go_on)?;
        let mut measure = |frame: &TrueFrame, surface_time: Option<f64>, carried_time| {
            let truth = self.true_surface(frame, Use::Truth);
            let truth = truth.expect("the reference has measured this surface before");
            let surface = match surface_time {
                Some(time) => self.measure_surface(candidate, frame, &truth, time)?,
                None => None,
            };
            let carried = match &carried {
                Some(path) => Some(self.measure_carried::<C>(frame, &truth, path, carried_time)?),
                None => None,
            };
            Ok(FrameResult {
                frame: Some(frame.frame),
                time: Some(frame.time),
                surface,
                carried,
                linear: frame.linear.clone(),
                natural: frame.natural.clone(),
                floor: frame.floor.clone(),
            })
        };
        let mut ends = Vec::with_capacity(self.ends.len());
        for end in &self.ends {
            let surface_time = surface_times.is_some().then_some(end.time);
            ends.push(measure(end, surface_time, end.time)?);
            go_on(0)?;
        }
        let mut frames = Vec::with_capacity(total);
        for (place, frame) in self.frames.iter().enumerate() {
            let time_of = |times: &Option<Vec<f64>>| times.as_ref().map(|times| times[place]);
            let carried_time = time_of(&carried_times).unwrap_or(frame.time);
            frames.push(measure(frame, time_of(&surface_times), carried_time)?);
            go_on(place + 1)?;
        }
        Ok(Evaluation {
            ends,
            ..Evaluation::of(frames)
        })
    }

    /// The vertices of the first frame, carried to every time that may be needed.
    fn carried<C: Candidate>(&self, candidate: &mut C) -> Measured<C, Option<VertexPath>> {
        let (from, times) = (self.from, self.all_times());
        let carried = candidate.carried(&self.start, &times);
        let carried = carried.map_err(|reason| EvaluateError::Carrying { from, reason })?;
        let Some(positions) = carried else {
            return Ok(None);
        };
        let vertices = self.start.len();
        let other = positions
            .iter()
            .map(Vec::len)
            .find(|&found| found != vertices);
        if positions.len() != times.len() || other.is_some() {
            let found = (positions.len(), other.unwrap_or(vertices));
            let needed = (times.len(), vertices);
            return Err(EvaluateError::Count {
                from,
                found,
                needed,
            });
        }
        Ok(Some(VertexPath { times, positions }))
    }

    /// The best times of the method's surfaces, one per frame; none if it has no surface at any time.
    ///
    /// Where a frame has no surface within its window, all keep their own times: there is no order to find.
    fn align_surfaces<C: Candidate>(
        &self,
        candidate: &mut C,
        go_on: &mut impl FnMut(usize) -> Measured<C, ()>,
    ) -> Measured<C, Option<Vec<f64>>> {
        if !self.options.align {
            return Ok(Some(self.own_times()));
        }
        let coarse = |frame: &TrueFrame| {
            let rng = generator(self.options.seed, frame.frame, Use::CoarseTruth);
            let coarse = CoarseSurface::new(&self.mesh(&frame.vertices), rng);
            coarse.expect("the reference has measured this surface before")
        };
        let truth: Vec<CoarseSurface> = self.frames.par_iter().map(coarse).collect();
        let mut costs = vec![vec![f64::INFINITY; self.grid.len()]; self.frames.len()];
        for (column, &time) in self.grid.iter().enumerate() {
            let near = |frame: &TrueFrame| (frame.time - time).abs() <= WINDOW;
            let tried = truth.iter().zip(&self.frames);
            let tried: Vec<_> = tried
                .map(|(truth, frame)| near(frame).then_some(truth))
                .collect();
            if tried.iter().all(Option::is_none) {
                continue;
            }
            let nearest = self.nearest_frame(time);
            let Some(mesh) = surface(candidate, nearest, time, Purpose::Aligning)? else {
                continue;
            };
            // The same stream at every time: what sampling adds to the costs is then much the same,
            // too.
            let rng = generator(self.options.seed, 0, Use::CoarseCompared);
            let surface = CoarseSurface::new(&mesh, rng)
                .map_err(|found| no_area(nearest, time, "surface", &mesh, found))?;
            for (row, cost) in surface.costs(&tried).into_iter().enumerate() {
                costs[row][column] = cost.unwrap_or(f64::INFINITY);
            }
            go_on(0)?;
        }
        let found = |row: &Vec<f64>| row.iter().any(|cost| cost.is_finite());
        if !costs.iter().any(found) {
            return Ok(None);
        }
        if !costs.iter().all(found) {
            return Ok(Some(self.own_times()));
        }
        let chosen = least_in_order(&costs).into_iter();
        Ok(Some(chosen.map(|column| self.grid[column]).collect()))
    }

    /// The frame whose own time is nearest.
    fn nearest_frame(&self, time: f64) -> &TrueFrame {
        let distance = |frame: &&TrueFrame| (frame.time - time).abs();
        let nearest = self
            .frames
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.expect("a span has frames between its ends")
    }

    fn measure_surface<C: Candidate>(
        &self,
        candidate: &mut C,
        frame: &TrueFrame,
        truth: &SampledSurface,
        aligned: f64,
    ) -> Measured<C, Option<Compared>> {
        let near = self.points_near(frame, truth);
        let mut at = |time: f64| -> Measured<C, Option<Metrics>> {
            let Some(mesh) = surface(candidate, frame, time, Purpose::Measured)? else {
                return Ok(None);
            };
            let surface = self
                .sampled(&mesh, frame, Use::Compared)
                .map_err(|found| no_area(frame, time, "surface", &mesh, found))?;
            let slope_error = candidate.slope_error(&near, time);
            Ok(Some(Metrics {
                slope_error: slope_error.map_err(|reason| candidate_error(frame, time, reason))?,
                ..compare(&surface, truth, time)
            }))
        };
        let Some(metrics) = at(frame.time)? else {
            return Ok(None);
        };
        let aligned = if aligned == frame.time {
            Some(metrics.clone())
        } else {
            at(aligned)?
        };
        Ok(aligned.map(|aligned| Compared { metrics, aligned }))
    }

    /// Samples of the true surface moved along their normals by up to [`SLOPE_BAND`] either way.
    fn points_near(&self, frame: &TrueFrame, truth: &SampledSurface) -> Vec<[f32; 3]> {
        let mut rng = generator(self.options.seed, frame.frame, Use::Displacement);
        let samples = truth.points.iter().zip(&truth.normals).take(SLOPE_POINTS);
        let displaced = samples.map(|(point, &normal)| {
            let by = rng.random_range(-SLOPE_BAND..SLOPE_BAND);
            [0, 1, 2].map(|axis| (point[axis] + by * f64::from(normal[axis])) as f32)
        });
        displaced.collect()
    }

    fn measure_carried<C: Candidate>(
        &self,
        frame: &TrueFrame,
        truth: &SampledSurface,
        path: &VertexPath,
        aligned: f64,
    ) -> Measured<C, Compared> {
        let compared = self.compare_vertices(frame, truth, path, aligned);
        compared.map_err(|NoArea { area }| EvaluateError::Area {
            frame: frame.frame,
            time: frame.time,
            kind: "carried",
            vertices: self.start.len(),
            triangles: self.triangles.len(),
            area,
        })
    }
}

/// The method's surface; its errors with frame and time.
fn surface<C: Candidate>(
    candidate: &mut C,
    frame: &TrueFrame,
    time: f64,
    purpose: Purpose,
) -> Measured<C, Option<Mesh<f64>>> {
    let failed = |reason| candidate_error(frame, time, reason);
    candidate.surface(time, purpose).map_err(failed)
}

fn candidate_error<E: std::fmt::Debug + std::fmt::Display>(
    frame: &TrueFrame,
    time: f64,
    reason: E,
) -> EvaluateError<E> {
    EvaluateError::Candidate {
        frame: frame.frame,
        time,
        reason,
    }
}

fn no_area<E: std::fmt::Debug + std::fmt::Display>(
    frame: &TrueFrame,
    time: f64,
    kind: &'static str,
    mesh: &Mesh<f64>,
    NoArea { area }: NoArea,
) -> EvaluateError<E> {
    EvaluateError::Area {
        frame: frame.frame,
        time,
        kind,
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        area,
    }
}
