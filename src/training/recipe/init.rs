//! A first recipe to edit: the shapes, the ten keys that people change, then the rest.
//!
//! Keys are written with their sections, as in `--set`: so a key may stand at the top, whatever section it
//! is of.

use std::path::PathBuf;

use super::fallback::Fallback;
use super::print::{about, comment};
use super::rule::Value;
use super::schema::{Key, Section};
use super::setting::Setting;
use super::source::unicode;
use super::words::{Correspondences, GeometryKind, Preset, VelocityKind};
use super::{Recipe, RecipeError, catalogue};
use crate::method::{self, METHODS, MethodSpec};

/// The keys that people change, with what each does to the result and what it costs.
const FIRST: [(&str, &str); 10] = [
    (
        "preset",
        "Quality against time. Every key that is left out has the preset's value. On two cores \
         \"instant\" takes about five seconds, \"quick\" takes about half a minute, \"default\" about two minutes, \"quality\" about an hour. \
         \"paper\" is the method as the paper prints it, and takes hours.",
    ),
    (
        "data.correspondences",
        "Known pairs of points. A few decide where parts go, above all in large motions. \"none\": no \
         pairs. \"same-vertices\": vertices of equal number are pairs. \"match\": isomorph finds \
         pairs before training, which takes a few seconds. A path: a file with \
         source_index,target_index on each line.",
    ),
    (
        "data.normals",
        "Normals of the shapes. \"auto\": those of the file, estimated where it has none. \"given\": \
         those of the file alone. \"estimate\": estimated always. \"none\": no normals, and a much \
         worse fit. The time is the same.",
    ),
    (
        "loss.divergence",
        "Volume preservation. Larger values keep the volume better. Set 0 where the volume changes. \
         The time is nearly the same.",
    ),
    (
        "loss.strain",
        "Rigidity. Larger values stretch the shape less and bend it in joints. Set 0 where parts \
         stretch or grow. The time is nearly the same.",
    ),
    (
        "loss.matching-scale",
        "Distance above which a pair counts as wrong and is ignored. Set 0.03 where some pairs may be \
         wrong. It costs no time.",
    ),
    (
        "training.steps",
        "Steps of the optimiser. More steps give a closer fit. The time grows in proportion.",
    ),
    (
        "training.seed",
        "Seed of the initial weights and of every sample. Another seed gives another run, with \
         slightly different results. It costs no time.",
    ),
    (
        "result.frames",
        "Surfaces in the result, at even times from 0 to 1. Each takes seconds to minutes after \
         training. `isomorph extract` writes more at any time.",
    ),
    (
        "result.resolution",
        "Cells of the extraction grid along the longest side of the box. Finer grids show finer \
         detail. Time and file size grow with the square.",
    ),
];

impl Recipe {
    /// A first recipe for these shapes: their files, the ten keys that people change with what each does
    /// to the result and what it costs, and every other key of the method as a comment with the preset's
    /// value. `all` adds the keys of all other methods. Paths are written as given.
    ///
    /// # Errors
    /// If a path is not Unicode.
    pub fn commented(
        shapes: &[PathBuf],
        correspondences: &Correspondences,
        preset: Preset,
        all: bool,
    ) -> Result<String, RecipeError> {
        if let Correspondences::File(path) = correspondences {
            unicode(path)?;
        }
        let spec = chosen(preset);
        let page = Page {
            preset,
            spec,
            fallback: Fallback::new(preset, spec, shapes.len()),
            correspondences: correspondences.to_value(),
        };
        let mut text = comment(
            "A recipe of isomorph. A line such as `#training.steps = 1000` shows the value of the preset. \
             To change it, remove the first # and edit the value. Each key is written with its section, as \
             in `--set`. `isomorph train FILE` starts the run.",
        );
        match shapes {
            [source, target] => {
                for (id, path) in [("data.source", source), ("data.target", target)] {
                    let key = catalogue::by_id(id).expect("a key of the table");
                    let path = Value::Text(unicode(path)?.to_owned());
                    text.push_str(&format!("\n{}{id} = {path}\n", about(key, key.doc)));
                }
            }
            many => text.push_str(&key_frames(many)?),
        }
        text.push_str(&title("The keys that people change"));
        text.push('\n');
        for (id, meaning) in FIRST {
            let key = catalogue::by_id(id).expect("a key of the table");
            if page.spec.acts_on(key) {
                text.push_str(&page.line(key, meaning));
            }
        }
        let rest = format!("The other keys of the method {}", page.spec.described());
        text.push_str(&title(&rest));
        text.push_str(&page.rest());
        if all {
            text.push_str(&title(
                "The other methods, and the keys that act in them alone",
            ));
            text.push_str(&page.others());
        }
        Ok(text)
    }
}

