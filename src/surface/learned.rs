//! What was learned, at any time: its surface, the slope of its field, and where its motion takes points.

use std::convert::Infallible;

use isomorph_training::deformation::{CarriedField, Deformation, PointMotion, SurfaceField};

use super::error::{FramesError, no_motion};
use super::flow_map::{FlowMap, first_stride};
use crate::cubes::{Extraction, Grid, extract};
use crate::geometry::Mesh;
use crate::shape::{Bounds, Coordinates};

/// The most vertices at which an interpolated flow is compared with the flow itself.
const CHECKED: usize = 1000;

/// What was learned and the frame that it lives in.
pub(crate) struct Learned {
    /// The field and the motion, each if the method has one.
    pub deformation: Box<dyn Deformation>,
    /// A mesh at time 0, normalised, that the motion carries: of methods that have no field.
    pub template: Option<Mesh<f32>>,
    /// The user's coordinates and the networks'.
    pub coordinates: Coordinates,
    /// The box in which the surface is looked for, normalised.
    pub bounds: Bounds,
}

/// A surface found at a time.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// In normalised coordinates.
    pub mesh: Mesh<f32>,
    /// Its connected pieces.
    pub components: usize,
    /// Pieces that were too small to be kept.
    pub left_out: usize,
    /// Whether the box cuts it off.
    pub touches_box: bool,
}

impl Learned {
    /// The surface at a time. Pieces with less than the share `smallest` of its area are left out;
    /// `progress` is given the number of places evaluated so far.
    ///
    /// # Errors
    /// [`FramesError`] if the field is not finite there, or has too many cells; [`FramesError::NoMotion`].
    pub(crate) fn surface_at(
        &self,
        grid: &Grid,
        time: f64,
        smallest: f64,
        progress: &mut dyn FnMut(usize),
    ) -> Result<Found, FramesError> {
        let Some(field) = self.deformation.field() else {
            return self.carried_template(time);
        };
        let found = match field.carried() {
            Some(carried) => interpolated(carried, grid, time, progress)?,
            None => None,
        };
        let found = match found {
            Some(found) => found,
            None => zero_set(field, grid, time, progress)?,
        };
        let (mesh, components, all) = found.mesh.keep_at_least(smallest);
        Ok(Found {
            mesh,
            components,
            left_out: all - components,
            touches_box: found.touches_box,
        })
    }

    /// The layer at a time that is `offset` off the surface, in the user's unit, negative inside: where the
    /// field has this value. Pieces with less than the share `smallest` of its area are left out.
    ///
    /// # Errors
    /// [`FramesError::NoField`], [`FramesError::Layer`] and [`FramesError::LayerCutOff`].
    pub(crate) fn layer_at(
        &self,
        grid: &Grid,
        time: f64,
        offset: f64,
        smallest: f64,
    ) -> Result<Mesh<f32>, FramesError> {
        let field = self.deformation.field().ok_or(FramesError::NoField)?;
        let level = self.coordinates.at(time).apply_length(offset) as f32;
        let off = |points: &[[f32; 3]]| {
            let mut values = field.values(points, time);
            values.iter_mut().for_each(|value| *value -= level);
            Ok::<_, Infallible>(values)
        };
        let found = extract(off, grid);
        let found = found.map_err(|reason| FramesError::Layer {
            time,
            offset,
            reason,
        })?;
        if found.touches_box {
            return Err(FramesError::LayerCutOff { time, offset });
        }
        Ok(found.mesh.keep_at_least(smallest).0)
    }

    /// The template where the motion takes it.
    fn carried_template(&self, time: f64) -> Result<Found, FramesError> {
        let mut mesh = self.template.clone().ok_or_else(no_motion)?;
        mesh.vertices = self.path(&mesh.vertices, &[time])?.remove(0);
        Ok(Found {
            components: mesh.components().len(),
            mesh,
            left_out: 0,
            touches_box: false,
        })
    }

    /// Unit normals of a surface, and the mean of `||grad f| - 1|` over its vertices where it is the zero
    /// set of a field `f`.
    pub(crate) fn normals(&self, mesh: &Mesh<f32>, time: f64) -> (Vec<[f32; 3]>, Option<f64>) {
        let Some(field) = self.deformation.field() else {
            return (mesh.vertex_normals(), None);
        };
        let gradients = field.gradients(&mesh.vertices, time);
        let unit = |gradient: &[f32; 3]| {
            let slope = length(gradient);
            gradient.map(|part| part / slope)
        };
        let normals = gradients.iter().map(unit).collect();
        (normals, Some(mean_slope_error(&gradients)))
    }

