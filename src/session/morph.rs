//! Two files or more and nothing else: a recipe chosen for them, what it takes for granted, and what speaks against the
//! result.

use std::path::PathBuf;

use super::morph_size::Size;
use crate::error::{Error, Result};
use crate::event::Event;
use crate::formats::Shape;
use crate::geometry::EdgeSharing;
use crate::recipe::{Align, Correspondences, Recipe};
use crate::shape::CleanOptions;

/// What is asked for beyond the files.
#[derive(Clone, Debug, PartialEq)]
pub struct MorphOptions {
    /// Pairs of points: a value of `data.correspondences`; chosen by the files without it.
    pub pairs: Option<String>,
    /// The preset.
    pub preset: String,
    /// How the files are laid onto each other: a value of `data.align`.
    pub align: String,
    /// The times of the files; 0, 1, 2 and so on without it.
    pub times: Option<Vec<f64>>,
    /// Surfaces at even times.
    pub frames: usize,
    /// Other keys of the recipe, as in `result.resolution=256`.
    pub changes: Vec<String>,
}

/// A recipe for files, and what was assumed for it.
#[derive(Clone, Debug)]
pub struct MorphPlan {
    /// The recipe.
    pub recipe: Recipe,
    /// What it takes for granted, in sentences.
    pub assumed: Vec<String>,
    /// What may well be wrong with it.
    pub doubts: Vec<Doubt>,
}

/// Something that speaks against a result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// What was found.
    pub finding: String,
    /// What to try next.
    pub cure: String,
}

impl Doubt {
    pub(super) fn new(finding: String, cure: &str) -> Self {
        Self {
            finding,
            cure: cure.to_owned(),
        }
    }
}

/// Chooses a recipe for a morph through `files`, two or more, in the order of their times.
///
/// # Errors
/// A file that cannot be read, a key that is refused, fewer than two files, not one time for each.
pub fn plan_morph(files: &[PathBuf], options: &MorphOptions) -> Result<MorphPlan> {
    // As the recipe reads them, unless it is changed to use all points.
    let read = |path| Ok::<_, crate::Error>(Shape::read(path)?.cleaned(&CleanOptions::default()));
    let shapes: Vec<Shape> = files.iter().map(read).collect::<Result<_>>()?;
    let same = shapes.windows(2).all(|two| same_faces([&two[0], &two[1]]));
    let pairs = options.pairs.as_deref();
    let chosen = pairs.unwrap_or(if same { "same-vertices" } else { "match" });
    let mut recipe = planned(files, options, chosen)?;
    recipe.with_all(&options.changes)?;
    let mut assumed: Vec<String> = shapes.iter().map(described).collect();
    let extents: Vec<Size> = shapes.iter().map(Size::of).collect();
    let sizes: Vec<String> = extents.iter().map(Size::to_string).collect();
    assumed.push(format!(
        "units: those of the files; {} large",
        sizes.join(" and ")
    ));
    let apart = extents.windows(2).map(|two| two[0].apart(&two[1]));
    assumed.push(frame(&apart.collect::<Vec<_>>(), recipe.data.align));
    assumed.push(match (chosen, pairs) {
        ("same-vertices", None) => {
            let all = if files.len() == 2 { "both" } else { "all" };
            format!("pairs: vertices of equal number, since {all} files have the same faces")
        }
        ("same-vertices", Some(_)) => "pairs: vertices of equal number, as you say".to_owned(),
        ("match", _) => "pairs: found from the shapes alone".to_owned(),
        ("none", _) => "pairs: none; the nearest parts are drawn together".to_owned(),
        (file, _) => format!("pairs: those of {file}"),
    });
    if files.len() > 2 {
        let times = recipe.data.keyframes.iter().map(|key| key.time.to_string());
        let times = times.collect::<Vec<_>>().join(", ");
        assumed.push(format!(
            "times: {times}; the motion is smooth through all files"
        ));
    }
    assumed.push(format!("preset: {}", options.preset));
    // What is laid onto each other has neither other units nor another place.
    let doubts = extents.windows(2).flat_map(|two| two[0].doubts(&two[1]));
    let doubts = match recipe.data.align {
        Align::None | Align::Rigid => doubts.collect(),
        Align::Similarity | Align::Auto => Vec::new(),
    };
    Ok(MorphPlan {
        recipe,
        assumed,
        doubts,
    })
}

