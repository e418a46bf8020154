//! A file of jobs, and the recipe of each.
//!
//! ```toml
//! folder = "runs/scans"            # where the runs go; runs/NAME of this file without it
//! preset = "instant"               # or recipe = "base.toml"
//! set = ["result.frames=5"]        # for all
//!
//! [[job]]
//! source = "a.ply"
//! target = "b.ply"
//!
//! [all-pairs]                      # each two of these
//! files = "scans/*.ply"
//!
//! [neighbours]                     # each with the next
//! files = ["week-1.ply", "week-2.ply", "week-3.ply"]
//! ```

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use isomorph_training::recipe::{Correspondences, Recipe, RecipeError, listed};
use serde::Deserialize;

use crate::error::{Error, Result};

/// The file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct JobsFile {
    folder: Option<PathBuf>,
    preset: Option<String>,
    recipe: Option<PathBuf>,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    job: Vec<JobEntry>,
    all_pairs: Option<Group>,
    neighbours: Option<Group>,
}

/// A job of its own.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct JobEntry {
    name: Option<String>,
    source: Option<PathBuf>,
    target: Option<PathBuf>,
    sequence: Option<PathBuf>,
    keys: Option<Vec<u32>>,
    correspondences: Option<String>,
    #[serde(default)]
    set: Vec<String>,
}

/// Jobs of many files.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Group {
    files: Files,
    correspondences: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Files {
    Pattern(PathBuf),
    List(Vec<PathBuf>),
}

/// What one run is of.
#[derive(Clone, Debug, PartialEq)]
enum Shapes {
    Pair([PathBuf; 2]),
    Sequence(PathBuf, Option<Vec<u32>>),
}

/// One run of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Its name, which no other job of the batch has; stays the same as long as its files do.
    pub name: String,
    /// Whether the file gives the name.
    is_named: bool,
    shapes: Shapes,
    correspondences: Option<String>,
    set: Vec<String>,
}

impl Job {
    /// Its shapes, for people.
    pub fn files(&self) -> [String; 2] {
        let text = |path: &Path| path.display().to_string();
        match &self.shapes {
            Shapes::Pair([source, target]) => [text(source), text(target)],
            Shapes::Sequence(path, keys) => [
                text(path),
                keys.as_ref()
                    .map_or_else(|| "all frames".to_owned(), |keys| format!("keys {keys:?}")),
            ],
        }
    }
}

/// All runs of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// The file.
    pub path: PathBuf,
    /// Where the runs go.
    pub folder: PathBuf,
    /// The jobs, in the order of the file.
    pub jobs: Vec<Job>,
    /// Keys that all recipes begin with: of a preset, or of a recipe.
    base: Base,
    set: Vec<String>,
}

#[derive(Clone, Debug, PartialEq)]
enum Base {
    Preset(String),
    Recipe(PathBuf),
}

