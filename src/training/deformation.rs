//! The border to what was trained: a field and a motion of points on the host, in normalised coordinates,
//! without the backend's type.
//!
//! `OnHost` takes points in chunks: on a processor as many as keep a layer's values in a core's cache, on
//! all cores; on a device as many as fit.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use isomorph_model::{Carried, Geometry, ModelBackend, Motion};

use crate::tensors::{host, rows};
use crate::workers::Workers;

/// What was trained: a surface of its own, a motion of points, or both.
pub trait Deformation: Send + Sync {
    /// The field whose zero set is the surface, if the method has one.
    fn field(&self) -> Option<&dyn SurfaceField>;

    /// The motion of points, if the method has one.
    fn motion(&self) -> Option<&dyn PointMotion>;
}

/// A field `f(x, t)` whose zero set at time `t` is the surface, negative inside.
pub trait SurfaceField: Sync {
    /// `f(x, t)` at each of the points.
    fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32>;

    /// `grad f(x, t)` at each of the points.
    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]>;

    /// The same field by where its points come from and go to, if that is what it is made of.
    fn carried(&self) -> Option<&dyn CarriedField> {
        None
    }
}

/// A field that a flow carries: `f(x, t)` follows from the positions at times 0 and 1 of what is at `x` at
/// `t`. These vary more smoothly than `f`, so they can be interpolated where many values are needed.
pub trait CarriedField: Sync {
    /// How far off the true positions may be, in normalised units, for all but one in twenty near the
    /// surface.
    fn tolerance(&self) -> f64;

    /// Positions at time 0, then at time 1, of what is at each of the points at `time`.
    fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]>;

    /// `f(x, time)` from what [`Self::ends`] gives for `x`.
    fn values_from(&self, ends: &[[f32; 6]], time: f64) -> Vec<f32>;
}

/// A motion of points from one time to another.
pub trait PointMotion: Sync {
    /// Where points that are at `points` at time `from` are at time `to`.
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]>;

    /// Positions at each of `times`, which ascend, of points that are at `start` at time 0: each from the one before.
    fn path(&self, start: &[[f32; 3]], times: &[f64]) -> Vec<Vec<[f32; 3]>> {
        let (mut at, mut now) = (start.to_vec(), 0.0);
        let mut next = |&time: &f64| {
            if time > now {
                at = self.carry(&at, now, time);
                now = time;
            }
            at.clone()
        };
        times.iter().map(&mut next).collect()
    }

    /// The velocity of points, normalised length per unit of time.
    fn velocities(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]>;
}

/// Points per evaluation of a network by one core: the values of a layer of 128 stay in its cache.
const HOST_CHUNK: usize = 1024;

/// Points per evaluation on a device where larger batches are only better.
const DEVICE_CHUNK: usize = 1 << 16;

/// Half the span of the central difference by which a motion without a velocity of its own gives one.
const DIFFERENCE: f64 = 1e-3;

/// A method's geometry and motion on a backend.
pub(crate) struct OnHost<B: Backend> {
    pub geometry: Option<Box<dyn Geometry<B>>>,
    pub motion: Option<Box<dyn Motion<B>>>,
    pub device: B::Device,
}

impl<B: ModelBackend> OnHost<B> {
    /// What `map` makes of each chunk of the rows, in their order.
    fn in_chunks<const N: usize, T: Send>(
        &self,
        rows_of: &[[f32; N]],
        map: impl Fn(Tensor<B, 2>) -> T + Sync,
    ) -> Vec<T> {
        let map = |chunk: &[[f32; N]]| map(rows(chunk, &self.device));
        if B::POINTS_AT_A_TIME.is_none() {
            return rows_of.chunks(DEVICE_CHUNK).map(map).collect();
        }
        let chunks: Vec<_> = rows_of.chunks(HOST_CHUNK).collect();
        Workers::shared().map(chunks.len(), |k| map(chunks[k]))
    }

