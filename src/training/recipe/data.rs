//! The data section: key frames, what is known between neighbours, and how shapes become points.
//!
//! ```toml
//! [data]                          # two shapes, the short form: key frames at times 0 and 1
//! source = "a.ply"
//! target = "b.ply"
//! correspondences = "pairs.csv"
//!
//! [[data.keyframe]]               # or each key frame by itself, times in any unit
//! file = "a.ply"
//! time = 0
//! correspondences = "a-to-b.csv"  # to the next one; where it is left out, that of [data] holds
//!
//! [data]                          # or frames of a sequence
//! sequence = "walk.anime"
//! keys = [0, 10, 18]
//! ```

use std::path::{Path, PathBuf};

use super::keys::DataKeys;
use super::rule::{Rule, Value};
use super::schema::{Key, Keyed};
use super::setting::Setting;
use super::words::{Align, Cleaning, Correspondences, NormalSource};

/// The key frames and how they become points.
#[derive(Debug, Clone, PartialEq)]
pub struct DataRecipe {
    /// The key frames, at least two, at ascending times.
    pub keyframes: Vec<KeyframeRecipe>,
    /// What is known of which points correspond: entry `k` from key frame `k` to the one after it.
    pub between: Vec<Correspondences>,
    /// Points sampled from each mesh.
    pub points: usize,
    /// The most correspondences that are used, as a share of the points.
    pub correspondence_fraction: f64,
    /// Where the normals of the shapes come from.
    pub normals: NormalSource,
    /// Whether raw scans are cleaned.
    pub clean: Cleaning,
    /// A point is astray if its neighbours are so many times as far as theirs are.
    pub clean_strays: f64,
    /// A part far from the rest is left out if it has less than this share of the points.
    pub clean_part: f64,
    /// Whether shapes are laid onto each other first.
    pub align: Align,
    /// Whether pairs may mirror the shape.
    pub mirrored: bool,
}

/// A shape at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyframeRecipe {
    /// Its file, or the sequence that it is a frame of.
    pub file: PathBuf,
    /// Which frame of the sequence it is, counted from 0; none where the file is one shape.
    pub frame: Option<usize>,
    /// Its time, in the recipe's own unit.
    pub time: f64,
}

impl DataRecipe {
    /// The file of the first key frame.
    pub fn source(&self) -> &Path {
        &self.keyframes[0].file
    }

    /// The times of the key frames, brought to 0 to 1.
    pub fn unit_times(&self) -> Vec<f64> {
        let times = self.keyframes.iter().map(|key| key.time);
        let (first, last) = (
            self.keyframes[0].time,
            self.keyframes[self.keyframes.len() - 1].time,
        );
        times.map(|time| (time - first) / (last - first)).collect()
    }

    /// The file of the last key frame.
    pub fn target(&self) -> &Path {
        &self.keyframes[self.keyframes.len() - 1].file
    }

    /// Whether training on these key frames is possible: on two, each a file of its own.
    pub fn is_pair(&self) -> bool {
        self.keyframes.len() == 2 && self.keyframes.iter().all(|key| key.frame.is_none())
    }

    /// Whether these are the key frames of `before` and further ones after them.
    pub fn continues(&self, before: &DataRecipe) -> bool {
        let (keys, known) = (before.keyframes.len(), before.between.len());
        self.keyframes.len() > keys
            && self.keyframes[..keys] == before.keyframes[..]
            && self.between[..known] == before.between[..]
    }

    /// Whether `source` and `target` say all of the key frames.
    fn is_short(&self) -> bool {
        self.is_pair() && self.keyframes[0].time == 0.0 && self.keyframes[1].time == 1.0
    }

    /// Whether the key frames are frames of one sequence.
    fn is_sequence(&self) -> bool {
        self.keyframes.iter().all(|key| key.frame.is_some())
    }

    /// Whether as much is known between any two neighbours.
    fn knows_the_same(&self) -> bool {
        self.between.windows(2).all(|two| two[0] == two[1])
    }

    /// The values of the section's keys, in their order.
    pub(super) fn to_values(&self) -> Vec<Option<Value>> {
        let (short, sequence) = (self.is_short(), self.is_sequence());
        let file = |given: bool, path: &Path| given.then(|| path.to_owned());
        let frames = self.keyframes.iter().filter_map(|key| key.frame);
        let plain = if short || sequence || self.knows_the_same() {
            self.between[0].clone()
        } else {
            Correspondences::None
        };
        DataKeys {
            source: file(short, self.source()),
            target: file(short, self.target()),
            sequence: file(sequence, self.source()),
            keys: sequence.then(|| frames.map(|frame| frame as f64).collect()),
            correspondences: plain,
            points: self.points,
            correspondence_fraction: self.correspondence_fraction,
            normals: self.normals,
            clean: self.clean,
            clean_strays: self.clean_strays,
            clean_part: self.clean_part,
            align: self.align,
            mirrored: self.mirrored,
        }
        .to_values()
    }

    /// The values of each `[[data.keyframe]]` in the order of [`KEYFRAME`], where the short forms do
    /// not say them.
    pub(super) fn keyframe_values(&self) -> Vec<[Option<Value>; 3]> {
        if self.is_short() || self.is_sequence() {
            return Vec::new();
        }
        // What is the same throughout stands above all of them, and can be changed there.
        let own = |known| (!self.knows_the_same()).then_some(known);
        let known = self.between.iter().map(own).chain([None]);
        let frames = self.keyframes.iter().zip(known);
        frames
            .map(|(key, known)| {
                let known = known.and_then(Setting::to_value);
                [key.file.to_value(), key.time.to_value(), known]
            })
            .collect()
    }
}

/// The name of the list of key frames within its section.
pub(super) const KEYFRAMES: &str = "keyframe";

/// The keys of one `[[data.keyframe]]`.
pub(super) static KEYFRAME: [Key; 3] = [
    Key {
        section: "data.keyframe",
        field: "file",
        doc: "The shape: PLY, OBJ, STL, OFF, glTF, NPY, or points in text.",
        rule: Rule::path(),
        columns: ["_"; 5],
    },
    Key {
        section: "data.keyframe",
        field: "time",
        doc: "Its time, in any unit.",
        rule: Rule::number(-1e9, 1e9),
        columns: ["_"; 5],
    },
    Key {
        section: "data.keyframe",
        field: "correspondences",
        doc: "What is known of which of its points correspond to those of the next key frame.",
        rule: Rule::word_or_path(Correspondences::WORDS),
        columns: ["_"; 5],
    },
];
