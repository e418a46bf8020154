//! From text to recipe: values of a file and of `--set`, the preset's for all that is left out, checked
//! together.

use std::path::Path;

use super::data::{DataRecipe, KEYFRAME, KeyframeRecipe};
use super::entry::{Entries, Entry, Place, keyframe_id};
use super::error::RecipeError;
use super::fallback::Fallback;
use super::frames::Frames;
use super::keys::{DataKeys, PRESET};
use super::rule::Value;
use super::schema::{Key, Keyed, Section};
use super::setting::Setting;
use super::source::Reading;
use super::words::{GeometryKind, Preset, VelocityKind};
use super::{MethodRecipe, Recipe, acting, catalogue, consistency, frames, old, source};
use crate::method::spline::is_solved;
use crate::method::{self, MethodSpec, spec_of};

impl Recipe {
    /// Reads the recipe at `path`; `overrides` are the arguments of `--set`, of which later ones
    /// win.
    ///
    /// # Errors
    /// If the file cannot be read, or for what [`Recipe::parse`] refuses.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Recipe, RecipeError> {
        let text = std::fs::read_to_string(path).map_err(|reason| RecipeError::Unreadable {
            path: path.to_owned(),
            reason,
        })?;
        Recipe::parse(&text, path, overrides)
    }

    /// Reads a recipe from its text. `origin` is its file: messages name it, and the paths in the
    /// recipe and in `overrides` are relative to its folder.
    ///
    /// # Errors
    /// On the first thing that is not TOML, not a key, of the wrong type, out of range, without effect in
    /// the chosen method, at odds with another value, or missing; and where training on its key frames is
    /// not possible yet.
    pub fn parse(text: &str, origin: &Path, overrides: &[String]) -> Result<Recipe, RecipeError> {
        let mut entries = source::read_text(text, origin, &mut Reading::Strict)?;
        for given in overrides {
            source::read_override(given, &mut entries)?;
        }
        source::make_paths_absolute(&mut entries, origin.parent().unwrap_or(Path::new("")))?;
        let at = frames::place(&entries);
        let recipe = resolve(entries, origin, None)?;
        recipe.trainable(|| at.unwrap_or_else(|| origin.display().to_string()))?;
        Ok(recipe)
    }

    /// Reads a recipe that is stored with a run, of this version or an earlier one, and notes on what this
    /// version leaves out of it.
    ///
    /// Keys that do nothing are left out silently, and keys that moved are taken where they were.
    ///
    /// # Errors
    /// On what is not TOML, of the wrong type, out of range, at odds with another value, or missing.
    pub fn parse_stored(text: &str, origin: &Path) -> Result<(Recipe, Vec<String>), RecipeError> {
        let mut notes = Vec::new();
        let mut entries = source::read_text(text, origin, &mut Reading::Stored(&mut notes))?;
        source::make_paths_absolute(&mut entries, origin.parent().unwrap_or(Path::new("")))?;
        let recipe = resolve(entries, origin, Some(&mut notes))?;
        Ok((recipe, notes))
    }

    /// The preset "instant" through shapes at ascending times, their paths made absolute.
    ///
    /// # Errors
    /// If there are fewer than two shapes, times do not ascend, or a path is not Unicode.
    pub fn through<P: AsRef<Path>>(shapes: &[(P, f64)]) -> Result<Recipe, RecipeError> {
        let mut entries = Entries::new();
        let instant = Preset::Instant.to_value().expect("a word");
        entries.insert(PRESET.id(), Entry::new(&PRESET, instant, Place::Held));
        for (index, (path, time)) in shapes.iter().enumerate() {
            let file = Value::Text(source::unicode(path.as_ref())?.to_owned());
            let values = [file, Value::Number(*time)];
            for (key, value) in KEYFRAME.iter().zip(values) {
                let entry = Entry::new(key, value, Place::Held);
                entries.insert(keyframe_id(index, key), entry);
            }
        }
        source::make_paths_absolute(&mut entries, Path::new(""))?;
        resolve(entries, Path::new("recipe"), None)
    }

    /// The preset "default" between two shapes, their paths made absolute.
    ///
    /// # Errors
    /// If a path is not Unicode, or cannot be made absolute.
    pub fn between(
        source: impl AsRef<Path>,
        target: impl AsRef<Path>,
    ) -> Result<Recipe, RecipeError> {
        let mut entries = Entries::new();
        let files = [
            ("data.source", source.as_ref()),
            ("data.target", target.as_ref()),
        ];
        for (id, path) in files {
            let key = catalogue::by_id(id).expect("a key of the table");
            let path = Value::Text(source::unicode(path)?.to_owned());
            entries.insert(key.id(), Entry::new(key, path, Place::Held));
        }
        source::make_paths_absolute(&mut entries, Path::new(""))?;
        resolve(entries, Path::new("recipe"), None)
    }

    /// Changes one key, given as `section.key=value` as in `--set`. With another preset, all keys that had the
    /// value of the old one have that of the new one. A relative path is one from the working directory. What the recipe says and the changed method does not use is dropped.
    ///
    /// # Errors
    /// For what [`Recipe::parse`] refuses; the recipe is then as it was.
    pub fn with(&mut self, given: &str) -> Result<(), RecipeError> {
        self.with_all(&[given.to_owned()])
    }

    /// Changes several keys at once, so that only what they make together has to be a recipe.
    ///
    /// # Errors
    /// For what [`Recipe::parse`] refuses; the recipe is then as it was.
    pub fn with_all(&mut self, overrides: &[String]) -> Result<(), RecipeError> {
        let mut entries = self.held();
        for given in overrides {
            source::read_override(given, &mut entries)?;
        }
        source::make_paths_absolute(&mut entries, Path::new(""))?;
        let changed = resolve(entries, Path::new("recipe"), None)?;
        changed.trainable(|| "the recipe".to_owned())?;
        *self = changed;
        Ok(())
    }

    /// Appends key frames, each a shape with its time in the recipe's unit, their paths made absolute. `known`, in the
    /// words of `data.correspondences`, is what is known of the points from the key frame before each of them to it;
    /// without it, what is known between the last two. Keys that had the preset's value have that of so many key frames.
    ///
    /// # Errors
    /// If times do not ascend, the key frames are frames of a sequence, the method takes two, or `known` is neither word
    /// nor path; the recipe is then as it was.
    pub fn append<P: AsRef<Path>>(
        &mut self,
        shapes: &[(P, f64)],
        known: Option<&str>,
    ) -> Result<(), RecipeError> {
        let count = self.data.keyframes.len();
        let mut longer = self.clone();
        let data = &mut longer.data;
        let known = match known {
            Some(text) => source::pairs_of(text)?,
            None => data.between[count - 2].clone(),
        };
        for (path, time) in shapes {
            if data.keyframes.iter().any(|key| key.frame.is_some()) {
                return Err(RecipeError::KeyFrames {
                    at: format!("{}: {}", Place::Held, path.as_ref().display()),
                    problem: "the key frames before it are frames of a sequence; append to data.keys, as in --set \
                              \"data.keys=[0, 10, 20]\""
                        .to_owned(),
                });
            }
            data.keyframes.push(KeyframeRecipe {
                file: path.as_ref().to_owned(),
                frame: None,
                time: *time,
            });
            data.between.push(known.clone());
        }
        let mut entries = longer.held_above(count);
        source::make_paths_absolute(&mut entries, Path::new(""))?;
        let longer = resolve(entries, Path::new("recipe"), None)?;
        longer.trainable(|| "the recipe".to_owned())?;
        *self = longer;
        Ok(())
    }

    /// Whether its method can be trained on so many key frames; `at`: where they are named.
    fn trainable(&self, at: impl FnOnce() -> String) -> Result<(), RecipeError> {
        let keys = self.data.keyframes.len();
        let spec = spec_of(self);
        if keys > 2 && !spec.takes_many {
            let method = spec.described();
            return Err(RecipeError::ManyKeyFrames {
                at: at(),
                keys,
                method,
            });
        }
        if keys > 2 && !is_solved(self) && !self.velocity.time_dependent {
            return Err(RecipeError::Stationary { at: at(), keys });
        }
        Ok(())
    }

    /// Everything that the recipe says. What has the preset's value is the preset's, so that another preset
    /// brings its own.
    fn held(&self) -> Entries {
        self.held_above(self.data.keyframes.len())
    }

    /// The same, where the preset's values are those of so many key frames.
    fn held_above(&self, key_frames: usize) -> Entries {
        let held = |key, value| Entry::new(key, value, Place::Held);
        let fallback = Fallback::new(self.preset, spec_of(self), key_frames);
        let own =
            |(key, value): &(&'static Key, Value)| fallback.value(key).as_ref() != Some(value);
        let values = self.acting().into_iter().filter(own);
        let mut entries: Entries = values
            .map(|(key, value)| (key.id(), held(key, value)))
            .collect();
        if let Some(preset) = self.preset.to_value() {
            entries.insert(PRESET.id(), held(&PRESET, preset));
        }
        for (index, values) in self.data.keyframe_values().into_iter().enumerate() {
            for (key, value) in KEYFRAME.iter().zip(values) {
                let entry = value.map(|value| held(key, value));
                entries.extend(entry.map(|entry| (keyframe_id(index, key), entry)));
            }
        }
        entries
    }
}