/// What is taken for granted of the files' coordinates; the distances of the centres of neighbours are given.
fn frame(apart: &[String], align: Align) -> String {
    let files = if apart.len() == 1 { "both" } else { "all" };
    let how = match align {
        Align::None => format!("{files} files are in the same coordinates"),
        Align::Rigid => format!("{files} files are turned and shifted onto each other"),
        Align::Similarity => format!("{files} files are turned, shifted and sized onto each other"),
        Align::Auto => format!(
            "{files} files are in the same coordinates, unless size, place or a large turn speak against it"
        ),
    };
    match apart {
        [apart] => format!("frame: {how}; their centres are {apart} apart"),
        apart => format!(
            "frame: {how}; the centres of neighbours are {} apart",
            apart.join(", ")
        ),
    }
}

/// The recipe with these pairs, before it is changed.
fn planned(files: &[PathBuf], options: &MorphOptions, pairs: &str) -> Result<Recipe> {
    let set = [
        format!("preset={}", options.preset),
        format!("data.correspondences={pairs}"),
        format!("data.align={}", options.align),
        format!("result.frames={}", options.frames),
    ];
    let mut recipe = match (files, &options.times) {
        ([source, target], None) => Recipe::between(source, target)?,
        (_, times) => {
            let times = times.clone();
            let times = times.unwrap_or_else(|| (0..files.len()).map(|k| k as f64).collect());
            if times.len() != files.len() {
                return Err(Error::usage(format!(
                    "{} times for {} files: give one for each",
                    times.len(),
                    files.len()
                )));
            }
            let is_word = Correspondences::WORDS.contains(&pairs);
            if files.len() > 2 && !is_word {
                return Err(Error::usage(format!(
                    "pairs of {pairs}: a file holds those of two shapes; for more, give each key frame a file of its \
                     own in a recipe (isomorph init)"
                )));
            }
            let shapes: Vec<_> = files.iter().zip(times).collect();
            Recipe::through(&shapes)?
        }
    };
    recipe.with_all(&set)?;
    Ok(recipe)
}

/// Whether both are meshes of the same triangles: the same mesh in two poses.
fn same_faces([source, target]: [&Shape; 2]) -> bool {
    source.is_mesh()
        && source.mesh.vertices.len() == target.mesh.vertices.len()
        && source.mesh.triangles == target.mesh.triangles
}

/// What a file holds, in a sentence.
fn described(shape: &Shape) -> String {
    let (name, count) = (shape.path.display(), shape.mesh.vertices.len());
    let what = if !shape.is_mesh() {
        let normals = match shape.mesh.normals {
            Some(_) => "with normals",
            None => "without normals, which are estimated",
        };
        format!("a cloud of {count} points {normals}")
    } else if EdgeSharing::of(&shape.mesh).is_closed() {
        format!("a closed mesh of {count} vertices")
    } else {
        format!("a mesh of {count} vertices that is not closed; its holes are closed over")
    };
    format!("{name}: {what}")
}

/// Pairs that lie near less than this share of a shape leave much of it to guessing.
const LEAST_COVERAGE: f64 = 0.6;

/// A round trip through the pairs that misses by more than this, in normalised units, in the median.
const MOST_CYCLE: f64 = 0.03;

/// Surface and motion that are further apart than this, in normalised units.
const MOST_APART: f64 = 0.01;

/// What counts of a surface.
#[derive(Clone, Copy, Debug)]
struct Watched {
    time: f64,
    pieces: usize,
    /// Between surface and motion.
    apart: Option<f64>,
}

/// Watches a run, and says at its end what speaks against its result.
#[derive(Debug, Default)]
pub struct MorphWatch {
    doubts: Vec<Doubt>,
    frames: Vec<Watched>,
    cut_off: bool,
    contradicted: bool,
}

impl MorphWatch {
    /// Takes note of an event of the run.
    pub fn observe(&mut self, event: &Event) {
        match event {
            Event::Matched {
                interval: [k, intervals],
                coverage: [source, target],
                cycle: [median, _],
                ..
            } => {
                let between = match intervals {
                    0 | 1 => String::new(),
                    _ => format!("from key frame {k} to key frame {}: ", k + 1),
                };
                if source.min(*target) < LEAST_COVERAGE {
                    let finding = format!(
                        "{between}pairs were found for {:.0} % of the source and {:.0} % of the target only",
                        100.0 * source,
                        100.0 * target
                    );
                    self.doubts.push(Doubt::new(finding, GIVE_PAIRS));
                }
                if *median > MOST_CYCLE {
                    let finding = format!(
                        "{between}the pairs contradict each other: there and back misses by {median:.3} (normalised, median)"
                    );
                    self.doubts.push(Doubt::new(finding, GIVE_PAIRS));
                }
            }
            Event::Extracted {
                time,
                components,
                consistency,
                touches_box,
                ..
            } => {
                self.cut_off |= touches_box;
                self.frames.push(Watched {
                    time: *time,
                    pieces: *components,
                    apart: *consistency,
                });
            }
            Event::Doubtful { .. } => self.contradicted = true,
            _ => {}
        }
    }

