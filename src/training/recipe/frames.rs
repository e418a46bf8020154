//! Key frames as they are written: `source` and `target`, a list of `[[data.keyframe]]`, or frames of a
//! sequence.

use std::path::{Path, PathBuf};

use super::data::{KEYFRAME, KeyframeRecipe};
use super::entry::{Entries, Entry, keyframe_id};
use super::error::RecipeError;
use super::files;
use super::keys::DataKeys;
use super::rule::Value;
use super::schema::{Key, Keyed};
use super::setting::Setting;
use super::words::Correspondences;

/// Key frames and what is known between each and the next.
pub(super) type Frames = (Vec<KeyframeRecipe>, Vec<Correspondences>);

/// The key frames that the entries give in one of the three ways.
///
/// # Errors
/// If they are given in two ways, are fewer than two, or do not ascend; or if a file or time is missing.
pub(super) fn read(entries: &Entries, origin: &Path) -> Result<Frames, RecipeError> {
    let first = entries.get(&keyframe_id(0, &KEYFRAME[0]));
    let first = first.or_else(|| entries.get(&keyframe_id(0, &KEYFRAME[1])));
    let get = |id: &str| entries.get(&format!("data.{id}"));
    let sequence = get("sequence").or_else(|| get("keys"));
    let short = get("source").or_else(|| get("target"));
    let given: Vec<&Entry> = [short, first, sequence].into_iter().flatten().collect();
    if let [one, other, ..] = given[..] {
        let other = format!("{} is given too ({})", other.key.id(), other.place);
        return Err(wrong(
            one,
            format!("{other}; give the key frames in one way"),
        ));
    }
    let known = get("correspondences").and_then(|entry| Setting::from_value(entry.value.clone()));
    let known = known.unwrap_or(Correspondences::None);
    if first.is_some() {
        listed(entries, origin, &known)
    } else if sequence.is_some() {
        of_sequence(entries, origin, known)
    } else {
        let file = |field: &str| text(entries.get(&format!("data.{field}")), data(field), origin);
        let [source, target] = [file("source")?, file("target")?];
        let key = |file: PathBuf, time: f64| KeyframeRecipe {
            file,
            frame: None,
            time,
        };
        Ok((vec![key(source, 0.0), key(target, 1.0)], vec![known]))
    }
}

/// From `[[data.keyframe]]`.
fn listed(
    entries: &Entries,
    origin: &Path,
    known: &Correspondences,
) -> Result<Frames, RecipeError> {
    let (mut frames, mut between) = (Vec::<KeyframeRecipe>::new(), Vec::new());
    loop {
        let index = frames.len();
        let [file, time, next] = [0, 1, 2].map(|k| entries.get(&keyframe_id(index, &KEYFRAME[k])));
        let Some(any) = file.or(time).or(next) else {
            break;
        };
        let file = text(file, &KEYFRAME[0], origin)?;
        let time = match time.map(|entry| &entry.value) {
            Some(Value::Number(time)) => *time,
            _ => return Err(missing(&KEYFRAME[1], origin)),
        };
        if let Some(before) = frames.last()
            && before.time >= time
        {
            let problem = format!(
                "its time {time} is not after {}, that of the key frame before; give them in \
                 ascending order",
                before.time
            );
            return Err(wrong(any, problem));
        }
        frames.push(KeyframeRecipe {
            file,
            frame: None,
            time,
        });
        let own = next.and_then(|entry| Setting::from_value(entry.value.clone()));
        between.push(own.unwrap_or_else(|| known.clone()));
    }
    let last = frames.len().saturating_sub(1);
    if let Some(next) = entries.get(&keyframe_id(last, &KEYFRAME[2])) {
        let problem = "no key frame follows the last one; delete this line".to_owned();
        return Err(wrong(next, problem));
    }
    if frames.len() < 2
        && let Some(only) = entries.get(&keyframe_id(0, &KEYFRAME[0]))
    {
        let problem = "it is the only key frame; give at least two".to_owned();
        return Err(wrong(only, problem));
    }
    between.pop();
    Ok((frames, between))
}