    /// The same where each chunk becomes rows of `M`.
    fn rows_of<const N: usize, const M: usize>(
        &self,
        points: &[[f32; N]],
        map: impl Fn(Tensor<B, 2>) -> Tensor<B, 2> + Sync,
    ) -> Vec<[f32; M]> {
        let pieces = self.in_chunks(points, |chunk| host(map(chunk)));
        pieces.concat().as_chunks::<M>().0.to_vec()
    }

    fn values_of<const N: usize>(
        &self,
        points: &[[f32; N]],
        map: impl Fn(Tensor<B, 2>) -> Tensor<B, 2> + Sync,
    ) -> Vec<f32> {
        self.in_chunks(points, |chunk| host(map(chunk))).concat()
    }
}

/// A column of one time.
fn at<B: Backend>(x: &Tensor<B, 2>, time: f64) -> Tensor<B, 2> {
    Tensor::full([x.dims()[0], 1], time, &x.device())
}

impl<B: ModelBackend> Deformation for OnHost<B> {
    fn field(&self) -> Option<&dyn SurfaceField> {
        self.geometry.is_some().then_some(self)
    }

    fn motion(&self) -> Option<&dyn PointMotion> {
        self.motion.is_some().then_some(self)
    }
}

impl<B: ModelBackend> OnHost<B> {
    fn geometry(&self) -> &dyn Geometry<B> {
        let geometry = self.geometry.as_deref();
        geometry.expect("given out as a field only if there is one")
    }

    fn flow(&self) -> &dyn Carried<B> {
        let carried = self.geometry().carried();
        carried.expect("given out as a carried field only if it is one")
    }

    fn mover(&self) -> &dyn Motion<B> {
        let motion = self.motion.as_deref();
        motion.expect("given out as a motion only if there is one")
    }
}

impl<B: ModelBackend> SurfaceField for OnHost<B> {
    fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
        let geometry = self.geometry();
        self.values_of(points, |x| geometry.value(x.clone(), at(&x, time)))
    }

    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let geometry = self.geometry();
        self.rows_of(points, |x| geometry.gradient(x.clone(), at(&x, time)))
    }

    fn carried(&self) -> Option<&dyn CarriedField> {
        self.geometry().carried().is_some().then_some(self)
    }
}

impl<B: ModelBackend> CarriedField for OnHost<B> {
    fn tolerance(&self) -> f64 {
        self.flow().tolerance()
    }

    fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
        let flow = self.flow();
        self.rows_of(points, |x| flow.ends(x, time))
    }

    fn values_from(&self, ends: &[[f32; 6]], time: f64) -> Vec<f32> {
        let flow = self.flow();
        self.values_of(ends, |ends| flow.value_from(ends, time))
    }
}

impl<B: ModelBackend> PointMotion for OnHost<B> {
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        let motion = self.mover();
        self.rows_of(points, |x| motion.carry(x, from, to))
    }

    fn path(&self, start: &[[f32; 3]], times: &[f64]) -> Vec<Vec<[f32; 3]>> {
        let motion = self.mover();
        let pieces = self.in_chunks(start, |x| {
            let positions = motion.path(x, times);
            positions.into_iter().map(host).collect::<Vec<_>>()
        });
        let mut path = vec![Vec::with_capacity(start.len()); times.len()];
        for piece in pieces {
            for (whole, part) in path.iter_mut().zip(piece) {
                whole.extend_from_slice(part.as_chunks::<3>().0);
            }
        }
        path
    }

    fn velocities(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let motion = self.mover();
        let (before, after) = ((time - DIFFERENCE).max(0.0), (time + DIFFERENCE).min(1.0));
        self.rows_of(points, |x| {
            motion.velocity(x.clone(), time).unwrap_or_else(|| {
                let ahead = motion.carry(x.clone(), time, after);
                let behind = motion.carry(x, time, before);
                (ahead - behind) / (after - before)
            })
        })
    }
}
