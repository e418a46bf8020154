//! The true shape at any time of a run, for the page of the run.

use super::evaluate::true_spans;
use super::prepare;
use super::trained::Trained;
use crate::error::{Error, Result};
use crate::evaluate::{GroundTruth, Span};
use crate::geometry::{Mesh, TriangleSearch};
use crate::surface::learned::Learned;

/// The true shape at any time of a run.
pub(super) struct TrueShapes<'a> {
    truth: &'a GroundTruth,
    span: Span,
}

impl<'a> TrueShapes<'a> {
    /// # Errors
    /// Frames that are not the ends of the run.
    pub(super) fn of(
        trained: &Trained,
        truth: &'a GroundTruth,
        [from, to]: [usize; 2],
    ) -> Result<Self> {
        let span = truth.span(from, to)?;
        let keyframes = prepare::points_only(trained.recipe(), &trained.learned().coordinates)?;
        // Key frames in between must be where their times say: the shapes at other times follow from that.
        let frames = keyframes.keys.iter().map(|key| {
            let at = from as f64 + key.time * (to - from) as f64;
            let frame = at.round();
            if (at - frame).abs() > 1e-6 {
                return Err(Error::usage(format!(
                    "the key frame at {} is between two frames of the ground truth",
                    trained.clock().own(key.time)
                )));
            }
            Ok(frame as usize)
        });
        let frames: Vec<usize> = frames.collect::<Result<_>>()?;
        true_spans(truth, &frames, &keyframes)?;
        Ok(Self { truth, span })
    }

    /// The distances of points from the true shape at a time, normalised. Between two true frames their
    /// vertices are interpolated.
    pub(super) fn distances(
        &self,
        learned: &Learned,
        points: &[[f32; 3]],
        time: f64,
    ) -> Option<Vec<f32>> {
        let (from, to) = (self.span.from(), self.span.to());
        let at = from as f64 + time * (to - from) as f64;
        let before = (at.floor() as usize).min(to - 1);
        let share = at - before as f64;
        let [a, b] = [before, before + 1].map(|frame| self.truth.vertices(frame));
        let place = learned.coordinates.at(time);
        let between = |(a, b): (&[f64; 3], &[f64; 3])| {
            let x = [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]));
            place.apply(x)
        };
        let vertices = a.iter().zip(b).map(between).collect();
        let mesh: Mesh<f32> = Mesh::new(vertices, self.truth.triangles().to_vec());
        let search = TriangleSearch::new(&mesh)?;
        let mut near = 0;
        let distances = points.iter().map(|x| {
            let closest = search.closest(*x, near);
            near = closest.triangle;
            closest.squared.sqrt()
        });
        Some(distances.collect())
    }
}