/// From `sequence` and `keys`.
fn of_sequence(
    entries: &Entries,
    origin: &Path,
    known: Correspondences,
) -> Result<Frames, RecipeError> {
    let file = text(entries.get("data.sequence"), data("sequence"), origin)?;
    let many = files::stands_for_many(&file);
    let entry = entries.get("data.keys");
    if entry.is_none() && many {
        let all = files_of(entries, &file)?;
        let keys: Vec<usize> = (0..all.len()).collect();
        return of_files(entries, &all, &keys, &known);
    }
    let entry = entry.ok_or_else(|| missing(data("keys"), origin))?;
    let Value::Numbers(keys) = &entry.value else {
        return Err(missing(data("keys"), origin));
    };
    let ascend = keys.windows(2).all(|pair| pair[0] < pair[1]);
    let whole = keys.iter().all(|key| key.fract() == 0.0);
    if keys.len() < 2 || !ascend || !whole {
        return Err(RecipeError::Refused {
            at: entry.about(),
            allowed: "at least two whole numbers in ascending order".to_owned(),
        });
    }
    if many {
        let all = files_of(entries, &file)?;
        let keys: Vec<usize> = keys.iter().map(|key| *key as usize).collect();
        if let Some(beyond) = keys.iter().find(|key| **key >= all.len()) {
            let count = all.len();
            let problem = format!("there is no frame {beyond}: {count} files, counted from 0");
            return Err(wrong(entry, problem));
        }
        return of_files(entries, &all, &keys, &known);
    }
    let frames = keys.iter().map(|key| KeyframeRecipe {
        file: file.clone(),
        frame: Some(*key as usize),
        time: *key,
    });
    Ok((frames.collect(), vec![known; keys.len() - 1]))
}

/// The files of a folder or a pattern.
fn files_of(entries: &Entries, path: &Path) -> Result<Vec<PathBuf>, RecipeError> {
    let entry = entries
        .get("data.sequence")
        .expect("the path came from there");
    files::listed(path).map_err(|reason| wrong(entry, reason))
}

/// Some of these files, each at the time that is its number.
fn of_files(
    entries: &Entries,
    all: &[PathBuf],
    keys: &[usize],
    known: &Correspondences,
) -> Result<Frames, RecipeError> {
    if keys.len() < 2
        && let Some(entry) = entries.get("data.sequence")
    {
        let count = all.len();
        let problem = format!("there are {count} shapes in this place; give two or more");
        return Err(wrong(entry, problem));
    }
    let frames = keys.iter().map(|key| KeyframeRecipe {
        file: all[*key].clone(),
        frame: None,
        time: *key as f64,
    });
    Ok((frames.collect(), vec![known.clone(); keys.len() - 1]))
}

/// Where the recipe names its key frames.
pub(super) fn place(entries: &Entries) -> Option<String> {
    let first = entries.get(&keyframe_id(0, &KEYFRAME[0]));
    let entry = first.or_else(|| entries.get("data.sequence"))?;
    Some(entry.place.to_string())
}

fn data(field: &str) -> &'static Key {
    let found = DataKeys::SECTION.keys.iter().find(|key| key.field == field);
    found.expect("a key of the section's table")
}

fn text(entry: Option<&Entry>, key: &Key, origin: &Path) -> Result<PathBuf, RecipeError> {
    match entry.map(|entry| &entry.value) {
        Some(Value::Text(text)) => Ok(text.into()),
        _ => Err(missing(key, origin)),
    }
}

fn wrong(entry: &Entry, problem: String) -> RecipeError {
    RecipeError::KeyFrames {
        at: entry.about(),
        problem,
    }
}

/// A key without which no recipe works.
fn missing(key: &Key, origin: &Path) -> RecipeError {
    let header = match key.section {
        "data.keyframe" => "[[data.keyframe]]".to_owned(),
        section => format!("[{section}]"),
    };
    RecipeError::Missing {
        path: origin.to_owned(),
        key: key.id(),
        header,
        allowed: key.rule.allowed(),
    }
}
