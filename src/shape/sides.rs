//! The normals of a cloud held against what the cloud itself shows of inside and outside.
//!
//! Many programs write normals whose lines are right and whose sides are not: as the eigenvectors of a covariance
//! come, or turned to a camera that saw some parts from within. Each connected part is judged by itself, by the points
//! at which the cloud clearly shows its outside ([`estimate_normals`]). The lines of the file are kept.

use super::normals::{EstimatedNormals, estimate_normals};
use crate::geometry::density::usual_spacing;
use crate::geometry::linear::dot;
use crate::geometry::parts_apart;

/// Certainties from this on, up or down, are called clear.
pub(crate) const CLEAR: f64 = 0.25;

/// A part is judged if so many of its points are clear, and this share of them.
const FEWEST_CLEAR: usize = 30;
const CLEAR_SHARE: f64 = 0.4;

/// Normals on the right side at this share of the clear points are taken as they are.
const AGREEMENT: f64 = 0.9;

/// Parts of a cloud are apart where no two of their points are nearer than so many spacings.
const APART: f64 = 5.0;

/// What was done to the sides of normals.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sides {
    /// Unit normals, as long as they were.
    pub normals: Vec<[f32; 3]>,
    /// Points of parts whose normals all pointed inwards: turned over.
    pub flipped: usize,
    /// Points of parts whose normals pointed in and out: each turned as the cloud shows.
    pub mixed: usize,
    /// The share of all clear points whose normals were on the right side.
    pub agreement: f64,
}

/// The normals of a cloud turned outwards where the cloud clearly shows that they are not; `None` where all may stay.
///
/// # Panics
/// If there is not one normal for each point, or no point.
pub(super) fn turned(points: &[[f64; 3]], normals: &[[f32; 3]]) -> Option<Sides> {
    assert_eq!(points.len(), normals.len(), "a normal for each point");
    let estimate = estimate_normals(points);
    let part_of = parts_apart(points, APART * usual_spacing(points));
    let count = part_of.iter().max().map_or(0, |last| last + 1);
    let mut tallies = vec![Tally::default(); count];
    for (k, part) in part_of.iter().enumerate() {
        tallies[*part].add(&estimate, normals, k);
    }
    let verdicts: Vec<Verdict> = tallies.iter().map(Tally::verdict).collect();
    if verdicts.iter().all(|verdict| *verdict == Verdict::Right) {
        return None;
    }
    let (clear, right) = tallies.iter().fold((0, 0), |(clear, right), tally| {
        (clear + tally.clear, right + tally.right)
    });
    let mut sides = Sides {
        normals: normals.to_vec(),
        flipped: 0,
        mixed: 0,
        agreement: right as f64 / clear as f64,
    };
    for (k, part) in part_of.iter().enumerate() {
        let turn = match verdicts[*part] {
            Verdict::Right => false,
            Verdict::Flipped => {
                sides.flipped += 1;
                true
            }
            Verdict::Mixed => {
                sides.mixed += 1;
                !agrees(&estimate, normals, k)
            }
        };
        if turn {
            sides.normals[k] = sides.normals[k].map(|part| -part);
        }
    }
    Some(sides)
}

/// Whether a normal points to the side of the estimated one.
fn agrees(estimate: &EstimatedNormals, normals: &[[f32; 3]], k: usize) -> bool {
    dot(
        normals[k].map(f64::from),
        estimate.normals[k].map(f64::from),
    ) >= 0.0
}

/// The points of a part.
#[derive(Clone, Copy, Default)]
struct Tally {
    points: usize,
    clear: usize,
    /// Clear ones whose normal is on the right side.
    right: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Right,
    Flipped,
    Mixed,
}

impl Tally {
    fn add(&mut self, estimate: &EstimatedNormals, normals: &[[f32; 3]], k: usize) {
        self.points += 1;
        if estimate.certainty[k] >= CLEAR {
            self.clear += 1;
            self.right += usize::from(agrees(estimate, normals, k));
        }
    }

    fn verdict(&self) -> Verdict {
        let (clear, all) = (self.clear as f64, self.points as f64);
        let agreement = self.right as f64 / clear;
        if self.clear < FEWEST_CLEAR || clear < CLEAR_SHARE * all || agreement >= AGREEMENT {
            Verdict::Right
        } else if agreement <= 1.0 - AGREEMENT {
            Verdict::Flipped
        } else {
            Verdict::Mixed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::{sphere_cloud, torus_cloud};

    fn narrow(normals: &[[f64; 3]]) -> Vec<[f32; 3]> {
        normals.iter().map(|n| n.map(|part| part as f32)).collect()
    }

    #[test]
    fn true_normals_stay_and_those_of_either_side_are_turned_out() {
        let cloud = torus_cloud(6000, 1.0, 0.35, 61);
        let (points, truth): (Vec<[f64; 3]>, Vec<[f64; 3]>) = cloud.into_iter().unzip();
        let truth = narrow(&truth);
        assert_eq!(turned(&points, &truth), None);
        // Every normal as it comes, every third one inwards.
        let mixed: Vec<[f32; 3]> = truth
            .iter()
            .enumerate()
            .map(|(k, n)| if k % 3 == 0 { n.map(|part| -part) } else { *n })
            .collect();
        let sides = turned(&points, &mixed).expect("turned");
        assert_eq!((sides.mixed, sides.flipped), (6000, 0));
        assert!(
            (sides.agreement - 2.0 / 3.0).abs() < 0.03,
            "{}",
            sides.agreement
        );
        let same = sides
            .normals
            .iter()
            .zip(&truth)
            .filter(|(a, b)| a == b)
            .count();
        assert!(same > 5950, "{same}");
    }

    #[test]
    fn each_part_is_judged_by_itself() {
        let ball = sphere_cloud(3000, 1.0, 62);
        let away = ball.iter().map(|p| [p[0] + 5.0, p[1], p[2]]);
        let points: Vec<[f64; 3]> = ball.iter().copied().chain(away).collect();
        let out = narrow(&ball);
        let inwards = out.iter().map(|n| n.map(|part| -part));
        let normals: Vec<[f32; 3]> = out.iter().copied().chain(inwards).collect();
        let sides = turned(&points, &normals).expect("turned");
        assert_eq!((sides.mixed, sides.flipped), (0, 3000));
        assert_eq!(sides.normals, [out.clone(), out].concat());
    }

    #[test]
    fn an_open_sheet_that_shows_no_outside_keeps_its_normals() {
        let place = |k: u32| [f64::from(k % 50), f64::from(k / 50), 0.0];
        let points: Vec<[f64; 3]> = (0..2500).map(place).collect();
        assert_eq!(turned(&points, &vec![[0.0, 0.0, -1.0]; 2500]), None);
    }
}
