//! A trained method as the evaluation asks for it, and how it is measured.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use isomorph_model::ModelBackend;

use crate::cubes::{ExtractError, Grid, GridError};
use crate::evaluate::{Candidate, Carried, EvaluateError, Evaluation, Purpose, Reference};
use crate::geometry::Mesh;
use crate::shape::Normalisation;
use crate::surface::FramesError;
use crate::surface::trained::{Surface, Trained};

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
    /// Set to stop.
    pub stop: &'a AtomicBool,
}

/// A method with the grids on which its surfaces are found.
struct Measured<'a, B: ModelBackend> {
    trained: &'a Trained<B>,
    truth: Normalisation,
    fine: Grid,
    coarse: Grid,
    /// The coarse surface extracted last, in the method's coordinates, and its time; no mesh if it had
    /// vanished.
    anchor: Option<(f64, Option<Mesh<f32>>)>,
}

impl<'a, B: ModelBackend> Measured<'a, B> {
    fn new(trained: &'a Trained<B>, ruler: &Ruler) -> Result<Self, GridError> {
        let grid = |cells| Grid::new(trained.bounds.min, trained.bounds.max, cells);
        Ok(Self {
            trained,
            truth: ruler.normalisation,
            fine: grid(ruler.resolution)?,
            coarse: grid(ruler.resolution.min(COARSE))?,
            anchor: None,
        })
    }

    /// The zero set of the method's field; `None` where it is empty.
    fn extracted(&self, grid: &Grid, time: f64) -> Result<Option<Mesh<f32>>, FramesError> {
        match self.trained.surface_at(grid, time) {
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
            mesh.vertices = self.trained.carry(&mesh.vertices, near, time)?;
        }
        Ok(Some(mesh))
    }

    /// From the method's coordinates to those of the truth.
    fn measured(&self, points: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        between(&self.trained.normalisation, &self.truth, points)
    }

    /// From the coordinates of the truth to the method's.
    fn learnt(&self, points: &[[f32; 3]]) -> Vec<[f32; 3]> {
        between(&self.truth, &self.trained.normalisation, points.to_vec())
    }
}

/// Points of one frame in another.
fn between(from: &Normalisation, to: &Normalisation, points: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
    if from == to {
        return points;
    }
    let points = points.into_iter();
    points.map(|point| to.apply(from.invert(point))).collect()
}

impl<B: ModelBackend> Candidate for Measured<'_, B> {
    type Error = FramesError;

    /// The zero set of the method's field, where it is not empty; a method that only carries the source's
    /// mesh has no surface beside that one.
    fn surface(&mut self, time: f64, purpose: Purpose) -> Result<Option<Mesh<f64>>, FramesError> {
        if matches!(self.trained.shape, Surface::Template(_)) {
            return Ok(None);
        }
        let mesh = match purpose {
            Purpose::Aligning if self.trained.surface_is_carried() => self.near_anchor(time)?,
            Purpose::Aligning => self.extracted(&self.coarse, time)?,
            Purpose::Measured => self.extracted(&self.fine, time)?,
        };
        let measured = |mesh: Mesh<f32>| {
            let vertices = self.measured(mesh.vertices);
            Mesh::of_points(&vertices, &mesh.triangles)
        };
        Ok(mesh.map(measured))
    }

    fn carried(
        &mut self,
        start: &[[f32; 3]],
        times: &[f64],
    ) -> Result<Option<Carried>, FramesError> {
        if self.trained.motion.is_none() {
            return Ok(None);
        }
        let path = self.trained.path(&self.learnt(start), times)?;
        Ok(Some(path.into_iter().map(|at| self.measured(at)).collect()))
    }

    fn slope_error(&mut self, points: &[[f32; 3]], time: f64) -> Result<Option<f64>, FramesError> {
        Ok(self.trained.slope_error(&self.learnt(points), time))
    }
}

/// Measures a method against a reference, with a bar on the terminal; `None` if it was stopped.
///
/// # Errors
/// What keeps the method from being measured: a field that is not finite, for one.
pub(super) fn measure<B: ModelBackend>(
    trained: &Trained<B>,
    ruler: &Ruler,
) -> Result<Option<Evaluation>> {
    let mut measured = Measured::new(trained, ruler)?;
    let bar = ProgressBar::new(ruler.reference.frames().len() as u64);
    let style =
        ProgressStyle::with_template("{pos:>4}/{len} [{bar:16}] {msg}, {elapsed}, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let result = ruler.reference.evaluate(&mut measured, |done, _| {
        bar.set_message(if done == 0 { "aligning" } else { "measuring" });
        bar.set_position(done as u64);
        if ruler.stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    bar.finish_and_clear();
    match result {
        Ok(evaluation) => Ok(Some(evaluation)),
        Err(EvaluateError::Stopped { .. }) => Ok(None),
        Err(error) => Err(anyhow::anyhow!("{error}")),
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::Tensor;
    use burn_ndarray::NdArray;
    use isomorph_model::{Carried as CarriedGeometry, Geometry, Motion};

    use super::*;

    type Points = Tensor<NdArray, 2>;

    /// A ball of radius 0.3 about `(0.4 t - 0.2, 0, 0)`.
    struct Ball {
        /// Whether it says that a flow carries it.
        says: bool,
    }

    /// Along the first axis by `0.4 span`.
    fn moved(x: Points, span: f64) -> Points {
        let by = Tensor::<NdArray, 1>::from_floats([0.4 * span, 0.0, 0.0], &x.device());
        x + by.unsqueeze()
    }

    impl CarriedGeometry<NdArray> for Ball {
        fn tolerance(&self) -> f64 {
            1e-3
        }

        fn ends(&self, x: Points, time: f64) -> Points {
            Tensor::cat(vec![moved(x.clone(), -time), moved(x, 1.0 - time)], 1)
        }

        fn value_from(&self, ends: Points, _: f64) -> Points {
            let start = ends.clone().slice([0..ends.dims()[0], 0..3]);
            moved(start, 0.5).square().sum_dim(1).sqrt() - 0.3
        }
    }

    impl Geometry<NdArray> for Ball {
        fn value(&self, x: Points, t: Points) -> Points {
            let time = f64::from(t.into_data().iter::<f32>().next().unwrap_or(0.0));
            self.value_from(self.ends(x, time), time)
        }

        fn carried(&self) -> Option<&dyn CarriedGeometry<NdArray>> {
            self.says.then_some(self)
        }
    }

    struct Right;

    impl Motion<NdArray> for Right {
        fn carry(&self, x: Points, from: f64, to: f64) -> Points {
            moved(x, to - from)
        }
    }

    /// The least and the greatest first coordinate of the surface to align with, at times in turn.
    fn reach(says: bool, times: &[f64]) -> Vec<[f64; 2]> {
        let trained = Trained {
            motion: Some(Box::new(Right)),
            ..Trained::of_field(Ball { says })
        };
        let grid = |cells| Grid::new(trained.bounds.min, trained.bounds.max, cells);
        let mut measured = Measured {
            trained: &trained,
            truth: trained.normalisation,
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