/// A recipe from what was given; `notes` are taken if another version may have written it.
fn resolve(
    mut entries: Entries,
    origin: &Path,
    notes: Option<&mut Vec<String>>,
) -> Result<Recipe, RecipeError> {
    let given = |key: &Key| entries.get(&key.id()).map(|entry| entry.value.clone());
    let preset = given(&PRESET).and_then(Preset::from_value);
    let preset = preset.unwrap_or(Preset::Default);
    let spec = chosen(|key| given(key).or_else(|| key.preset_value(preset)));
    match notes {
        None => acting::settle(&mut entries, spec)?,
        Some(notes) => {
            old::complete(&mut entries);
            acting::settle_stored(&mut entries, spec, notes);
        }
    }
    let frames = frames::read(&entries, origin)?;
    let fallback = Fallback::new(preset, spec, frames.0.len());
    for key in catalogue::keys().filter(|key| spec.acts_on(key)) {
        if let Some(value) = fallback.value(key) {
            let left_out = Entry::new(key, value, fallback.place());
            entries.entry(key.id()).or_insert(left_out);
        }
    }
    consistency::check(&entries, spec, &frames.1)?;
    Ok(assemble(&mut entries, preset, spec, frames))
}

/// The method that a recipe with these values chooses.
fn chosen(value: impl Fn(&Key) -> Option<Value>) -> &'static MethodSpec {
    let word = |key: &Key| value(key).expect("every preset gives it");
    let geometry = catalogue::by_id("implicit.geometry").expect("a key of the table");
    let geometry = GeometryKind::from_value(word(geometry)).expect("it has passed its rule");
    let kind = catalogue::by_id("velocity.kind").expect("a key of the table");
    let kind = VelocityKind::from_value(word(kind)).expect("it has passed its rule");
    let Value::Text(name) = word(catalogue::method()) else {
        unreachable!("a word is text");
    };
    method::spec(&name, geometry, kind).expect("the name has passed its rule")
}