    /// The mean of `||grad f| - 1|` at points, normalised; `None` without a field.
    pub(crate) fn slope_error(&self, points: &[[f32; 3]], time: f64) -> Option<f64> {
        let field = self.deformation.field()?;
        Some(mean_slope_error(&field.gradients(points, time)))
    }

    /// The motion.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub(crate) fn motion(&self) -> Result<&dyn PointMotion, FramesError> {
        self.deformation.motion().ok_or_else(no_motion)
    }

    /// Where points that are at `points` at time `from` are at time `to`, normalised.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub(crate) fn carry(
        &self,
        points: &[[f32; 3]],
        from: f64,
        to: f64,
    ) -> Result<Vec<[f32; 3]>, FramesError> {
        Ok(self.motion()?.carry(points, from, to))
    }

    /// Whether the surface moves with the motion by what it is, not by what was learned.
    pub(crate) fn surface_is_carried(&self) -> bool {
        let moves = self.deformation.motion().is_some();
        match self.deformation.field() {
            Some(field) => field.carried().is_some() && moves,
            None => true,
        }
    }

    /// Positions at ascending times of points that are at `start` at time 0, normalised.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub(crate) fn path(
        &self,
        start: &[[f32; 3]],
        times: &[f64],
    ) -> Result<Vec<Vec<[f32; 3]>>, FramesError> {
        Ok(self.motion()?.path(start, times))
    }

    /// Positions at ascending times of points that are at `start` at time `from`, normalised.
    ///
    /// # Errors
    /// [`FramesError::NoMotion`] if the method moves no points.
    pub(crate) fn path_from(
        &self,
        start: &[[f32; 3]],
        from: f64,
        times: &[f64],
    ) -> Result<Vec<Vec<[f32; 3]>>, FramesError> {
        if from == 0.0 {
            return self.path(start, times);
        }
        let after = times.partition_point(|time| *time < from);
        let mut path = vec![Vec::new(); times.len()];
        // Away from the shape both ways, each time from the one before.
        let (back, on) = ((0..after).rev(), after..times.len());
        for order in [back.collect::<Vec<_>>(), on.collect()] {
            let (mut at, mut now) = (start.to_vec(), from);
            for k in order {
                at = self.carry(&at, now, times[k])?;
                now = times[k];
                path[k].clone_from(&at);
            }
        }
        Ok(path)
    }
}

/// The zero set of a field.
fn zero_set(
    field: &dyn SurfaceField,
    grid: &Grid,
    time: f64,
    progress: &mut dyn FnMut(usize),
) -> Result<Extraction, FramesError> {
    counted(|points| field.values(points, time), grid, time, progress)
}

/// The zero set of a field that a flow carries, which is followed at as few points as will do; `None`
/// if that is every node of the grid.
fn interpolated(
    carried: &dyn CarriedField,
    grid: &Grid,
    time: f64,
    progress: &mut dyn FnMut(usize),
) -> Result<Option<Extraction>, FramesError> {
    let mut stride = first_stride(grid);
    while stride > 1 {
        let mut map = FlowMap::new(carried, time, grid, stride);
        let found = counted(|points| map.values(points), grid, time, progress)?;
        if map.is_close_at(&some_of(&found.mesh.vertices, CHECKED)) {
            return Ok(Some(found));
        }
        stride /= 2;
    }
    Ok(None)
}

/// The zero set of what has these values, with a report of how many were taken so far.
fn counted(
    mut values: impl FnMut(&[[f32; 3]]) -> Vec<f32>,
    grid: &Grid,
    time: f64,
    progress: &mut dyn FnMut(usize),
) -> Result<Extraction, FramesError> {
    let mut taken = 0;
    let field = |points: &[[f32; 3]]| {
        let found = values(points);
        taken += points.len();
        progress(taken);
        Ok::<_, Infallible>(found)
    };
    extract(field, grid).map_err(|reason| FramesError::Extract { time, reason })
}

fn length(vector: &[f32; 3]) -> f32 {
    vector.iter().map(|part| part * part).sum::<f32>().sqrt()
}

