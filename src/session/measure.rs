//! A trained method as the evaluation asks for it, and how it is measured.

use std::ops::ControlFlow;

use crate::cubes::{ExtractError, Grid, GridError};
use crate::error::{Error, Result};
use crate::evaluate::{Candidate, Carried, EvaluateError, Evaluation, Purpose, Reference};
use crate::event::Event;
use crate::geometry::Mesh;
use crate::session::stop::StopFlag;
use crate::shape::Normalisation;
use crate::surface::FramesError;
use crate::surface::learned::Learned;

/// Cells along the longest side where a surface only serves to find the best times.
const COARSE: usize = 48;

/// Times, 0 and 1 aside, at which a surface that its motion carries is extracted to find the best times; in
/// between its vertices are carried from the nearest.
const ANCHORS: f64 = 16.0;

/// Where and how closely a method is measured.
pub(super) struct Ruler<'a> {
    /// The true frames.
    pub reference: &'a Reference,
    /// The coordinates of the true frames: those of the true ends, whatever the method was given.
    pub normalisation: Normalisation,
    /// Cells along the longest side of the box.
    pub resolution: usize,
    /// Pieces with less than this share of a surface's area are left out.
    pub smallest_component: f64,
    /// The times of the run between which is measured: 0 and 1, or those of two key frames.
    pub within: [f64; 2],
    /// Set to stop.
    pub stop: &'a StopFlag,
}

/// A method with the grids on which its surfaces are found.
struct Measured<'a> {
    learned: &'a Learned,
    smallest: f64,
    within: [f64; 2],
    truth: Normalisation,
    fine: Grid,
    coarse: Grid,
    /// The coarse surface extracted last, in the method's coordinates, and its time; no mesh if it had
    /// vanished.
    anchor: Option<(f64, Option<Mesh<f32>>)>,
}

impl<'a> Measured<'a> {
    fn new(learned: &'a Learned, ruler: &Ruler) -> Result<Self, GridError> {
        let grid = |cells| Grid::new(learned.bounds.min, learned.bounds.max, cells);
        Ok(Self {
            learned,
            smallest: ruler.smallest_component,
            within: ruler.within,
            truth: ruler.normalisation,
            fine: grid(ruler.resolution)?,
            coarse: grid(ruler.resolution.min(COARSE))?,
            anchor: None,
        })
    }