/// The typed recipe; keys without an entry have the preset's value.
fn assemble(
    entries: &mut Entries,
    preset: Preset,
    spec: &'static MethodSpec,
    (keyframes, between): Frames,
) -> Recipe {
    let mut values = |section: &'static Section| -> Vec<Option<Value>> {
        let keys = section.keys.iter();
        keys.map(|key| {
            let given = entries.remove(&key.id()).map(|entry| entry.value);
            given.or_else(|| key.preset_value(preset))
        })
        .collect()
    };
    let data = DataKeys::from_values(values(DataKeys::SECTION));
    let own = spec.own.map_or_else(Vec::new, &mut values);
    Recipe {
        preset,
        data: DataRecipe {
            keyframes,
            between,
            points: data.points,
            correspondence_fraction: data.correspondence_fraction,
            normals: data.normals,
            clean: data.clean,
            clean_strays: data.clean_strays,
            clean_part: data.clean_part,
            align: data.align,
            mirrored: data.mirrored,
        },
        method: MethodRecipe { name: spec.name },
        own: own.into_iter().flatten().collect(),
        implicit: typed(&mut values),
        velocity: typed(&mut values),
        loss: typed(&mut values),
        training: typed(&mut values),
        checkpoint: typed(&mut values),
        result: typed(&mut values),
    }
}

fn typed<K: Keyed>(values: &mut impl FnMut(&'static Section) -> Vec<Option<Value>>) -> K {
    K::from_values(values(K::SECTION))
}