fn mean_slope_error(gradients: &[[f32; 3]]) -> f64 {
    let off = |gradient: &[f32; 3]| (f64::from(length(gradient)) - 1.0).abs();
    gradients.iter().map(off).sum::<f64>() / gradients.len().max(1) as f64
}

/// At most so many of the points, evenly spread over their order.
pub(crate) fn some_of(points: &[[f32; 3]], most: usize) -> Vec<[f32; 3]> {
    let apart = points.len().div_ceil(most).max(1);
    points.iter().step_by(apart).copied().collect()
}

#[cfg(test)]
pub(crate) mod testing {
    use super::*;
    use crate::shape::Normalisation;

    /// A field and a motion given by the test.
    pub(crate) struct Given<F, M> {
        pub field: Option<F>,
        pub motion: Option<M>,
    }

    impl<F: SurfaceField + Send, M: PointMotion + Send> Deformation for Given<F, M> {
        fn field(&self) -> Option<&dyn SurfaceField> {
            self.field.as_ref().map(|field| field as &dyn SurfaceField)
        }

        fn motion(&self) -> Option<&dyn PointMotion> {
            let motion = self.motion.as_ref();
            motion.map(|motion| motion as &dyn PointMotion)
        }
    }

    /// Nothing moves.
    pub(crate) struct Still;

    impl PointMotion for Still {
        fn carry(&self, points: &[[f32; 3]], _: f64, _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }

        fn path(&self, start: &[[f32; 3]], times: &[f64]) -> Vec<Vec<[f32; 3]>> {
            vec![start.to_vec(); times.len()]
        }

        fn velocities(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            vec![[0.0; 3]; points.len()]
        }
    }

    impl Learned {
        /// A field in a box of half-width 0.7 about the origin, in coordinates of its own; no piece is left
        /// out.
        pub(crate) fn of_field(field: impl SurfaceField + Send + 'static) -> Self {
            Self::of(Given {
                field: Some(field),
                motion: None::<Still>,
            })
        }

        /// The same of a field and a motion.
        pub(crate) fn of(deformation: impl Deformation + 'static) -> Self {
            Self {
                deformation: Box::new(deformation),
                template: None,
                coordinates: Coordinates::as_given(Normalisation {
                    centre: [0.0; 3],
                    scale: 1.0,
                }),
                bounds: Bounds {
                    min: [-0.7; 3],
                    max: [0.7; 3],
                },
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Balls of radius 0.4 and 0.05, 0.55 apart.
    struct Balls;

    impl SurfaceField for Balls {
        fn values(&self, points: &[[f32; 3]], _: f64) -> Vec<f32> {
            let ball = |[x, y, z]: [f32; 3], at: f32, radius: f32| length(&[x - at, y, z]) - radius;
            let value = |x: &[f32; 3]| ball(*x, 0.0, 0.4).min(ball(*x, 0.55, 0.05));
            points.iter().map(value).collect()
        }

        fn gradients(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }
    }

    #[test]
    fn pieces_below_the_share_are_left_out_and_counted() {
        let learned = Learned::of_field(Balls);
        let grid = Grid::new(learned.bounds.min, learned.bounds.max, 64).expect("a good grid");
        let mut evaluated = 0;
        let found = learned.surface_at(&grid, 0.0, 0.02, &mut |taken| evaluated = taken);
        let found = found.expect("a surface");
        assert!(evaluated > 1000, "{evaluated} nodes were reported");
        // The area of the small one is 1.5 % of both.
        assert_eq!((found.components, found.left_out), (1, 1));
        let reach = found.mesh.vertices.iter().map(|x| x[0]).fold(0.0, f32::max);
        assert!(reach < 0.45, "{reach}");
        let found = learned.surface_at(&grid, 0.0, 0.01, &mut |_| {});
        let found = found.expect("a surface");
        assert_eq!((found.components, found.left_out), (2, 0));
    }

    #[test]
    fn normals_are_unit_gradients_and_their_length_is_the_slope_error() {
        let learned = Learned::of_field(Balls);
        let mesh = Mesh::new(vec![[0.4, 0.0, 0.0], [0.0, 0.0, -2.0]], Vec::new());
        let (normals, off) = learned.normals(&mesh, 0.0);
        assert_eq!(normals, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]);
        // Lengths 0.4 and 2, in f32.
        assert!((off.expect("a field") - 0.8).abs() < 1e-7, "{off:?}");
    }
}
