//! Surfaces and motion through many key frames: those of the interval that a time lies in.
//!
//! Only a few intervals at a time are arranged for queries: a shape that is takes ten times its memory.

use std::sync::{Arc, Mutex, PoisonError};

use isomorph_spline::{SequenceField, SplineField};
use isomorph_training::deformation::{CarriedField, Deformation, PointMotion, SurfaceField};

use super::carried::{CarriedShapes, TOLERANCE};
use crate::shape::{Solid, SolidParts};

/// Intervals that stay arranged: those used last.
const KEPT: usize = 8;

/// Gives the field from one key frame to the next.
type FieldOf<const H: usize> = dyn Fn(usize) -> SplineField<f32, H> + Send + Sync;

/// Key frames and the fields that carry each to the next.
pub(super) struct CarriedSequence<const H: usize> {
    field: Box<FieldOf<H>>,
    shapes: Arc<[SolidParts]>,
    /// The times of the key frames, 0 to 1.
    times: Vec<f64>,
    /// The intervals used last, the latest at the end.
    made: Mutex<Vec<(usize, Arc<CarriedShapes<H>>)>>,
}

impl CarriedSequence<2> {
    /// Of one field through all key frames.
    pub(super) fn of(field: SequenceField, shapes: Arc<[SolidParts]>) -> Self {
        let times = field.times().to_vec();
        Self::new(Box::new(move |s| field.part(s)), times, shapes)
    }
}

impl<const H: usize> CarriedSequence<H> {
    /// Of a field from each key frame to the next, in a time of its own from 0 to 1.
    pub(super) fn new(field: Box<FieldOf<H>>, times: Vec<f64>, shapes: Arc<[SolidParts]>) -> Self {
        Self {
            field,
            shapes,
            times,
            made: Mutex::default(),
        }
    }

    /// An interval, arranged.
    fn part(&self, s: usize) -> Arc<CarriedShapes<H>> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = made.iter().position(|(known, _)| *known == s) {
            let found = made.remove(at);
            made.push(found);
        } else {
            let shape = |k: usize| {
                // That of a neighbour, if it is there.
                let near = made.iter().find_map(|(known, part)| {
                    let end = k.checked_sub(*known).filter(|end| *end < 2)?;
                    Some(part.shared(end))
                });
                near.unwrap_or_else(|| {
                    let solid = Solid::new(self.shapes[k].clone());
                    Arc::new(solid.expect("its parts are sound"))
                })
            };
            let shapes = [shape(s), shape(s + 1)];
            let part = CarriedShapes::new((self.field)(s), shapes, true);
            if made.len() == KEPT {
                made.remove(0);
            }
            made.push((s, Arc::new(part)));
        }
        Arc::clone(&made[made.len() - 1].1)
    }

    /// The interval of a time.
    fn interval(&self, time: f64) -> usize {
        let after = self.times.partition_point(|key| *key <= time);
        after.saturating_sub(1).min(self.times.len() - 2)
    }

    /// The time within the interval of a time, and the interval.
    fn at(&self, time: f64) -> (f64, Arc<CarriedShapes<H>>) {
        let s = self.interval(time);
        (self.within(s, time), self.part(s))
    }

    /// A time in the interval `s`, 0 to 1.
    fn within(&self, s: usize, time: f64) -> f64 {
        let [from, to] = [self.times[s], self.times[s + 1]];
        ((time - from) / (to - from)).clamp(0.0, 1.0)
    }
}

impl<const H: usize> Deformation for CarriedSequence<H> {
    fn field(&self) -> Option<&dyn SurfaceField> {
        Some(self)
    }

    fn motion(&self) -> Option<&dyn PointMotion> {
        Some(self)
    }
}

impl<const H: usize> SurfaceField for CarriedSequence<H> {
    fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
        let (within, part) = self.at(time);
        part.values(points, within)
    }

    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let (within, part) = self.at(time);
        part.gradients(points, within)
    }

    fn carried(&self) -> Option<&dyn CarriedField> {
        Some(self)
    }
}

impl<const H: usize> CarriedField for CarriedSequence<H> {
    fn tolerance(&self) -> f64 {
        TOLERANCE
    }

    fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
        let (within, part) = self.at(time);
        part.ends(points, within)
    }

    fn values_from(&self, ends: &[[f32; 6]], time: f64) -> Vec<f32> {
        let (within, part) = self.at(time);
        part.values_from(ends, within)
    }
}

impl<const H: usize> PointMotion for CarriedSequence<H> {
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        let (first, last) = (self.interval(from), self.interval(to));
        let mut points = points.to_vec();
        let hop = |s: usize, points: &[[f32; 3]]| {
            let [from, to] = [from, to].map(|time| self.within(s, time));
            if from == to {
                return points.to_vec();
            }
            self.part(s).carry(points, from, to)
        };
        if from <= to {
            for s in first..=last {
                points = hop(s, &points);
            }
        } else {
            for s in (last..=first).rev() {
                points = hop(s, &points);
            }
        }
        points
    }

    fn velocities(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let (s, (within, part)) = (self.interval(time), self.at(time));
        let length = (self.times[s + 1] - self.times[s]) as f32;
        let found = part.velocities(points, within).into_iter();
        found.map(|v| v.map(|x| x / length)).collect()
    }
}
