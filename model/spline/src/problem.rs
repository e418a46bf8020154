//! Two shapes as points, and pairs of points known to correspond.

use crate::error::SplineError;

/// Samples of a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cloud {
    /// Points, evenly over the surface; about 20,000 are plenty. Mean area of the shapes about 1.
    pub points: Vec<[f32; 3]>,
    /// The outward unit normal of each point, if known.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Whether each point lies at the border of what is known of the surface; empty: none does. What arrives there
    /// may have no counterpart, so the on-surface term leaves it free (Turk and Levoy, 1994).
    pub border: Vec<bool>,
}

/// Points of the first shape and where they are on the second.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pairs {
    /// Points of the first shape.
    pub source: Vec<[f32; 3]>,
    /// Where each is on the second.
    pub target: Vec<[f32; 3]>,
    /// A factor of each pair's weight, 0 or more; empty: 1 for all.
    pub confidence: Vec<f32>,
    /// Whether they were found by the shapes' likeness, and are not given.
    pub found: bool,
}

/// What a field is sought for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Problem {
    /// The shape at time 0 and the shape at time 1.
    pub shapes: [Cloud; 2],
    /// Known correspondences; there may be none.
    pub pairs: Pairs,
}

impl Cloud {
    /// # Errors
    /// If it is empty, lists differ in length or a number is not finite.
    pub(crate) fn check(&self, which: &'static str) -> Result<(), SplineError> {
        if self.points.is_empty() {
            return Err(SplineError::Empty { which });
        }
        check_finite("point", &self.points)?;
        if let Some(normals) = &self.normals {
            check_length("normals", normals.len(), self.points.len())?;
            check_finite("normal", normals)?;
        }
        if !self.border.is_empty() {
            check_length("border", self.border.len(), self.points.len())?;
        }
        Ok(())
    }
}

impl Pairs {
    /// # Errors
    /// If lists differ in length, a number is not finite or a confidence below 0.
    pub(crate) fn check(&self) -> Result<(), SplineError> {
        check_length("pairs' targets", self.target.len(), self.source.len())?;
        check_finite("pair's source", &self.source)?;
        check_finite("pair's target", &self.target)?;
        if !self.confidence.is_empty() {
            check_length("confidence", self.confidence.len(), self.source.len())?;
        }
        let wrong = |&c: &f32| !(c.is_finite() && c >= 0.0);
        if let Some(index) = self.confidence.iter().position(wrong) {
            return Err(SplineError::Input {
                what: "confidence",
                index,
                found: self.confidence[index].to_string(),
                also: " and 0 or more",
            });
        }
        Ok(())
    }
}

impl Problem {
    /// # Errors
    /// Those of [`Cloud::check`] and [`Pairs::check`].
    pub(crate) fn check(&self) -> Result<(), SplineError> {
        for (cloud, which) in self.shapes.iter().zip(["source", "target"]) {
            cloud.check(which)?;
        }
        self.pairs.check()
    }

    /// The corners of the box of all points.
    pub(crate) fn extent(&self) -> [[f64; 3]; 2] {
        extent(self.shapes.iter(), [&self.pairs].into_iter())
    }
}

/// The corners of the box of all points.
pub(crate) fn extent<'a>(
    shapes: impl Iterator<Item = &'a Cloud>,
    pairs: impl Iterator<Item = &'a Pairs>,
) -> [[f64; 3]; 2] {
    let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let known = pairs.flat_map(|pairs| pairs.source.iter().chain(&pairs.target));
    for point in shapes.flat_map(|shape| &shape.points).chain(known) {
        for i in 0..3 {
            lower[i] = lower[i].min(f64::from(point[i]));
            upper[i] = upper[i].max(f64::from(point[i]));
        }
    }
    [lower, upper]
}

fn check_length(what: &'static str, found: usize, wanted: usize) -> Result<(), SplineError> {
    if found == wanted {
        Ok(())
    } else {
        Err(SplineError::Lengths {
            what,
            found,
            wanted,
        })
    }
}

fn check_finite(what: &'static str, points: &[[f32; 3]]) -> Result<(), SplineError> {
    match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        None => Ok(()),
        Some(index) => Err(SplineError::Input {
            what,
            index,
            found: format!("{:?}", points[index]),
            also: "",
        }),
    }
}
