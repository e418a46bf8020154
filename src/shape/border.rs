//! The border of what is known of a shape: where a scan ends, and around its holes.
//!
//! A point lies at the border if its neighbours, seen along its normal, leave a wide sector empty (Bendels, Schnabel and
//! Klein, "Detecting holes in point set surfaces", 2006). What lies beyond has no counterpart among the points.

use std::f32::consts::TAU;
use std::num::NonZeroUsize;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::geometry::density::usual_spacing;
use crate::geometry::linear::{difference, dot, tangents};
use crate::geometry::{Neighbour, NeighbourSearch};

/// Neighbours that a point is seen among, itself first. Of so many at random, one point in 400 has the sector empty.
const NEIGHBOURS: NonZeroUsize = NonZeroUsize::new(25).expect("not zero");

/// The empty sector.
const SECTOR: f32 = TAU / 3.0;

/// Of the neighbours of a point at the border at least this share are at it too; points at random stand alone.
const COMPANY: f64 = 0.15;

/// How far from the border points count in full, in spacings of the points.
const FULL: f64 = 4.0;

/// Points whose weights are averaged at a place.
const AROUND: NonZeroUsize = NonZeroUsize::new(4).expect("not zero");

/// Whether each point lies at the border; empty if none does.
pub(super) fn points_at(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<bool> {
    let wide: Vec<[f64; 3]> = points.iter().map(|x| x.map(f64::from)).collect();
    if wide.len() < NEIGHBOURS.get() {
        return Vec::new();
    }
    let found = NeighbourSearch::new(&wide).nearest_of_each(&wide, NEIGHBOURS);
    let is_open =
        |(k, near): (usize, &Vec<Neighbour>)| widest_sector(points, normals[k], k, near) > SECTOR;
    let open: Vec<bool> = found.par_iter().enumerate().map(is_open).collect();
    let has_company = |(k, near): (usize, &Vec<Neighbour>)| {
        let others = near[1..]
            .iter()
            .filter(|other| open[other.index as usize])
            .count();
        open[k] && others as f64 >= COMPANY * (near.len() - 1) as f64
    };
    let border: Vec<bool> = found.par_iter().enumerate().map(has_company).collect();
    if border.contains(&true) {
        border
    } else {
        Vec::new()
    }
}

/// The widest sector without neighbours around a point, in the plane of its normal, in radians.
fn widest_sector(points: &[[f32; 3]], normal: [f32; 3], k: usize, near: &[Neighbour]) -> f32 {
    let [across, along] = tangents(normal);
    let away = near[1..]
        .iter()
        .map(|other| difference(points[other.index as usize], points[k]));
    let mut angles: Vec<f32> = away
        .map(|away| dot(away, across).atan2(dot(away, along)))
        .collect();
    angles.sort_by(f32::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else {
        return TAU;
    };
    let round = first + TAU - last;
    angles
        .windows(2)
        .map(|two| two[1] - two[0])
        .fold(round, f32::max)
}

/// A place has no counterpart if the nearest point is at the border and further away than so many spacings.
const BEYOND: f64 = 3.0;

/// Less than this share of a shape that has no counterpart is within what a border's place is off.
pub(crate) const LEAST_MISSING: f64 = 0.02;

/// The border of points, arranged for queries.
pub(super) struct BorderSearch<'a> {
    search: NeighbourSearch,
    spacing: f64,
    border: &'a [bool],
}

impl<'a> BorderSearch<'a> {
    /// Of points, each with whether it lies at the border.
    pub(super) fn new(points: &[[f32; 3]], border: &'a [bool]) -> Self {
        let points: Vec<[f64; 3]> = points.iter().map(|x| x.map(f64::from)).collect();
        Self {
            search: NeighbourSearch::new(&points),
            spacing: usual_spacing(&points),
            border,
        }
    }

    /// Which places lie more than so many spacings beyond the border.
    pub(super) fn beyond(&self, places: &[[f32; 3]], spacings: f64) -> Vec<bool> {
        let is_beyond = |x: &[f32; 3]| {
            let near = self.search.nearest_one(x.map(f64::from));
            self.border[near.index as usize]
                && near.squared_distance.sqrt() > spacings * self.spacing
        };
        places.par_iter().map(is_beyond).collect()
    }
}

/// The share of places that lie beyond the border of points; 0 without a border.
pub(crate) fn share_beyond(points: &[[f32; 3]], border: &[bool], places: &[[f32; 3]]) -> f64 {
    if border.is_empty() || places.is_empty() {
        return 0.0;
    }
    let beyond = BorderSearch::new(points, border).beyond(places, BEYOND);
    let count = beyond.iter().filter(|is| **is).count();
    count as f64 / places.len() as f64
}

/// Where a shape is known: in full away from its border, not at all at it and beyond.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Known {
    points: Vec<[f32; 3]>,
    /// 0 at the border to 1 in full.
    weights: Vec<f32>,
}

