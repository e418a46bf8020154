//! The coordinates in which networks and splines work where shapes were laid onto each other (`data.align`), and the way
//! to those of the files at any time.
//!
//! Each shape is laid onto the one before it by a similarity. What is learned is the rest of the motion, in the common
//! coordinates, which are those of the first file. A result at time `t` goes back by
//!
//! ```text
//! x -> place(t) + scale(t) * rotation(t) (x - centre)
//! ```
//!
//! which at each key frame is the way from the common coordinates to its file: so a result meets every file where it
//! lies. In between, two shapes have a straight way of the centre, an even turn and an even growth; more have natural
//! cubic splines of the place, of the logarithm of the scale and of the quaternion, so that no speed jumps.

use serde::{Deserialize, Serialize};

use super::normalise::Normalisation;
use crate::geometry::linear::{add, difference, scaled, times, transposed};
use crate::geometry::natural;
use crate::geometry::similarity::{
    Quaternion, Similarity, even_turn, nearer, quaternion_of, rotation_of,
};

/// Where shapes lie that were laid onto each other; stored in checkpoints. None where all lie as their files say.
#[derive(Serialize, Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(transparent)]
pub(crate) struct Placements {
    keys: Vec<Placement>,
}

/// Where one shape lies.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
struct Placement {
    /// From 0 to 1.
    time: f64,
    /// The file's unit of length in that of the first.
    scale: f64,
    /// Of the common coordinates in those of the file.
    rotation: Quaternion,
    /// Where the common centre lies in the file.
    place: [f64; 3],
}

impl Placements {
    /// From the ways to the files, one for each time.
    ///
    /// # Panics
    /// If there is not one for each time.
    pub(crate) fn new(to_files: &[Similarity], times: &[f64], centre: [f64; 3]) -> Self {
        assert_eq!(to_files.len(), times.len(), "one for each time");
        let mut before = [1.0, 0.0, 0.0, 0.0];
        let placement = |(to_file, time): (&Similarity, &f64)| {
            // Of both signs the one of the shorter turn.
            before = nearer(quaternion_of(&to_file.rotation), before);
            Placement {
                time: *time,
                scale: to_file.scale,
                rotation: before,
                place: to_file.apply(centre),
            }
        };
        Self {
            keys: to_files.iter().zip(times).map(placement).collect(),
        }
    }

    /// Whether all shapes lie as their files say.
    pub(crate) fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Whether the first `count` shapes lie as they do in `before`, where they are all: at times of another span.
    pub(crate) fn begins_as(&self, before: &Self, count: usize, centre: [f64; 3]) -> bool {
        let as_given = Placement {
            time: 0.0,
            scale: 1.0,
            rotation: [1.0, 0.0, 0.0, 0.0],
            place: centre,
        };
        let of = |all: &Self, k: usize| Placement {
            time: 0.0,
            ..all.keys.get(k).copied().unwrap_or(as_given)
        };
        (0..count).all(|k| of(self, k) == of(before, k))
    }

    /// The way to the coordinates of the files at a time.
    fn at(&self, time: f64, centre: [f64; 3]) -> Option<Similarity> {
        let moments: Vec<f64> = self.keys.iter().map(|key| key.time).collect();
        let (first, second) = (self.keys.first()?, self.keys.get(1)?);
        let shares = natural::shares(&moments, time);
        let sum = |of: &dyn Fn(&Placement) -> f64| -> f64 {
            self.keys
                .iter()
                .zip(&shares)
                .map(|(key, s)| s * of(key))
                .sum()
        };
        let rotation = match self.keys.len() {
            2 => even_turn(first.rotation, second.rotation, time),
            _ => [0, 1, 2, 3].map(|part| sum(&|key| key.rotation[part])),
        };
        let rotation = rotation_of(rotation);
        let scale = sum(&|key| key.scale.ln()).exp();
        let place = [0, 1, 2].map(|axis| sum(&|key| key.place[axis]));
        Some(Similarity {
            translation: difference(place, scaled(times(&rotation, centre), scale)),
            rotation,
            scale,
        })
    }
}

