//! A trained method at any time: its surface, the slope of its field, and where its motion takes points.

use std::convert::Infallible;

use burn::tensor::{Tensor, backend::Backend};
use isomorph_model::operators::length;
use isomorph_model::{Carried, Geometry, ModelBackend, Motion};

use super::chunks::in_chunks;
use super::error::{FramesError, no_motion};
use super::flow_map::{FlowMap, first_stride};
use crate::cubes::{Extraction, Grid, extract};
use crate::geometry::{Bounds, Mesh};
use crate::shape::Normalisation;
use crate::tensors::{host, rows};

/// The most vertices at which an interpolated flow is compared with the flow itself.
const CHECKED: usize = 1000;

/// What was trained and the frame that it lives in.
pub struct Trained<B: Backend> {
    /// What gives the surface.
    pub shape: Surface<B>,
    /// What moves points, if the method has it.
    pub motion: Option<Box<dyn Motion<B>>>,
    /// From the user's coordinates to the networks'.
    pub normalisation: Normalisation,
    /// The box in which the surface is looked for, normalised.
    pub bounds: Bounds,
    /// Pieces with less than this share of a surface's area are left out; 0 keeps all.
    pub smallest_component: f64,
    /// Where tensors live.
    pub device: B::Device,
}

/// Where the surface of a time comes from.
pub enum Surface<B: Backend> {
    /// The zero set of a field.
    Field(Box<dyn Geometry<B>>),
    /// A mesh at time 0, normalised, that the motion carries: of methods that have no field.
    Template(Mesh<f32>),
}

/// A surface found at a time.
#[derive(Clone, Debug)]
pub struct Found {
    /// In normalised coordinates.
    pub mesh: Mesh<f32>,
    /// Its connected pieces.
    pub components: usize,
    /// Pieces that were too small to be kept.
    pub left_out: usize,
    /// Whether the box cuts it off.
    pub touches_box: bool,
    /// The share of the grid's nodes at which the field was evaluated.
    pub evaluated: f64,
}

impl<B: ModelBackend> Trained<B> {
    /// The surface at a time.
    ///
    /// # Errors
    /// [`FramesError`] if the field is not finite there, or has too many cells; [`FramesError::NoMotion`].
    pub fn surface_at(&self, grid: &Grid, time: f64) -> Result<Found, FramesError> {
        let geometry = match &self.shape {
            Surface::Field(geometry) => geometry,
            Surface::Template(mesh) => {
                let mut mesh = mesh.clone();
                mesh.vertices = self.path(&mesh.vertices, &[time])?.remove(0);
                return Ok(Found {
                    components: mesh.components().len(),
                    mesh,
                    left_out: 0,
                    touches_box: false,
                    evaluated: 0.0,
                });
            }
        };
        let found = match geometry.carried() {
            Some(carried) => self.interpolated(carried, grid, time)?,
            None => None,
        };
        let found = match found {
            Some(found) => found,
            None => self.zero_set(geometry.as_ref(), grid, time)?,
        };
        let (mesh, components, all) = found.mesh.keep_at_least(self.smallest_component);
        Ok(Found {
            mesh,
            components,
            left_out: all - components,
            touches_box: found.touches_box,
            evaluated: found.evaluated as f64 / found.grid_points as f64,
        })
    }

    /// The zero set of a field.
    fn zero_set(
        &self,
        geometry: &dyn Geometry<B>,
        grid: &Grid,
        time: f64,
    ) -> Result<Extraction, FramesError> {
        let field = |points: &[[f32; 3]]| {
            let values = in_chunks::<B, _, _>(points, |chunk| {
                let t = Tensor::full([chunk.len(), 1], time, &self.device);
                host(geometry.value(rows(chunk, &self.device), t))
            });
            Ok::<_, Infallible>(values.concat())
        };
        extract(field, grid).map_err(|reason| FramesError::Extract { time, reason })
    }

    /// The zero set of a field that a flow carries, which is followed at as few points as will do; `None`
    /// if that is every node of the grid.
    fn interpolated(
        &self,
        carried: &dyn Carried<B>,
        grid: &Grid,
        time: f64,
    ) -> Result<Option<Extraction>, FramesError> {
        let mut stride = first_stride(grid);
        while stride > 1 {
            let mut map = FlowMap::new(carried, time, &self.device, grid, stride);
            let found = extract(|points| Ok::<_, Infallible>(map.values(points)), grid)
                .map_err(|reason| FramesError::Extract { time, reason })?;
            if map.is_close_at(&some_of(&found.mesh.vertices, CHECKED)) {
                return Ok(Some(found));
            }
            stride /= 2;
        }
        Ok(None)
    }

    /// Unit normals of a surface, and the mean of `||grad f| - 1|` over its vertices where it is the zero
    /// set of a field `f`.
    pub(super) fn normals(&self, mesh: &Mesh<f32>, time: f64) -> (Vec<[f32; 3]>, Option<f64>) {
        let Some(gradients) = self.gradients(&mesh.vertices, time) else {
            return (mesh.vertex_normals(), None);
        };
        let mut normals = Vec::with_capacity(gradients.len());
        let mut off = 0.0;
        for [x, y, z, slope] in &gradients {
            normals.push([x / slope, y / slope, z / slope]);
            off += (f64::from(*slope) - 1.0).abs();
        }
        (normals, Some(off / gradients.len().max(1) as f64))
    }