    /// The zero set of the method's field; `None` where it is empty.
    fn extracted(&self, grid: &Grid, time: f64) -> Result<Option<Mesh<f32>>, FramesError> {
        match self
            .learned
            .surface_at(grid, self.of_run(time), self.smallest, &mut |_| {})
        {
            Ok(found) => Ok(Some(found.mesh)),
            // The field has one sign in the whole box: the surface has vanished.
            Err(FramesError::Extract {
                reason: ExtractError::NoSurface { .. },
                ..
            }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The coarse surface of a time not far from `time`, carried there.
    fn near_anchor(&mut self, time: f64) -> Result<Option<Mesh<f32>>, FramesError> {
        let near = (time * ANCHORS).round() / ANCHORS;
        let known = self.anchor.take().filter(|(at, _)| *at == near);
        let mesh = match known {
            Some((_, mesh)) => mesh,
            None => self.extracted(&self.coarse, near)?,
        };
        self.anchor = Some((near, mesh.clone()));
        let Some(mut mesh) = mesh else {
            return Ok(None);
        };
        if time != near {
            let [near, time] = [near, time].map(|time| self.of_run(time));
            mesh.vertices = self.learned.carry(&mesh.vertices, near, time)?;
        }
        Ok(Some(mesh))
    }

    /// A time between the ends, 0 to 1, as the run counts.
    fn of_run(&self, time: f64) -> f64 {
        let [from, to] = self.within;
        if time == 1.0 {
            to
        } else {
            from + time * (to - from)
        }
    }

    /// From the method's coordinates to those of the truth.
    fn measured(&self, points: Vec<[f32; 3]>, time: f64) -> Vec<[f32; 3]> {
        if self.is_frame_of_truth() {
            return points;
        }
        let place = self.learned.coordinates.at(self.of_run(time));
        let measured = |x| self.truth.apply(place.invert(x));
        points.into_iter().map(measured).collect()
    }

    /// From the coordinates of the truth to the method's.
    fn learnt(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        if self.is_frame_of_truth() {
            return points.to_vec();
        }
        let place = self.learned.coordinates.at(self.of_run(time));
        let learnt = |x: &[f32; 3]| place.apply(self.truth.invert(*x));
        points.iter().map(learnt).collect()
    }

    /// Whether the method's coordinates are those of the truth at all times.
    fn is_frame_of_truth(&self) -> bool {
        let coordinates = &self.learned.coordinates;
        coordinates.placements.is_empty() && coordinates.normalisation == self.truth
    }
}

impl Candidate for Measured<'_> {
    type Error = FramesError;

    /// The zero set of the method's field, where it is not empty; a method that only carries the source's
    /// mesh has no surface beside that one.
    fn surface(&mut self, time: f64, purpose: Purpose) -> Result<Option<Mesh<f64>>, FramesError> {
        if self.learned.deformation.field().is_none() {
            return Ok(None);
        }
        let mesh = match purpose {
            Purpose::Aligning if self.learned.surface_is_carried() => self.near_anchor(time)?,
            Purpose::Aligning => self.extracted(&self.coarse, time)?,
            Purpose::Measured => self.extracted(&self.fine, time)?,
        };
        let measured = |mesh: Mesh<f32>| {
            let vertices = self.measured(mesh.vertices, time);
            Mesh::of_points(&vertices, &mesh.triangles)
        };
        Ok(mesh.map(measured))
    }

    fn carried(
        &mut self,
        start: &[[f32; 3]],
        times: &[f64],
    ) -> Result<Option<Carried>, FramesError> {
        if self.learned.deformation.motion().is_none() {
            return Ok(None);
        }
        let of_run: Vec<f64> = times.iter().map(|time| self.of_run(*time)).collect();
        let start = self.learnt(start, 0.0);
        let path = self.learned.path_from(&start, self.within[0], &of_run)?;
        let path = path.into_iter().zip(times);
        Ok(Some(
            path.map(|(at, time)| self.measured(at, *time)).collect(),
        ))
    }

    fn slope_error(&mut self, points: &[[f32; 3]], time: f64) -> Result<Option<f64>, FramesError> {
        Ok(self
            .learned
            .slope_error(&self.learnt(points, time), self.of_run(time)))
    }
}

/// Measures a method against a reference, and reports how far that has come.
///
/// # Errors
/// Of kind [`Interruption`](crate::ErrorKind::Interruption) if it was stopped; else what keeps the method
/// from being measured: a field that is not finite, for one.
pub(super) fn measure(
    learned: &Learned,
    ruler: &Ruler,
    on_event: &mut dyn FnMut(&Event),
) -> Result<Evaluation> {
    let mut measured = Measured::new(learned, ruler)?;
    let result = ruler.reference.evaluate(&mut measured, |done, total| {
        on_event(&Event::Measuring { done, total });
        if ruler.stop.is_set() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    result.map_err(|error| match error {
        EvaluateError::Stopped { .. } => Error::interruption(error.to_string()),
        _ => Error::failure(error),
    })
}

#[cfg(test)]
mod tests {
    use isomorph_training::deformation::{CarriedField, PointMotion, SurfaceField};

    use super::*;
    use crate::surface::learned::testing::Given;

    /// A ball of radius 0.3 about `(0.4 t - 0.2, 0, 0)`.
    struct Ball {
        /// Whether it says that a flow carries it.
        says: bool,
    }

    /// Along the first axis by `0.4 span`.
    fn moved([x, y, z]: &[f32; 3], span: f64) -> [f32; 3] {
        [x + (0.4 * span) as f32, *y, *z]
    }

    impl CarriedField for Ball {
        fn tolerance(&self) -> f64 {
            1e-3
        }

        fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
            let ends = |x: &[f32; 3]| {
                let ([a, b, c], [d, e, f]) = (moved(x, -time), moved(x, 1.0 - time));
                [a, b, c, d, e, f]
            };
            points.iter().map(ends).collect()
        }

        fn values_from(&self, ends: &[[f32; 6]], _: f64) -> Vec<f32> {
            let value = |[x, y, z, ..]: &[f32; 6]| {
                let [x, y, z] = moved(&[*x, *y, *z], 0.5);
                (x * x + y * y + z * z).sqrt() - 0.3
            };
            ends.iter().map(value).collect()
        }
    }

    impl SurfaceField for Ball {
        fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
            self.values_from(&self.ends(points, time), time)
        }

        fn gradients(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }

        fn carried(&self) -> Option<&dyn CarriedField> {
            self.says.then_some(self)
        }
    }

    struct Right;

    impl PointMotion for Right {
        fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
            points.iter().map(|x| moved(x, to - from)).collect()
        }

        fn path(&self, start: &[[f32; 3]], times: &[f64]) -> Vec<Vec<[f32; 3]>> {
            let at = |time: &f64| self.carry(start, 0.0, *time);
            times.iter().map(at).collect()
        }

        fn velocities(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            vec![[0.4, 0.0, 0.0]; points.len()]
        }
    }

    /// The least and the greatest first coordinate of the surface to align with, at times in turn.
    fn reach(says: bool, times: &[f64]) -> Vec<[f64; 2]> {
        let learned = Learned::of(Given {
            field: Some(Ball { says }),
            motion: Some(Right),
        });
        let grid = |cells| Grid::new(learned.bounds.min, learned.bounds.max, cells);
        let mut measured = Measured {
            learned: &learned,
            smallest: 0.0,
            within: [0.0, 1.0],
            truth: learned.coordinates.normalisation,
            fine: grid(64).expect("a good grid"),
            coarse: grid(COARSE).expect("a good grid"),
            anchor: None,
        };
        let reach = times.iter().map(|time| {
            let mesh = measured.surface(*time, Purpose::Aligning);
            let mesh = mesh.expect("no failure").expect("a surface");
            let first = mesh.vertices.iter().map(|x| x[0]);
            let widest = |[least, most]: [f64; 2], x: f64| [least.min(x), most.max(x)];
            first.fold([f64::INFINITY, f64::NEG_INFINITY], widest)
        });
        reach.collect()
    }

    #[test]
    fn surfaces_to_align_with_are_where_the_shape_is_between_anchors_too() {
        // On an anchor, to either side of one, across the middle between two, and back.
        let times = [0.5, 0.52, 0.54, 0.0, 1.0, 0.47];
        for says in [true, false] {
            for ([least, most], time) in reach(says, &times).into_iter().zip(times) {
                let centre = 0.4 * time - 0.2;
                // The poles lie within a coarse cell's chord of vertices: (1.4 / 48)^2 / (8 * 0.3).
                assert!((least - (centre - 0.3)).abs() < 1e-3, "{time}: {least}");
                assert!((most - (centre + 0.3)).abs() < 1e-3, "{time}: {most}");
            }
        }
    }
}
