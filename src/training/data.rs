//! Key frames as methods see them: points in normalised coordinates, each set at its time, with what is
//! known of which points correspond.

use std::num::NonZeroUsize;
use std::sync::{Arc, OnceLock};

use isomorph_spline::SplineField;
use serde::{Deserialize, Serialize};

use crate::hollows::Hollows;
use crate::recipe::TrainingRecipe;

/// An axis-aligned box in normalised coordinates.
#[derive(Serialize, Deserialize, Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// The corner with the least coordinates.
    pub min: [f32; 3],
    /// The corner with the greatest coordinates.
    pub max: [f32; 3],
}

impl Bounds {
    /// The smallest box that holds the points; of no points, an inside-out box that every union
    /// replaces.
    pub fn of(points: &[[f32; 3]]) -> Self {
        let nothing = Self {
            min: [f32::INFINITY; 3],
            max: [f32::NEG_INFINITY; 3],
        };
        points.iter().fold(nothing, |bounds, &point| {
            bounds.union(&Self {
                min: point,
                max: point,
            })
        })
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: [0, 1, 2].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1, 2].map(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// The eight corners.
    pub fn corners(&self) -> [[f32; 3]; 8] {
        let side = |corner: usize, axis: usize| match corner >> axis & 1 {
            0 => self.min[axis],
            _ => self.max[axis],
        };
        std::array::from_fn(|corner| [0, 1, 2].map(|axis| side(corner, axis)))
    }

    /// The box with this much more room on every side.
    #[must_use]
    pub fn padded(&self, margin: f32) -> Self {
        Self {
            min: self.min.map(|low| low - margin),
            max: self.max.map(|high| high + margin),
        }
    }

    /// Its edge lengths.
    pub fn extent(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.max[axis] - self.min[axis])
    }
}

/// What lies around the points of a key frame: searches that only some methods need, made on first use.
pub trait Surroundings: Send + Sync {
    /// The signed distance of a place from the surface, negative inside; `None` without normals.
    fn signed_distance(&self, x: [f32; 3]) -> Option<f32>;

    /// The points nearest to the point with this index, itself or one in the same place first.
    fn nearest(&self, point: usize, count: NonZeroUsize) -> Vec<usize>;
}

/// A velocity field that is there before training. Points are carried within one interval between two key frames.
pub trait Guide: Send + Sync {
    /// The velocities at places and their times.
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]>;

    /// Where places at the times `from` are at the times `to`.
    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]>;

    /// The field itself, if it is one of splines between two key frames.
    fn splines(&self) -> Option<&SplineField> {
        None
    }
}

/// A part of a guide, over a time from 0 to 1.
struct PartOfGuide {
    whole: Arc<dyn Guide>,
    from: f32,
    length: f32,
}

impl PartOfGuide {
    fn whole_times(&self, times: &[f32]) -> Vec<f32> {
        let whole = |time: &f32| self.from + time * self.length;
        times.iter().map(whole).collect()
    }
}

impl Guide for PartOfGuide {
    fn velocities(&self, places: &[[f32; 3]], times: &[f32]) -> Vec<[f32; 3]> {
        let found = self.whole.velocities(places, &self.whole_times(times));
        let scaled = found.into_iter().map(|v| v.map(|x| x * self.length));
        scaled.collect()
    }

    fn carried(&self, places: &[[f32; 3]], from: &[f32], to: &[f32]) -> Vec<[f32; 3]> {
        let (from, to) = (self.whole_times(from), self.whole_times(to));
        self.whole.carried(places, &from, &to)
    }
}

/// The points of one key frame, normalised. A clone shares them.
#[derive(Clone)]
pub struct KeyPoints {
    /// Its time, 0 to 1.
    pub time: f32,
    /// Positions.
    pub points: Arc<[[f32; 3]]>,
    /// Unit normals, one per point.
    pub normals: Option<Arc<[[f32; 3]]>>,
    /// Searches around them.
    pub around: Arc<dyn Surroundings>,
    /// Found on first use.
    hollows: Arc<OnceLock<Hollows>>,
}

impl KeyPoints {
    /// Positions at a time, with unit normals where they are known, and searches around them.
    pub fn new(
        time: f32,
        points: impl Into<Arc<[[f32; 3]]>>,
        normals: Option<Arc<[[f32; 3]]>>,
        around: Arc<dyn Surroundings>,
    ) -> Self {
        Self {
            time,
            points: points.into(),
            normals,
            around,
            hollows: Arc::default(),
        }
    }

    /// The same at another time.
    pub(crate) fn at(&self, time: f32) -> Self {
        Self {
            time,
            ..self.clone()
        }
    }
}

/// A place in one key frame and the place in the next one that it moves to.
pub type PointPair = ([f32; 3], [f32; 3]);

/// What methods draw their samples from.
pub struct TrainingData {
    /// The key frames, at least two, at ascending times from 0 to 1.
    pub keys: Vec<KeyPoints>,
    /// Known correspondences: entry `k` from key frame `k` to the one after it.
    pub between: Vec<Vec<PointPair>>,
    /// The box around all key frames.
    pub bounds: Bounds,
    /// What the velocity field learns from first, where the recipe says so.
    pub guide: Option<Arc<dyn Guide>>,
    /// Made on first use.
    intervals: OnceLock<Vec<TrainingData>>,
}

/// A hollow is looked after if its middle is at least so many widths of the widest band away from the surface: the
/// band seldom reaches further.
const BANDS: f64 = 1.0;

