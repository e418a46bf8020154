//! Whether a method's surfaces and its motion say the same of the shape.

use super::error::FramesError;
use super::learned::{Learned, some_of};

/// The most vertices of a surface that are looked at.
const LOOKED_AT: usize = 1000;

/// How the surface of one time and the motion agree; lengths in normalised units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Agreement {
    /// The mean of `|f(phi_{t -> s}(x), s)|` over points `x` of the surface at `t`, for `s` 0 and 1: how far
    /// the surface is from those of the ends carried to its time, 0 where the motion carries one onto the
    /// other. Only as far as `f` is a distance.
    pub consistency: f64,
    /// The mean distance of those points from where they come back to from `s`: the integrator's error.
    pub round_trip: f64,
}

/// The same of each point.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PointAgreement {
    /// The mean of `|f(phi_{t -> s}(x), s)|` over both ends.
    pub consistency: Vec<f32>,
    /// The mean distance from where the point comes back to, over both ends.
    pub round_trip: Vec<f32>,
}

impl Learned {
    /// Of the surface at `time`, whose vertices these are; `None` where the method has no field or moves no
    /// points, or the surface is empty.
    pub(crate) fn agreement(
        &self,
        vertices: &[[f32; 3]],
        time: f64,
    ) -> Result<Option<Agreement>, FramesError> {
        if vertices.is_empty() {
            return Ok(None);
        }
        let some = some_of(vertices, LOOKED_AT);
        let mean = |values: &[f32]| {
            let sum: f64 = values.iter().map(|value| f64::from(*value)).sum();
            sum / values.len() as f64
        };
        let found = self.agreement_of_each(&some, time)?;
        Ok(found.map(|found| Agreement {
            consistency: mean(&found.consistency),
            round_trip: mean(&found.round_trip),
        }))
    }

    /// Of each of these points of the surface at `time`; `None` where the method has no field or moves no
    /// points.
    pub(crate) fn agreement_of_each(
        &self,
        points: &[[f32; 3]],
        time: f64,
    ) -> Result<Option<PointAgreement>, FramesError> {
        let Some(field) = self.deformation.field() else {
            return Ok(None);
        };
        if self.deformation.motion().is_none() {
            return Ok(None);
        }
        let mut found = PointAgreement {
            consistency: vec![0.0; points.len()],
            round_trip: vec![0.0; points.len()],
        };
        for end in [0.0, 1.0] {
            let there = self.carry(points, time, end)?;
            let off = field.values(&there, end);
            let back = self.carry(&there, end, time)?;
            for (k, (x, y)) in points.iter().zip(&back).enumerate() {
                let squares = x.iter().zip(y).map(|(a, b)| f64::from(a - b).powi(2));
                found.round_trip[k] += (squares.sum::<f64>().sqrt() / 2.0) as f32;
                found.consistency[k] += off[k].abs() / 2.0;
            }
        }
        Ok(Some(found))
    }
}

#[cfg(test)]
mod tests {
    use isomorph_training::deformation::{PointMotion, SurfaceField};

    use super::*;
    use crate::surface::learned::testing::Given;

    /// A ball of radius 0.4 about `(speed t, 0, 0)`.
    struct Ball {
        speed: f64,
    }

    impl SurfaceField for Ball {
        fn values(&self, points: &[[f32; 3]], time: f64) -> Vec<f32> {
            let centre = (self.speed * time) as f32;
            let value =
                |[x, y, z]: &[f32; 3]| ((x - centre).powi(2) + y.powi(2) + z.powi(2)).sqrt() - 0.4;
            points.iter().map(value).collect()
        }

        fn gradients(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }
    }

    /// To the right at 0.2, and on the way back at 0.2 + `more`.
    struct Right {
        more: f64,
    }

    impl PointMotion for Right {
        fn carry(&self, points: &[[f32; 3]], from: f64, to: f64) -> Vec<[f32; 3]> {
            let speed = if to < from { 0.2 + self.more } else { 0.2 };
            let by = (speed * (to - from)) as f32;
            points.iter().map(|[x, y, z]| [x + by, *y, *z]).collect()
        }

        fn path(&self, start: &[[f32; 3]], times: &[f64]) -> Vec<Vec<[f32; 3]>> {
            let at = |time: &f64| self.carry(start, 0.0, *time);
            times.iter().map(at).collect()
        }

        fn velocities(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            vec![[0.2, 0.0, 0.0]; points.len()]
        }
    }

    fn agreement(speed: f64, more: f64) -> Agreement {
        let learned = Learned::of(Given {
            field: Some(Ball { speed }),
            motion: Some(Right { more }),
        });
        // The two poles along the motion, where a shift is a distance.
        let at = |x: f64| [(speed * 0.5 + x) as f32, 0.0, 0.0];
        let found = learned.agreement(&[at(-0.4), at(0.4)], 0.5);
        found.expect("it moves points").expect("it has a field")
    }

    #[test]
    fn a_surface_that_its_motion_carries_agrees_and_another_is_off_by_the_difference() {
        let same = agreement(0.2, 0.0);
        // f32 rounding of positions below 1.
        assert!(
            same.consistency < 1e-6 && same.round_trip < 1e-6,
            "{same:?}"
        );
        let faster = agreement(0.5, 0.0);
        // Half of the time at a difference of 0.3, to each end.
        assert!((faster.consistency - 0.15).abs() < 1e-6, "{faster:?}");
        assert!(faster.round_trip < 1e-6, "{faster:?}");
    }

    #[test]
    fn a_motion_that_is_not_its_own_inverse_shows_in_the_round_trip() {
        let found = agreement(0.2, 0.1);
        // Half of the time at 0.1 more on the way to 0, and on the way back from 1.
        assert!((found.round_trip - 0.05).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn without_a_motion_nothing_is_said() {
        let learned = Learned::of_field(Ball { speed: 0.0 });
        let found = learned.agreement(&[[0.4, 0.0, 0.0]], 0.0);
        assert_eq!(found.expect("nothing fails"), None);
    }
}