/// The coordinates of networks and splines, and the way to those of the files.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Coordinates {
    /// From the common coordinates to normalised ones.
    pub normalisation: Normalisation,
    /// From the common coordinates to those of the files.
    pub placements: Placements,
}

/// Half the span over which the speed of the placement is taken.
const INSTANT: f64 = 1e-5;

impl Coordinates {
    /// Those of shapes that lie as their files say.
    #[cfg(test)]
    pub(crate) fn as_given(normalisation: Normalisation) -> Self {
        Self {
            normalisation,
            placements: Placements::default(),
        }
    }

    /// Whether these are those of `before`, which are of the first `count` shapes.
    pub(crate) fn begin_as(&self, before: &Self, count: usize) -> bool {
        let centre = self.normalisation.centre;
        self.normalisation == before.normalisation
            && self.placements.begins_as(&before.placements, count, centre)
    }

    /// The way at a time, from 0 to 1.
    pub(crate) fn at(&self, time: f64) -> Place {
        Place {
            normalisation: self.normalisation,
            to_file: self.placements.at(time, self.normalisation.centre),
        }
    }

    /// The velocities in the coordinates of the files, per unit of the time that runs from 0 to 1, of what is at `x`
    /// and moves by `v`, both normalised.
    pub(crate) fn velocities(&self, time: f64, x: &[[f32; 3]], v: &[[f32; 3]]) -> Vec<[f64; 3]> {
        let place = self.at(time);
        let around = [-INSTANT, INSTANT].map(|by| self.at(time + by));
        let own = |v: &[f32; 3]| v.map(|part| self.normalisation.invert_length(f64::from(part)));
        let velocity = |(x, v): (&[f32; 3], &[f32; 3])| {
            let Some(to_file) = place.to_file else {
                return own(v);
            };
            let carried = scaled(times(&to_file.rotation, own(v)), to_file.scale);
            let [before, after] = around.map(|place| place.invert(*x));
            let placed = scaled(difference(after, before), (2.0 * INSTANT).recip());
            add(carried, placed)
        };
        x.iter().zip(v).map(velocity).collect()
    }
}

/// The way between normalised coordinates and those of the files at one time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Place {
    normalisation: Normalisation,
    /// None where shapes lie as their files say.
    pub(crate) to_file: Option<Similarity>,
}

impl Place {
    /// From the coordinates of the file to normalised ones.
    pub(crate) fn apply(&self, x: [f64; 3]) -> [f32; 3] {
        self.normalisation.apply(self.common(x))
    }

    /// From normalised coordinates to those of the file.
    pub(crate) fn invert(&self, x: [f32; 3]) -> [f64; 3] {
        let common = self.normalisation.invert(x);
        self.to_file.map_or(common, |to_file| to_file.apply(common))
    }

    /// A normalised length in the unit of the file.
    pub(crate) fn invert_length(&self, length: f64) -> f64 {
        self.normalisation.invert_length(length) * self.scale()
    }

    /// A length in the unit of the file, normalised.
    pub(crate) fn apply_length(&self, length: f64) -> f64 {
        length * self.normalisation.scale / self.scale()
    }

    /// A direction, such as a normal, in the coordinates of the file.
    pub(crate) fn invert_direction(&self, direction: [f32; 3]) -> [f32; 3] {
        let Some(to_file) = self.to_file else {
            return direction;
        };
        times(&to_file.rotation, direction.map(f64::from)).map(|part| part as f32)
    }

    /// The vertices of a surface in the coordinates of the file, with these normals.
    pub(crate) fn invert_normals(&self, normals: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        match self.to_file {
            None => normals,
            Some(_) => normals
                .into_iter()
                .map(|n| self.invert_direction(n))
                .collect(),
        }
    }

    /// A vertex of the file at this place, moved as its normalised place moves from `start` to `end`, where the other
    /// place holds: where nothing moves it stays as it was, to the last bit.
    pub(crate) fn displaced(
        &self,
        vertex: [f64; 3],
        [start, end]: [[f32; 3]; 2],
        there: &Self,
    ) -> [f64; 3] {
        if self.to_file == there.to_file {
            let by = [0, 1, 2].map(|axis| f64::from(end[axis]) - f64::from(start[axis]));
            let by = by.map(|part| part / self.normalisation.scale);
            return match self.to_file {
                None => add(vertex, by),
                Some(both) => add(vertex, scaled(times(&both.rotation, by), both.scale)),
            };
        }
        let common = self
            .normalisation
            .displaced(self.common(vertex), start, end);
        there
            .to_file
            .map_or(common, |to_file| to_file.apply(common))
    }