/// The list of key frames, one on each line, at the times 0, 1, 2 and so on.
fn key_frames(shapes: &[PathBuf]) -> Result<String, RecipeError> {
    let mut text = format!(
        "\n{}data.keyframe = [\n",
        comment(
            "The key frames, in the order of their times. Times are in any unit, such as seconds or frame numbers, and \
             may be uneven. A key frame can have `correspondences` of its own, to the next one."
        )
    );
    for (time, path) in shapes.iter().enumerate() {
        let file = Value::Text(unicode(path)?.to_owned());
        text.push_str(&format!("  {{ file = {file}, time = {time} }},\n"));
    }
    text.push_str("]\n");
    Ok(text)
}

/// The method of a preset as it is.
fn chosen(preset: Preset) -> &'static MethodSpec {
    let value = |key: &Key| key.preset_value(preset);
    let geometry = catalogue::by_id("implicit.geometry").and_then(value);
    let geometry = geometry.and_then(GeometryKind::from_value);
    let geometry = geometry.expect("every preset gives it");
    let kind = catalogue::by_id("velocity.kind").and_then(value);
    let kind = kind.and_then(VelocityKind::from_value);
    let kind = kind.expect("every preset gives it");
    let Some(Value::Text(name)) = value(catalogue::method()) else {
        unreachable!("every preset names a method");
    };
    method::spec(&name, geometry, kind).expect("a name of the list")
}

/// What a printed recipe depends on.
struct Page {
    preset: Preset,
    spec: &'static MethodSpec,
    fallback: Fallback,
    correspondences: Option<Value>,
}

impl Page {
    /// A key under its meaning: live if this recipe decides it, a comment if the preset does.
    fn line(&self, key: &Key, meaning: &str) -> String {
        let decided = match key.id().as_str() {
            "preset" => self.preset.to_value(),
            "data.correspondences" => self.correspondences.clone(),
            _ => None,
        };
        let mark = if decided.is_some() { "" } else { "#" };
        let Some(value) = decided.or_else(|| self.fallback.value(key)) else {
            return String::new();
        };
        let elsewhere = self.other_presets(key, &value);
        let (about, id) = (about(key, meaning), key.id());
        format!("{about}{mark}{id} = {value}{elsewhere}\n")
    }

    /// Every key of the method that does not stand at the top.
    fn rest(&self) -> String {
        self.sections(|key| self.spec.acts_on(key), |_| String::new())
    }

    /// What the other methods are, and every key that acts in some of them and not in this one.
    fn others(&self) -> String {
        let mut text = String::from("\n");
        for spec in METHODS.iter().filter(|spec| **spec != self.spec) {
            let line = format!("{}: {}.", spec.described(), spec.about);
            text.push_str(&comment(&line));
        }
        let acting = |key: &Key| {
            let homes = METHODS.iter().filter(|spec| spec.acts_on(key));
            let homes: Vec<String> = homes.map(|spec| spec.described()).collect();
            format!("Acts in {}. ", homes.join(", "))
        };
        text + &self.sections(|key| !self.spec.acts_on(key), acting)
    }

    /// The keys that are wanted, section by section, each meaning after a first sentence.
    fn sections(&self, wanted: impl Fn(&Key) -> bool, first: impl Fn(&Key) -> String) -> String {
        let mut text = String::new();
        for section in catalogue::sections() {
            let keys = section
                .keys
                .iter()
                .filter(|key| wanted(key) && !(is_first(key) && self.spec.acts_on(key)));
            let lines = keys.map(|key| self.line(key, &(first(key) + key.doc)));
            let lines: String = lines.collect();
            if !lines.is_empty() {
                text.push_str(&header(section));
                text.push_str(&lines);
            }
        }
        text
    }

    /// A comment that names the presets in which the key has another value.
    fn other_presets(&self, key: &Key, value: &Value) -> String {
        let others: Vec<String> = Preset::ALL
            .iter()
            .copied()
            .filter(|other| *other != self.preset && !matches!(key.section, "" | "data"))
            // Networks take two shapes.
            .filter(|_| !self.fallback.is_of_many())
            .filter_map(|other| Some((other, key.preset_value(other)?)))
            .filter(|(_, there)| there != value)
            .map(|(other, there)| format!("{other}: {there}"))
            .collect();
        if others.is_empty() {
            String::new()
        } else {
            format!("  # {}", others.join(", "))
        }
    }
}

fn is_first(key: &Key) -> bool {
    FIRST.iter().any(|(id, _)| key.id() == *id)
}

/// The comment above a group of sections.
fn title(text: &str) -> String {
    format!("\n# ===== {text} =====\n")
}

/// The comment above the keys of a section.
fn header(section: &Section) -> String {
    format!(
        "\n# --- {}: {}",
        section.name,
        comment(section.doc).trim_start_matches("# ")
    )
}