impl Known {
    /// Of points, some of them at the border; `None` if none is.
    pub(super) fn of(points: &[[f32; 3]], border: &[bool]) -> Option<Self> {
        let at: Vec<[f64; 3]> = (points.iter().zip(border))
            .filter(|(_, is)| **is)
            .map(|(x, _)| x.map(f64::from))
            .collect();
        if at.is_empty() {
            return None;
        }
        let wide: Vec<[f64; 3]> = points.iter().map(|x| x.map(f64::from)).collect();
        let full = FULL * usual_spacing(&wide);
        let away = NeighbourSearch::new(&at).nearest_one_of_each(&wide);
        let weight = |found: &Neighbour| {
            let part = (found.squared_distance.sqrt() / full).min(1.0);
            (part * part * (3.0 - 2.0 * part)) as f32
        };
        Some(Self {
            points: points.to_vec(),
            weights: away.iter().map(weight).collect(),
        })
    }

    /// Whether the numbers fit together: what a damaged file need not.
    pub(super) fn is_whole(&self) -> bool {
        let finite = self
            .points
            .as_flattened()
            .iter()
            .all(|part| part.is_finite());
        let shares = self
            .weights
            .iter()
            .all(|weight| (0.0..=1.0).contains(weight));
        !self.points.is_empty() && self.points.len() == self.weights.len() && finite && shares
    }

    /// Arranged for queries.
    pub(super) fn arranged(&self) -> KnownSearch {
        let wide: Vec<[f64; 3]> = self.points.iter().map(|x| x.map(f64::from)).collect();
        KnownSearch {
            search: NeighbourSearch::new(&wide),
            weights: self.weights.clone(),
        }
    }
}

/// [`Known`], arranged for queries.
pub(super) struct KnownSearch {
    search: NeighbourSearch,
    weights: Vec<f32>,
}

impl KnownSearch {
    /// How far the shape is known about each place, 0 to 1: that of the points nearest to it.
    pub(super) fn at(&self, places: &[[f32; 3]]) -> Vec<f32> {
        let at = |x: &[f32; 3]| {
            let near = self.search.nearest(x.map(f64::from), AROUND);
            let (mut sum, mut all) = (0.0, 0.0);
            for found in near {
                let share = 1.0 / (found.squared_distance + 1e-12);
                sum += share * f64::from(self.weights[found.index as usize]);
                all += share;
            }
            (sum / all) as f32
        };
        places.par_iter().with_min_len(256).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::{sphere_cloud, torus_cloud};

    fn narrow(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
        points.iter().map(|x| x.map(|part| part as f32)).collect()
    }

    /// Points of a unit sphere below a height, which are their own normals.
    fn cut_ball() -> Vec<[f32; 3]> {
        let ball = sphere_cloud(8000, 1.0, 82);
        let below = ball.into_iter().filter(|p| p[2] < 0.3);
        narrow(&below.collect::<Vec<_>>())
    }

    #[test]
    fn a_complete_shape_has_no_border_and_a_cut_one_has_it_along_the_cut() {
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
            torus_cloud(8000, 1.0, 0.4, 81).into_iter().unzip();
        let border = points_at(&narrow(&points), &narrow(&normals));
        let count = border.iter().filter(|is| **is).count();
        assert!(count < 40, "{count} of 8000");
        let points = cut_ball();
        let border = points_at(&points, &points);
        let high = |from: f32, to: f32| {
            let those = (0..points.len()).filter(|k| (from..to).contains(&points[*k][2]));
            let (mut at, mut all) = (0.0, 0.0);
            those.for_each(|k| {
                all += 1.0;
                at += f64::from(u8::from(border[k]));
            });
            at / all
        };
        // Points are 0.04 apart.
        assert!(high(0.28, 0.3) > 0.8, "{}", high(0.28, 0.3));
        assert!(high(-1.0, 0.15) < 0.01, "{}", high(-1.0, 0.15));
    }

    #[test]
    fn a_shape_is_known_where_its_points_are_and_not_beyond_its_border() {
        let points = cut_ball();
        let border = points_at(&points, &points);
        let known = Known::of(&points, &border).expect("a border");
        assert!(known.is_whole());
        let at = known.arranged().at(&[
            [0.0, 0.0, -1.2],
            [0.6, 0.6, -0.3],
            [0.0, 0.0, 0.9],
            [0.0, 0.9, 0.5],
        ]);
        assert!(at[0] > 0.99 && at[1] > 0.99, "{at:?}");
        assert!(at[2] < 0.2 && at[3] < 0.1, "{at:?}");
        assert_eq!(Known::of(&points, &[]), None);
    }
}
