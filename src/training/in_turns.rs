//! Surfaces and motion through many key frames: those of the interval that a time lies in.
//!
//! Only a few intervals at a time are arranged for queries, because that may take much more memory than what they are
//! made from.

use std::sync::{Arc, Mutex, PoisonError};

use crate::deformation::{CarriedField, Deformation, PointMotion, SurfaceField};
use crate::key_times::KeyTimes;

/// Intervals that stay arranged: those used last.
const KEPT: usize = 8;

/// What there is from one key frame to the next, over a time from 0 to 1.
pub trait Interval: CarriedField + SurfaceField + PointMotion + Send {}

impl<P: CarriedField + SurfaceField + PointMotion + Send> Interval for P {}

/// The intervals used last with their numbers, the latest at the end.
pub type Kept<P> = Vec<(usize, Arc<P>)>;

/// Arranges the interval of a number; those that are arranged already may have something in common with it.
pub type Arrange<P> = dyn Fn(usize, &Kept<P>) -> P + Send + Sync;

/// Key frames, and what there is from each to the next.
pub struct InTurns<P> {
    arrange: Box<Arrange<P>>,
    times: KeyTimes,
    kept: Mutex<Kept<P>>,
}

impl<P: Interval> InTurns<P> {
    /// Through key frames at these ascending times from 0 to 1, of what `arrange` makes.
    pub fn new(times: Vec<f64>, arrange: Box<Arrange<P>>) -> Self {
        Self {
            arrange,
            times: KeyTimes::new(times),
            kept: Mutex::default(),
        }
    }

    /// An interval, arranged.
    fn part(&self, s: usize) -> Arc<P> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = kept.iter().position(|(known, _)| *known == s) {
            let found = kept.remove(at);
            kept.push(found);
        } else {
            let part = (self.arrange)(s, &kept);
            if kept.len() == KEPT {
                kept.remove(0);
            }
            kept.push((s, Arc::new(part)));
        }
        Arc::clone(&kept[kept.len() - 1].1)
    }

    /// The time within the interval of a time, and the interval.
    fn at(&self, time: f64) -> (f64, Arc<P>) {
        let s = self.times.interval(time);
        (self.times.within(s, time), self.part(s))
    }
}

impl<P: Interval> Deformation for InTurns<P> {
    fn field(&self) -> Option<&dyn SurfaceField> {
        Some(self)
    }

    fn motion(&self) -> Option<&dyn PointMotion> {
        Some(self)
    }
}

impl<P: Interval> SurfaceField for InTurns<P> {
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

impl<P: Interval> CarriedField for InTurns<P> {
    fn tolerance(&self) -> f64 {
        self.part(0).tolerance()
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

impl<P: Interval> PointMotion for InTurns<P> {
    fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
        let (first, last) = (self.times.interval(from), self.times.interval(to));
        let mut points = points.to_vec();
        let hop = |s: usize, points: &[[f32; 3]]| {
            let [from, to] = [from, to].map(|time| self.times.within(s, time));
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
        let (within, part) = self.at(time);
        let length = self.times.length(self.times.interval(time)) as f32;
        let found = part.velocities(points, within).into_iter();
        found.map(|v| v.map(|x| x / length)).collect()
    }
}