impl Batch {
    /// Reads a file of jobs. The shapes themselves are not looked at.
    ///
    /// # Errors
    /// The line and the cause where it is no such file; jobs of one name; a pattern that fits nothing.
    pub fn read(path: &Path) -> Result<Self> {
        let within = |text: String| Error::usage(format!("{}: {text}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| within(error.to_string()))?;
        let file: JobsFile = toml::from_str(&text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start.min(text.len()));
            let line = 1 + text[..start].matches('\n').count();
            let message = error.message().replace('\n', " ");
            Error::usage(format!("{}:{line}: {message}", path.display()))
        })?;
        let place = path.parent().unwrap_or(Path::new(""));
        let base = match (file.preset, file.recipe) {
            (Some(_), Some(_)) => {
                return Err(within(
                    "has a preset and a recipe; name one of them".to_owned(),
                ));
            }
            (None, Some(recipe)) => Base::Recipe(place.join(recipe)),
            (preset, None) => Base::Preset(preset.unwrap_or_else(|| "instant".to_owned())),
        };
        let mut jobs = Vec::new();
        for (k, entry) in file.job.into_iter().enumerate() {
            jobs.push(
                entry
                    .job(place)
                    .map_err(|text| within(format!("job {}: {text}", k + 1)))?,
            );
        }
        for (group, word, reaches) in [
            (file.all_pairs, "all-pairs", usize::MAX),
            (file.neighbours, "neighbours", 1),
        ] {
            let Some(group) = group else { continue };
            let files = group
                .paths(place)
                .map_err(|text| within(format!("[{word}]: {text}")))?;
            for (i, source) in files.iter().enumerate() {
                for target in files[i + 1..].iter().take(reaches) {
                    jobs.push(Job {
                        name: pair_name(source, target, stem),
                        is_named: false,
                        shapes: Shapes::Pair([source.clone(), target.clone()]),
                        correspondences: (group.correspondences.clone())
                            .map(|known| placed(known, place)),
                        set: Vec::new(),
                    });
                }
            }
        }
        if jobs.is_empty() {
            let text = "has no jobs; give [[job]], [all-pairs] or [neighbours]";
            return Err(within(text.to_owned()));
        }
        tell_apart(&mut jobs).map_err(within)?;
        let stem = path.file_stem().unwrap_or_default();
        Ok(Self {
            path: path.to_path_buf(),
            folder: file
                .folder
                .map_or_else(|| Path::new("runs").join(stem), |folder| place.join(folder)),
            jobs,
            base,
            set: file.set,
        })
    }

    /// The run of a job.
    pub fn run(&self, job: &Job) -> PathBuf {
        self.folder.join(&job.name)
    }

    /// The job of a name.
    ///
    /// # Errors
    /// There is none.
    pub fn job(&self, name: &str) -> Result<&Job> {
        let found = self.jobs.iter().find(|job| job.name == name);
        found.ok_or_else(|| Error::usage(format!("{}: has no job {name:?}", self.path.display())))
    }

    /// Where the error of a job stands that could not begin.
    pub(super) fn error_file(&self, job: &Job) -> PathBuf {
        self.folder.join("errors").join(format!("{}.txt", job.name))
    }

    /// The preset that all recipes begin with, if they do.
    pub fn preset(&self) -> Option<&str> {
        match &self.base {
            Base::Preset(preset) => Some(preset),
            Base::Recipe(_) => None,
        }
    }

    /// The recipe of a job.
    ///
    /// # Errors
    /// A key or a value that no recipe has.
    pub fn recipe(&self, job: &Job) -> Result<Recipe> {
        let named = |error: RecipeError| {
            Error::usage(format!(
                "{}: job {}: {error}",
                self.path.display(),
                job.name
            ))
        };
        let mut given = Vec::new();
        let mut recipe = match &self.base {
            Base::Recipe(base) => {
                let Shapes::Pair([source, target]) = &job.shapes else {
                    let text = "a sequence takes a preset, not a recipe of two shapes";
                    return Err(Error::usage(format!(
                        "{}: job {}: {text}",
                        self.path.display(),
                        job.name
                    )));
                };
                for (end, path) in [("source", source), ("target", target)] {
                    let path = std::path::absolute(path)?;
                    given.push(format!("data.{end}={}", path.display()));
                }
                Recipe::read(base, &[]).map_err(named)?
            }
            Base::Preset(preset) => match &job.shapes {
                Shapes::Pair([source, target]) => {
                    given.push(format!("preset={preset}"));
                    Recipe::between(source, target).map_err(named)?
                }
                Shapes::Sequence(path, keys) => {
                    sequence(path, keys.as_deref(), preset).map_err(named)?
                }
            },
        };
        given.extend(
            job.correspondences
                .iter()
                .map(|known| format!("data.correspondences={known}")),
        );
        given.extend(self.set.iter().chain(&job.set).cloned());
        recipe.with_all(&given).map_err(named)?;
        Ok(recipe)
    }
}

