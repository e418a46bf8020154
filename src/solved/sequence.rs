//! Surfaces and motion of a field through many key frames: those of the interval that a time lies in.

use std::sync::Arc;

use isomorph_spline::SequenceField;
use isomorph_training::deformation::{CarriedField, Deformation, PointMotion, SurfaceField};

use super::carried::CarriedShapes;
use crate::shape::Solid;

/// Key frames and the field that carries them.
pub(super) struct CarriedSequence {
    /// From each key frame to the next, in a time of its own from 0 to 1.
    parts: Vec<CarriedShapes<2>>,
    /// The times of the key frames, 0 to 1.
    times: Vec<f64>,
}

impl CarriedSequence {
    pub(super) fn new(field: &SequenceField, shapes: &Arc<[Solid]>) -> Self {
        let part = |s: usize| CarriedShapes::new(field.part(s), Arc::clone(shapes), s);
        Self {
            parts: (0..field.times().len() - 1).map(part).collect(),
            times: field.times().to_vec(),
        }
    }

    /// The interval of a time, the time in it, and its part.
    fn at(&self, time: f64) -> (usize, f64, &CarriedShapes<2>) {
        let after = self.times.partition_point(|key| *key <= time);
        let s = after.saturating_sub(1).min(self.parts.len() - 1);
        (s, self.within(s, time), &self.parts[s])
    }

    /// A time in the interval `s`, 0 to 1.
    fn within(&self, s: usize, time: f64) -> f64 {
        let [from, to] = [self.times[s], self.times[s + 1]];
        ((time - from) / (to - from)).clamp(0.0, 1.0)
    }
}

impl Deformation for CarriedSequence {
    fn field(&self) -> Option<&dyn SurfaceField> {
        Some(self)
    }

    fn motion(&self) -> Option<&dyn PointMotion> {
        Some(self)
    }
}

impl SurfaceField for CarriedSequence {
    fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
        let (_, within, part) = self.at(time);
        part.values(points, within)
    }

    fn gradients(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let (_, within, part) = self.at(time);
        part.gradients(points, within)
    }

    fn carried(&self) -> Option<&dyn CarriedField> {
        Some(self)
    }
}

impl CarriedField for CarriedSequence {
    fn tolerance(&self) -> f64 {
        self.parts[0].tolerance()
    }

    fn ends(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 6]> {
        let (_, within, part) = self.at(time);
        part.ends(points, within)
    }

    fn values_from(&self, ends: &[[f32; 6]], time: f64) -> Vec<f32> {
        let (_, within, part) = self.at(time);
        part.values_from(ends, within)
    }
}

impl PointMotion for CarriedSequence {
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        let (first, last) = (self.at(from).0, self.at(to).0);
        let mut points = points.to_vec();
        let hop = |s: usize, points: &[[f32; 3]]| {
            let [from, to] = [from, to].map(|time| self.within(s, time));
            if from == to {
                return points.to_vec();
            }
            self.parts[s].carry(points, from, to)
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

    fn velocities(&self, points: &[[f32; 3]], time: f64) -> Vec<[f32; 3]> {
        let (s, within, part) = self.at(time);
        let length = (self.times[s + 1] - self.times[s]) as f32;
        let found = part.velocities(points, within).into_iter();
        found.map(|v| v.map(|x| x / length)).collect()
    }
}