    /// The mean of `||grad f| - 1|` at points, normalised; `None` without a field.
    pub fn slope_error(&self, points: &[[f32; 3]], time: f64) -> Option<f64> {
        let gradients = self.gradients(points, time)?;
        let off: f64 = gradients
            .iter()
            .map(|[_, _, _, slope]| (f64::from(*slope) - 1.0).abs())
            .sum();
        Some(off / gradients.len().max(1) as f64)
    }

    /// `grad f` and its length at points.
    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Option<Vec<[f32; 4]>> {
        let Surface::Field(geometry) = &self.shape else {
            return None;
        };
        let pieces = in_chunks::<B, _, _>(points, |chunk| {
            let t = Tensor::full([chunk.len(), 1], time, &self.device);
            let gradient = geometry.gradient(rows(chunk, &self.device), t);
            host(Tensor::cat(vec![gradient.clone(), length(gradient)], 1))
        });
        Some(pieces.concat().as_chunks::<4>().0.to_vec())
    }

    /// Where points that are at `points` at time `from` are at time `to`, normalised.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub fn carry(
        &self,
        points: &[[f32; 3]],
        from: f64,
        to: f64,
    ) -> Result<Vec<[f32; 3]>, FramesError> {
        let motion = self.motion.as_ref().ok_or_else(no_motion)?;
        let pieces = in_chunks::<B, _, _>(points, |chunk| {
            host(motion.carry(rows(chunk, &self.device), from, to))
        });
        Ok(pieces.concat().as_chunks::<3>().0.to_vec())
    }

    /// Whether the surface moves with the motion by what it is, not by what was learnt.
    pub fn surface_is_carried(&self) -> bool {
        match &self.shape {
            Surface::Field(geometry) => geometry.carried().is_some() && self.motion.is_some(),
            Surface::Template(_) => true,
        }
    }

    /// Positions at ascending times of points that are at `start` at time 0, normalised.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub fn path(
        &self,
        start: &[[f32; 3]],
        times: &[f64],
    ) -> Result<Vec<Vec<[f32; 3]>>, FramesError> {
        let motion = self.motion.as_ref().ok_or_else(no_motion)?;
        let pieces = in_chunks::<B, _, _>(start, |chunk| {
            let positions = motion.path(rows(chunk, &self.device), times);
            positions.into_iter().map(host).collect::<Vec<_>>()
        });
        let mut path = vec![Vec::with_capacity(start.len()); times.len()];
        for piece in pieces {
            for (whole, part) in path.iter_mut().zip(piece) {
                whole.extend_from_slice(part.as_chunks::<3>().0);
            }
        }
        Ok(path)
    }
}

/// At most so many of the points, evenly spread over their order.
pub(super) fn some_of(points: &[[f32; 3]], most: usize) -> Vec<[f32; 3]> {
    let apart = points.len().div_ceil(most).max(1);
    points.iter().step_by(apart).copied().collect()
}

#[cfg(test)]
impl Trained<burn_ndarray::NdArray> {
    /// A field in a box of half-width 0.7 about the origin, in coordinates of its own; no piece is left out.
    pub fn of_field(geometry: impl Geometry<burn_ndarray::NdArray> + 'static) -> Self {
        Self {
            shape: Surface::Field(Box::new(geometry)),
            motion: None,
            normalisation: Normalisation {
                centre: [0.0; 3],
                scale: 1.0,
            },
            bounds: Bounds {
                min: [-0.7; 3],
                max: [0.7; 3],
            },
            smallest_component: 0.0,
            device: Default::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use burn_ndarray::NdArray;

    use super::*;

    type Points = Tensor<NdArray, 2>;

    /// Balls of radius 0.4 and 0.05, 0.55 apart.
    struct Balls;

    impl Geometry<NdArray> for Balls {
        fn value(&self, x: Points, _: Points) -> Points {
            let ball = |at: f64, radius: f64| {
                let centre = Tensor::<NdArray, 1>::from_floats([at, 0.0, 0.0], &x.device());
                length(x.clone() - centre.unsqueeze()) - radius
            };
            ball(0.0, 0.4).min_pair(ball(0.55, 0.05))
        }
    }

    #[test]
    fn pieces_below_the_share_are_left_out_and_counted() {
        let mut trained = Trained {
            smallest_component: 0.02,
            ..Trained::of_field(Balls)
        };
        let grid = Grid::new(trained.bounds.min, trained.bounds.max, 64).expect("a good grid");
        let found = trained.surface_at(&grid, 0.0).expect("a surface");
        // The area of the small one is 1.5 % of both.
        assert_eq!((found.components, found.left_out), (1, 1));
        let reach = found.mesh.vertices.iter().map(|x| x[0]).fold(0.0, f32::max);
        assert!(reach < 0.45, "{reach}");
        trained.smallest_component = 0.01;
        let found = trained.surface_at(&grid, 0.0).expect("a surface");
        assert_eq!((found.components, found.left_out), (2, 0));
    }
}