/// The recipe of a sequence.
fn sequence(
    path: &Path,
    keys: Option<&[u32]>,
    preset: &str,
) -> std::result::Result<Recipe, RecipeError> {
    let mut data = toml::Table::new();
    data.insert("sequence".into(), path.display().to_string().into());
    if let Some(keys) = keys {
        let keys = keys.iter().map(|key| toml::Value::Integer(i64::from(*key)));
        data.insert("keys".into(), keys.collect::<Vec<_>>().into());
    }
    let mut all = toml::Table::new();
    all.insert("preset".into(), preset.into());
    all.insert("data".into(), data.into());
    Recipe::parse(&all.to_string(), Path::new(""), &[])
}

impl JobEntry {
    fn job(self, place: &Path) -> std::result::Result<Job, String> {
        let shapes = match (self.source, self.target, self.sequence) {
            (Some(source), Some(target), None) => {
                if self.keys.is_some() {
                    return Err("keys are those of a sequence".to_owned());
                }
                Shapes::Pair([place.join(source), place.join(target)])
            }
            (None, None, Some(sequence)) => Shapes::Sequence(place.join(sequence), self.keys),
            _ => return Err("give source and target, or a sequence".to_owned()),
        };
        let is_named = self.name.is_some();
        let name = self.name.unwrap_or_else(|| match &shapes {
            Shapes::Pair([source, target]) => pair_name(source, target, stem),
            Shapes::Sequence(path, _) => plain(&stem(path)),
        });
        let is_plain = !name.is_empty() && name == plain(&name) && name != "errors";
        if !is_plain {
            return Err(format!(
                "{name:?} is no name: letters, digits and . _ - alone"
            ));
        }
        Ok(Job {
            name,
            is_named,
            shapes,
            correspondences: self.correspondences.map(|known| placed(known, place)),
            set: self.set,
        })
    }
}

impl Group {
    fn paths(&self, place: &Path) -> std::result::Result<Vec<PathBuf>, String> {
        let paths = match &self.files {
            Files::List(paths) => paths.iter().map(|path| place.join(path)).collect(),
            Files::Pattern(pattern) => listed(&place.join(pattern))?,
        };
        match paths.len() {
            0 | 1 => Err(format!("{} files: two or more are needed", paths.len())),
            _ => Ok(paths),
        }
    }
}

/// Names of jobs that share one have the folder of their files before it.
fn tell_apart(jobs: &mut [Job]) -> std::result::Result<(), String> {
    let count = |jobs: &[Job]| {
        let mut counts: HashMap<String, usize> = HashMap::new();
        for job in jobs {
            *counts.entry(job.name.clone()).or_default() += 1;
        }
        counts
    };
    let counts = count(jobs);
    for job in jobs.iter_mut().filter(|job| counts[&job.name] > 1) {
        if let (Shapes::Pair([source, target]), false) = (&job.shapes, job.is_named) {
            job.name = pair_name(source, target, |path| {
                let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
                format!("{}_{}", folder.to_string_lossy(), stem(path))
            });
        }
    }
    let counts = count(jobs);
    match jobs.iter().find(|job| counts[&job.name] > 1) {
        Some(job) => Err(format!(
            "{} jobs have the name {:?}; give each a name",
            counts[&job.name], job.name
        )),
        None => Ok(()),
    }
}

/// A word for correspondences as it is, and a file of them beside the file of jobs.
fn placed(known: String, place: &Path) -> String {
    match Correspondences::WORDS.contains(&&known[..]) {
        true => known,
        false => place.join(known).display().to_string(),
    }
}

fn pair_name(source: &Path, target: &Path, part: impl Fn(&Path) -> String) -> String {
    plain(&format!("{}-{}", part(source), part(target)))
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// A name as a folder of any system may have it.
fn plain(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let name: String = name
        .chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect();
    // None that begins with a dot is hidden or leads elsewhere.
    name.trim_start_matches('.').to_owned()
}

#[cfg(test)]
#[path = "jobs_tests.rs"]
mod tests;
