//! The files that a folder or a pattern stands for, in the order in which people count.

use std::cmp::Ordering;
use std::io;
use std::path::{Path, PathBuf};

/// Endings of the files of a folder that are shapes for certain; a pattern may name others.
const SHAPES: [&str; 10] = [
    "ply", "obj", "stl", "off", "glb", "gltf", "npy", "npz", "xyz", "pts",
];

/// Whether a path stands for many files: a folder, or one whose last part has `*`, `?` or `[`.
pub(super) fn stands_for_many(path: &Path) -> bool {
    path.is_dir() || (!path.exists() && name(path).contains(['*', '?', '[']))
}

/// The files that a folder or a pattern stands for.
///
/// # Errors
/// What the file system says, or what is wrong with the pattern.
pub fn listed(path: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = if path.is_dir() {
        files_in(path, &SHAPES).map_err(|error| error.to_string())?
    } else {
        // Patterns act in the name of the file alone: a whole tree is not searched by accident.
        let folder = path.parent().unwrap_or(Path::new(""));
        let folder = glob::Pattern::escape(&folder.to_string_lossy());
        let pattern = Path::new(&folder).join(name(path));
        let pattern = pattern.to_string_lossy();
        let visible = glob::MatchOptions {
            require_literal_leading_dot: true,
            ..glob::MatchOptions::default()
        };
        let found = glob::glob_with(&pattern, visible).map_err(|error| error.to_string())?;
        let files: Result<Vec<PathBuf>, _> = found.collect();
        in_order(files.map_err(|error| error.to_string())?)
    };
    files.retain(|file| file.is_file());
    Ok(files)
}

/// What a folder holds whose names have one of these endings, in the order in which people count.
///
/// # Errors
/// What the file system says.
pub fn files_in(folder: &Path, endings: &[&str]) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let file = entry?.path();
        let ending = file.extension().unwrap_or_default();
        let known = endings
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known));
        // A hidden file is no frame: some systems leave one beside each file.
        if known && !name(&file).starts_with('.') {
            files.push(file);
        }
    }
    Ok(in_order(files))
}

/// Files of one folder in the order of their names.
fn in_order(mut files: Vec<PathBuf>) -> Vec<PathBuf> {
    files.sort_by(|a, b| natural_order(&name(a), &name(b)));
    files
}

fn name(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Names in the order in which people count: runs of digits compare as numbers.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(x), Some(y)) = (left.chars().next(), right.chars().next()) {
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let (one, other) = (take_digits(&mut left), take_digits(&mut right));
            // Without leading zeros the longer number is the greater, whatever its size.
            one.len().cmp(&other.len()).then(one.cmp(other))
        } else {
            (left, right) = (&left[x.len_utf8()..], &right[y.len_utf8()..]);
            x.cmp(&y)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    // One is the beginning of the other, or they differ in leading zeros only.
    left.len().cmp(&right.len()).then(a.cmp(b))
}

/// Takes the digits that the text begins with, and gives them without leading zeros.
fn take_digits<'a>(text: &mut &'a str) -> &'a str {
    let end = text
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    digits.trim_start_matches('0')
}