    /// From the coordinates of the file to the common ones.
    fn common(&self, x: [f64; 3]) -> [f64; 3] {
        self.to_file.map_or(x, |to_file| {
            let x = difference(x, to_file.translation);
            scaled(
                times(&transposed(&to_file.rotation), x),
                to_file.scale.recip(),
            )
        })
    }

    fn scale(&self) -> f64 {
        self.to_file.map_or(1.0, |to_file| to_file.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a turn about the third axis and more, a thousand times as large, elsewhere.
    fn laid() -> [Similarity; 3] {
        let turned = |degrees: f64, scale: f64, along: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            Similarity {
                scale,
                rotation: [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]],
                translation: [along, 0.0, -along],
            }
        };
        [
            Similarity::IDENTITY,
            turned(120.0, 1000.0, 30.0),
            turned(240.0, 10.0, -7.0),
        ]
    }

    fn coordinates(count: usize) -> Coordinates {
        let centre = [0.5, -0.25, 2.0];
        let times: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
        Coordinates {
            normalisation: Normalisation { centre, scale: 2.0 },
            placements: Placements::new(&laid()[..count], &times, centre),
        }
    }

    fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn each_file_is_met_where_it_lies() {
        for count in [2, 3] {
            let coordinates = coordinates(count);
            for (k, to_file) in laid()[..count].iter().enumerate() {
                let place = coordinates.at(k as f64 / (count - 1) as f64);
                let x = [0.75, 1.0, 1.5];
                let placed = place.invert(coordinates.normalisation.apply(x));
                assert!(off(placed, to_file.apply(x)) < 1e-9 * to_file.scale, "{k}");
                let back = place.apply(to_file.apply(x));
                let there = coordinates.normalisation.apply(x);
                assert!(off(back.map(f64::from), there.map(f64::from)) < 1e-6, "{k}");
                let length = place.apply_length(place.invert_length(0.3));
                assert!((length - 0.3).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn two_shapes_turn_and_grow_evenly_and_their_centre_goes_straight() {
        let coordinates = coordinates(2);
        let half = coordinates.at(0.5).to_file.expect("laid");
        assert!((half.scale - 1000f64.sqrt()).abs() < 1e-9);
        for (time, degrees) in [(0.25, 30.0), (0.5, 60.0), (0.9, 108.0_f64)] {
            let turned = coordinates.at(time).to_file.expect("laid").rotation;
            let (sine, cosine) = degrees.to_radians().sin_cos();
            assert!(off(turned[0], [cosine, -sine, 0.0]) < 1e-12, "{time}");
        }
        let centre = coordinates.normalisation.centre;
        let end = laid()[1].apply(centre);
        let middle = [0, 1, 2].map(|k| (centre[k] + end[k]) / 2.0);
        assert!(off(half.apply(centre), middle) < 1e-9);
    }

    #[test]
    fn velocities_are_the_slopes_of_places() {
        let coordinates = coordinates(3);
        let (x, v) = ([0.25f32, -0.5, 0.125], [0.5f32, 0.25, -1.0]);
        for time in [0.0, 0.3, 0.5, 1.0] {
            let h = 1e-3;
            let at = |by: f64| {
                let moved = [0, 1, 2].map(|k| x[k] + by as f32 * v[k]);
                coordinates.at(time + by).invert(moved)
            };
            let slope = scaled(difference(at(h), at(-h)), 0.5 / h);
            let found = coordinates.velocities(time, &[x], &[v])[0];
            // Second order, and f32 in the places.
            let size = slope.iter().fold(1.0f64, |most, part| most.max(part.abs()));
            assert!(
                off(found, slope) < 1e-3 * size,
                "{time}: {found:?} {slope:?}"
            );
        }
    }

    #[test]
    fn speeds_do_not_jump_at_key_frames_of_many() {
        let coordinates = coordinates(3);
        let x = [[0.25, -0.5, 0.125]];
        let speed = |time| coordinates.velocities(time, &x, &[[0.0; 3]])[0];
        let (before, after) = (speed(0.5 - 1e-4), speed(0.5 + 1e-4));
        let size = before
            .iter()
            .fold(0.0f64, |most, part| most.max(part.abs()));
        assert!(off(before, after) < 1e-2 * size, "{before:?} {after:?}");
    }

    #[test]
    fn what_does_not_move_stays_to_the_last_bit() {
        let vertex = [5.0e5 + 1.0 / 3.0, 0.1, -0.7];
        let start = [0.1f32, 0.2, 0.3];
        let place = coordinates(2).at(0.0);
        assert_eq!(place.displaced(vertex, [start, start], &place), vertex);
        let still = Coordinates::as_given(coordinates(2).normalisation);
        let (one, other) = (still.at(0.0), still.at(1.0));
        assert_eq!(one.displaced(vertex, [start, start], &other), vertex);
        let moved = coordinates(2).at(1.0);
        let goal = laid()[1].apply(vertex);
        let found = place.displaced(vertex, [start, start], &moved);
        assert!(off(found, goal) < 1e-6, "{found:?} {goal:?}");
    }

    #[test]
    fn further_shapes_leave_the_first_ones_where_they_lie() {
        let (two, three) = (coordinates(2), coordinates(3));
        assert!(three.begin_as(&two, 2) && three.begin_as(&three, 3));
        assert!(!three.begin_as(&two, 3), "the third lies elsewhere");
        // None was laid before, and the first is not now.
        let none = Coordinates::as_given(two.normalisation);
        assert!(two.begin_as(&none, 1) && !two.begin_as(&none, 2));
        let mut other = two.clone();
        other.normalisation.scale = 3.0;
        assert!(!three.begin_as(&other, 2));
    }

    #[test]
    fn lengths_take_both_scales_and_directions_the_turn_alone() {
        let (laid, given) = (coordinates(2), coordinates(2).normalisation);
        let (place, as_it_is) = (laid.at(1.0), Coordinates::as_given(given).at(1.0));
        assert!(!laid.placements.is_empty() && Placements::default().is_empty());
        // Half by the normalisation, a thousand times by the file.
        assert!((place.invert_length(0.3) - 150.0).abs() < 1e-9);
        assert!((as_it_is.invert_length(0.3) - 0.15).abs() < 1e-12);
        let (sine, cosine) = 120f32.to_radians().sin_cos();
        let turned = [[cosine, sine, 0.0], [0.0, 0.0, 1.0]];
        let normals = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let found = place.invert_normals(normals.to_vec());
        assert_eq!(found.len(), 2);
        for (a, b) in found.iter().zip(turned) {
            assert!(
                off(a.map(f64::from), b.map(f64::from)) < 1e-6,
                "{a:?} {b:?}"
            );
        }
        assert_eq!(as_it_is.invert_normals(normals.to_vec()), normals);
    }

    #[test]
    fn what_moves_is_displaced_by_as_much_in_the_files_unit_and_direction() {
        let (vertex, start) = ([5.0, 0.1, -0.7], [0.125f32, 0.25, 0.5]);
        let end = [0.375, 0.25, 0.5];
        let both = coordinates(2);
        let still = Coordinates::as_given(both.normalisation).at(0.0);
        let found = still.displaced(vertex, [start, end], &still);
        // A quarter, halved by the normalisation.
        assert!(off(found, [5.125, 0.1, -0.7]) < 1e-12, "{found:?}");
        let place = both.at(1.0);
        let found = place.displaced(vertex, [start, end], &place);
        let (sine, cosine) = 120f64.to_radians().sin_cos();
        let goal = add(vertex, [125.0 * cosine, 125.0 * sine, 0.0]);
        assert!(off(found, goal) < 1e-9, "{found:?} {goal:?}");
        // From one file to the other.
        let found = both.at(0.0).displaced(vertex, [start, end], &place);
        let goal = laid()[1].apply([5.125, 0.1, -0.7]);
        assert!(off(found, goal) < 1e-9, "{found:?} {goal:?}");
    }
}