impl TrainingData {
    /// Key frames at ascending times with the correspondences from each to the next.
    ///
    /// # Panics
    /// If there are fewer than two, or not one set of correspondences between each two.
    pub fn new(keys: Vec<KeyPoints>, between: Vec<Vec<PointPair>>) -> Self {
        assert!(keys.len() >= 2, "{} key frames, 2 needed", keys.len());
        assert_eq!(between.len() + 1, keys.len(), "one set between each two");
        let boxes = keys.iter().map(|key| Bounds::of(&key.points));
        let bounds = boxes.reduce(|all, next| all.union(&next));
        Self {
            bounds: bounds.expect("two key frames have a box"),
            keys,
            between,
            guide: None,
            intervals: OnceLock::new(),
        }
    }

    /// The hollows of a key frame within the box of a recipe.
    pub(crate) fn hollows<'a>(&self, key: &'a KeyPoints, training: &TrainingRecipe) -> &'a Hollows {
        key.hollows.get_or_init(|| {
            let bounds = self.bounds.padded(training.box_margin as f32);
            let widest = training.band_widths.iter().copied().fold(0.0, f64::max);
            Hollows::of(key, &bounds, (BANDS * widest) as f32)
        })
    }

    /// Key frame `s` and the next as data of their own, whose times are 0 and 1. Points and searches are shared, the
    /// box is that of all key frames, and velocities of the guide are per length of the interval.
    pub(crate) fn interval(&self, s: usize) -> &Self {
        let all = self.intervals.get_or_init(|| {
            let of = |s: usize| {
                let [from, to] = [0, 1].map(|end| self.keys[s + end].time);
                let guide = self.guide.clone().map(|whole| {
                    let part = PartOfGuide {
                        whole,
                        from,
                        length: to - from,
                    };
                    Arc::new(part) as Arc<dyn Guide>
                });
                Self {
                    keys: vec![self.keys[s].at(0.0), self.keys[s + 1].at(1.0)],
                    between: vec![self.between[s].clone()],
                    bounds: self.bounds,
                    guide,
                    intervals: OnceLock::new(),
                }
            };
            (0..self.between.len()).map(of).collect()
        });
        &all[s]
    }

    /// How many correspondences are known in all.
    pub fn pair_count(&self) -> usize {
        self.between.iter().map(Vec::len).sum()
    }

    /// The pair of this number among those of all intervals, and the times of its two places.
    pub(crate) fn pair(&self, mut number: usize) -> (PointPair, [f32; 2]) {
        for (k, pairs) in self.between.iter().enumerate() {
            if let Some(pair) = pairs.get(number) {
                return (*pair, [self.keys[k].time, self.keys[k + 1].time]);
            }
            number -= pairs.len();
        }
        unreachable!("a number below the count of all pairs");
    }

    /// Whether every key frame has normals.
    pub fn has_normals(&self) -> bool {
        self.keys.iter().all(|key| key.normals.is_some())
    }

    /// The key frame at a time, the nearest one.
    pub(crate) fn key_at(&self, time: f32) -> &KeyPoints {
        let distance = |key: &&KeyPoints| (key.time - time).abs();
        let nearest = self
            .keys
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.expect("at least two key frames")
    }

    /// The time of the key frame to which the surface of this one is carried: the next, or of the last
    /// one the one before.
    pub(crate) fn neighbour(&self, key: usize) -> f32 {
        let beside = if key + 1 < self.keys.len() {
            key + 1
        } else {
            key - 1
        };
        self.keys[beside].time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_their_points_and_grow_by_the_margin() {
        let bounds = Bounds::of(&[[0.0, 2.0, -1.0], [1.0, -2.0, 3.0]]);
        assert_eq!(
            bounds,
            Bounds {
                min: [0.0, -2.0, -1.0],
                max: [1.0, 2.0, 3.0]
            }
        );
        assert_eq!(bounds.union(&Bounds::of(&[])), bounds);
        assert_eq!(bounds.union(&Bounds::of(&[[9.0; 3]])).max, [9.0; 3]);
        assert_eq!(bounds.padded(0.5).extent(), [2.0, 5.0, 5.0]);
    }

    struct Nothing;

    impl Surroundings for Nothing {
        fn signed_distance(&self, _: [f32; 3]) -> Option<f32> {
            None
        }

        fn nearest(&self, _: usize, _: NonZeroUsize) -> Vec<usize> {
            Vec::new()
        }
    }

    #[test]
    fn pairs_are_counted_through_all_intervals() {
        let key = |time: f32| KeyPoints::new(time, vec![[time; 3]], None, Arc::new(Nothing));
        let pair = |x: f32| ([x; 3], [x + 0.5; 3]);
        let keys = [0.0, 0.25, 1.0].map(key).into();
        let data = TrainingData::new(keys, vec![vec![pair(1.0)], vec![pair(2.0), pair(3.0)]]);
        assert_eq!(data.pair_count(), 3);
        assert_eq!(data.pair(0), (pair(1.0), [0.0, 0.25]));
        assert_eq!(data.pair(2), (pair(3.0), [0.25, 1.0]));
        assert_eq!([0, 1, 2].map(|key| data.neighbour(key)), [0.25, 1.0, 0.25]);
        assert_eq!(data.key_at(0.6).time, 0.25);
        assert!(!data.has_normals());
    }
}