    /// Whether the run itself has said something that speaks against its result.
    pub fn is_contradicted(&self) -> bool {
        self.contradicted
    }

    /// What speaks against the result; nothing if all looks well.
    pub fn doubts(mut self) -> Vec<Doubt> {
        // Those of the first and the last shape, whatever the unit of time.
        let times = || self.frames.iter().map(|frame| frame.time);
        let first = times().fold(f64::INFINITY, f64::min);
        let last = times().fold(f64::NEG_INFINITY, f64::max);
        let at_ends = |frame: &&Watched| frame.time == first || frame.time == last;
        let ends = self.frames.iter().filter(at_ends);
        let whole = ends.map(|frame| frame.pieces).max();
        let worst = self.frames.iter().max_by_key(|frame| frame.pieces);
        if let (Some(whole), Some(Watched { time, pieces, .. })) = (whole, worst)
            && *pieces > whole
        {
            let finding =
                format!("the surface at {time:.2} is in {pieces} pieces, at the ends in {whole}");
            self.doubts.push(Doubt::new(finding, FINER));
        }
        let apart = |frame: &&Watched| frame.apart.unwrap_or(0.0);
        let worst = (self.frames.iter()).max_by(|a, b| apart(a).total_cmp(&apart(b)));
        if let Some(Watched {
            time,
            apart: Some(off),
            ..
        }) = worst
            && *off > MOST_APART
        {
            let finding = format!(
                "surface and motion are {off:.3} apart at {time:.2} (normalised, in the mean)"
            );
            self.doubts.push(Doubt::new(finding, LONGER));
        }
        if self.cut_off {
            let finding = "the box cuts a surface off".to_owned();
            self.doubts
                .push(Doubt::new(finding, "add --set training.box-margin=0.3"));
        }
        self.doubts
    }
}

const GIVE_PAIRS: &str = "give a few pairs of points by hand with --pairs FILE (a line `source_index,target_index` \
     for each), above all at tips of limbs; where one shape lacks parts of the other, --pairs none is often better";
const FINER: &str = "try --set result.resolution=384; if it stays so, parts that touch at one end are torn: give \
     pairs there with --pairs FILE";
const LONGER: &str = "try --preset default, which takes minutes, or give pairs with --pairs FILE";

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f64, components: usize, consistency: f64) -> Event {
        Event::Extracted {
            time,
            path: PathBuf::new(),
            vertices: 8,
            triangles: 12,
            components,
            left_out: 0,
            consistency: Some(consistency),
            touches_box: false,
        }
    }

    fn doubts(events: &[Event]) -> Vec<String> {
        let mut watch = MorphWatch::default();
        events.iter().for_each(|event| watch.observe(event));
        watch
            .doubts()
            .into_iter()
            .map(|doubt| doubt.finding)
            .collect()
    }

    #[test]
    fn a_good_run_has_no_doubts() {
        assert!(
            doubts(&[
                frame(0.0, 1, 1e-4),
                frame(0.5, 1, 2e-3),
                frame(1.0, 1, 1e-4)
            ])
            .is_empty()
        );
    }

    #[test]
    fn a_surface_in_pieces_and_one_off_its_motion_are_named() {
        let found = doubts(&[
            frame(0.0, 1, 1e-4),
            frame(0.5, 3, 0.02),
            frame(1.0, 2, 1e-4),
        ]);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(
            found[0].contains("at 0.50 is in 3 pieces, at the ends in 2"),
            "{found:?}"
        );
        assert!(found[1].contains("0.020 apart at 0.50"), "{found:?}");
    }

    #[test]
    fn pairs_of_half_a_shape_are_named() {
        let matched = |interval| Event::Matched {
            interval,
            pairs: 10,
            coverage: [0.9, 0.5],
            cycle: [0.1, 0.2],
            seconds: 1.0,
        };
        let found = doubts(&[matched([3, 7])]);
        assert!(
            found[1].starts_with("from key frame 3 to key frame 4: "),
            "{found:?}"
        );
        let found = doubts(&[matched([0, 1])]);
        assert!(
            found[0].contains("90 % of the source and 50 % of the target"),
            "{found:?}"
        );
        assert!(found[1].contains("misses by 0.100"), "{found:?}");
    }
}
