//! Files of pairs: text, or arrays of numpy (`.npy`, `.npz`).
//!
//! | columns | what they are |
//! |---|---|
//! | 1 | a point-to-point map: for each vertex of the source, in order, the target's vertex, or -1 for none |
//! | 2 | the source's vertex and the target's |
//! | 3 | the same and a confidence from 0 to 1, which `isomorph match` writes; it may be missing on some lines |
//! | one for each of many key frames | a point on each line: its vertex in each key frame, or -1 where it is not known |
//!
//! Numbers in text are separated by commas, semicolons, spaces or tabs. Empty lines, lines that start with `#` and one
//! line of column names before the first are passed over. A column before the others without a name is passed over too,
//! where the others have names. Whole numbers may be written as `12.0`. A vertex may occur more than once.
//!
//! Vertices count from 0, in the order of their files. They count from 1 if a comment says `# counted from 1`, or if
//! none is 0 and one is the number of the vertices, or near vertices stay near that way alone; then a note says so.

mod counting;
mod tracks;

use std::path::Path;

use super::correspond::Correspondences;
use crate::formats::{
    Array, Arrays, Shape, ShapeError, fields, file_bytes, lines, refuse_utf_16, shown,
};

/// Names of arrays in an archive, in lower case.
const NAMES: [&str; 5] = ["pairs", "correspondences", "matches", "p2p", "map"];

/// What a line of pairs must be.
const ALLOWED: &str = "must be source_index,target_index, two whole numbers from 0 (and a confidence from 0 to 1, if any)";

/// A line, or a row of an array.
struct Row {
    /// Counted from 1 as lines, from 0 as rows.
    at: usize,
    pair: [u64; 2],
    confidence: Option<f32>,
}

/// What the columns of a file may be.
#[derive(Clone, Copy)]
enum Layout {
    /// Those of two shapes.
    Pairs,
    /// One for each of so many key frames, either number, of which `k` and the next count.
    Tracks { k: usize, key_frames: [usize; 2] },
}

/// What a file holds.
#[derive(Default)]
struct Rows {
    rows: Vec<Row>,
    /// Lines or rows, with those that have no partner.
    count: usize,
    /// Whether there is one column.
    is_map: bool,
    /// Whether places are rows of an array, not lines.
    is_array: bool,
    /// The number of the first vertex, where the file says it.
    declared: Option<u64>,
}

impl Correspondences {
    /// Reads pairs of vertices of `source` and `target`.
    ///
    /// # Errors
    /// The file and the line, where a line is not of whole numbers or a vertex does not exist; a map that has not one
    /// line for each vertex of the source; [`ShapeError::NoCorrespondences`] if it holds no pair at all.
    pub fn read(path: &Path, source: &Shape, target: &Shape) -> Result<Self, ShapeError> {
        Self::read_as(path, Layout::Pairs, [source, target])
    }

    /// Reads what a file of many key frames has of key frame `k` and the next, which are the shapes. A file without a
    /// column for each key frame is one of pairs, the same between any two. It may be about all key frames, or about the
    /// first ones alone: `key_frames` are both numbers.
    ///
    /// # Errors
    /// Those of [`Self::read`].
    pub(crate) fn read_between(
        path: &Path,
        k: usize,
        key_frames: [usize; 2],
        shapes: [&Shape; 2],
    ) -> Result<Self, ShapeError> {
        Self::read_as(path, Layout::Tracks { k, key_frames }, shapes)
    }

    fn read_as(path: &Path, layout: Layout, shapes: [&Shape; 2]) -> Result<Self, ShapeError> {
        let ending = path.extension().unwrap_or_default();
        let is_array = ["npy", "npz"]
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known));
        let found = if is_array {
            Rows::of_arrays(path, layout)?
        } else {
            let bytes = file_bytes(path)?;
            refuse_utf_16(path, &bytes)?;
            Rows::of_text(path, &bytes, layout)?
        };
        found.resolve(path, shapes)
    }

    /// The pairs in the text of such a file; `path` opens the messages.
    ///
    /// # Errors
    /// Those of [`Self::read`], but for the file itself.
    pub(crate) fn parse(
        text: &str,
        path: &Path,
        source: &Shape,
        target: &Shape,
    ) -> Result<Self, ShapeError> {
        Rows::of_text(path, text.as_bytes(), Layout::Pairs)?.resolve(path, [source, target])
    }
}

impl Correspondences {
    /// The text of a file of these pairs: a line of names, then a pair on each line, with its confidence where pairs
    /// have one.
    pub(crate) fn text(&self) -> String {
        let sure = |k: usize| self.confidence.get(k).map(|sure| format!(",{sure:.3}"));
        let mut text = String::from("source_index,target_index");
        text += if self.confidence.is_empty() {
            "\n"
        } else {
            ",confidence\n"
        };
        for (k, [source, target]) in self.pairs.iter().enumerate() {
            text += &format!("{source},{target}{}\n", sure(k).unwrap_or_default());
        }
        text
    }
}

/// What the first line of a text that is no comment says of the others.
#[derive(Default)]
struct Heading {
    is_passed: bool,
    /// Whether the first column is an index.
    has_index: bool,
}

impl Heading {
    /// The fields of the next line that is no comment; none of a line of names.
    fn fields_below<'a>(&mut self, line: &'a str) -> Option<Vec<&'a str>> {
        let mut fields: Vec<&str> = fields(line).collect();
        if !std::mem::replace(&mut self.is_passed, true) && are_names(&fields) {
            // As pandas writes its index: a column without a name.
            self.has_index = fields.len() > 2 && unquoted(fields[0]).is_empty();
            return None;
        }
        if self.has_index && !fields.is_empty() {
            fields.remove(0);
        }
        Some(fields)
    }
}

impl Rows {
    fn of_text(path: &Path, bytes: &[u8], layout: Layout) -> Result<Self, ShapeError> {
        let mut found = Self::default();
        let tracks = tracks::columns(layout, || tracks::rows_of_text(bytes));
        let mut heading = Heading::default();
        for (at, line) in lines(bytes) {
            if let Some(comment) = line.strip_prefix('#') {
                let is = |first: u64| {
                    comment
                        .contains(&format!("counted from {first}"))
                        .then_some(first)
                };
                found.declared = found.declared.or(is(0)).or(is(1));
                continue;
            }
            let Some(fields) = heading.fields_below(&line) else {
                continue;
            };
            let wrong = |allowed: &str| {
                ShapeError::line(path, at, format!("{:?}: {allowed}", shown(&line)))
            };
            if let Some(columns) = tracks {
                let known = tracks::of_fields(&fields, columns);
                found.push_tracked(at, known.ok_or_else(|| wrong(tracks::ALLOWED))?);
                continue;
            }
            if found.count == 0 {
                found.is_map = fields.len() == 1;
            }
            if found.is_map {
                let allowed =
                    "must be the target's vertex, one whole number on each line, or -1 for none";
                let [target] = fields[..] else {
                    return Err(wrong(allowed));
                };
                let target = whole_number(target).ok_or_else(|| wrong(allowed))?;
                found
                    .push_mapped(at, target)
                    .ok_or_else(|| wrong(allowed))?;
            } else {
                let (pair, confidence) = parse_pair(&fields).ok_or_else(|| wrong(ALLOWED))?;
                found.push(Row {
                    at,
                    pair,
                    confidence,
                });
            }
        }
        Ok(found)
    }

    fn of_arrays(path: &Path, layout: Layout) -> Result<Self, ShapeError> {
        let mut arrays = Arrays::open(path)?;
        let only = (arrays.names.len() == 1).then_some(0);
        let Some(at) = arrays.find(&NAMES).or(only) else {
            let names = shown(&arrays.names.join(", "));
            let problem =
                format!("no array named pairs or p2p (it has: {names}); name the pairs so");
            return Err(ShapeError::malformed(path, problem));
        };
        let array = arrays.read(at)?;
        Self::of_array(&array, layout).map_err(|problem| arrays.wrong(at, &problem))
    }

    fn of_array(array: &Array, layout: Layout) -> Result<Self, String> {
        if let Some(columns) = tracks::columns(layout, || tracks::rows_of_array(array)) {
            let mut found = Self {
                is_array: true,
                ..Self::default()
            };
            for (at, row) in array.values.chunks_exact(columns.of).enumerate() {
                let known = tracks::of_numbers(row, columns);
                let wrong = || format!("row {at} is {row:?}: {}", tracks::ALLOWED);
                found.push_tracked(at, known.ok_or_else(wrong)?);
            }
            return Ok(found);
        }
        let width = match array.shape[..] {
            [_] => 1,
            [_, width @ 1..=3] => width,
            _ => {
                let shape = array.described();
                return Err(format!(
                    "shape {shape}: must be (n,) as a map, or (n, 2) or (n, 3) as pairs"
                ));
            }
        };
        let mut found = Self {
            is_map: width == 1,
            is_array: true,
            ..Self::default()
        };
        for (at, row) in array.values.chunks_exact(width).enumerate() {
            let wrong = |allowed: &str| format!("row {at} is {row:?}: {allowed}");
            // Beyond 2^53 numbers are not exact, and no shape has so many vertices.
            let whole = |x: f64| (x.fract() == 0.0 && x.abs() < 9e15).then_some(x as i64);
            if let &[target] = row {
                let allowed = "must be the target's vertex, a whole number, or -1 for none";
                let target = whole(target).ok_or_else(|| wrong(allowed))?;
                found
                    .push_mapped(at, target)
                    .ok_or_else(|| wrong(allowed))?;
                continue;
            }
            let index = |k: usize| {
                let found = whole(row[k]).and_then(|index| u64::try_from(index).ok());
                found.ok_or_else(|| wrong(ALLOWED))
            };
            let confidence = row.get(2).map(|&sure| {
                let inside = (0.0..=1.0).contains(&sure).then_some(sure as f32);
                inside.ok_or_else(|| wrong(ALLOWED))
            });
            let (pair, confidence) = ([index(0)?, index(1)?], confidence.transpose()?);
            found.push(Row {
                at,
                pair,
                confidence,
            });
        }
        Ok(found)
    }

    fn push(&mut self, row: Row) {
        self.rows.push(row);
        self.count += 1;
    }

    /// Adds the next point of many key frames, if both of its vertices are known.
    fn push_tracked(&mut self, at: usize, vertices: [Option<u64>; 2]) {
        self.count += 1;
        if let [Some(source), Some(target)] = vertices {
            self.rows.push(Row {
                at,
                pair: [source, target],
                confidence: None,
            });
        }
    }

    /// Adds the next line of a map; none if it is negative and not -1.
    fn push_mapped(&mut self, at: usize, target: i64) -> Option<()> {
        let source = self.count as u64;
        self.count += 1;
        if target != -1 {
            let pair = [source, u64::try_from(target).ok()?];
            self.rows.push(Row {
                at,
                pair,
                confidence: None,
            });
        }
        Some(())
    }

    /// The pairs, vertices counted from 0, if all of them exist.
    fn resolve(self, path: &Path, shapes: [&Shape; 2]) -> Result<Correspondences, ShapeError> {
        let counts = shapes.map(|shape| shape.file_count() as u64);
        if self.is_map && self.count as u64 != counts[0] {
            let (count, needed, name) = (self.count, counts[0], shapes[0].path.display());
            let problem = format!(
                "a map of {count} vertices: must have one target for each of the {needed} vertices of {name}; or give \
                 pairs in two columns"
            );
            return Err(ShapeError::malformed(path, problem));
        }
        if self.rows.is_empty() {
            return Err(ShapeError::NoCorrespondences {
                path: path.to_owned(),
            });
        }
        let (first, notes) = self.first_vertex(path, counts, shapes);
        let mut found = Correspondences {
            notes,
            ..Correspondences::default()
        };
        let said = self.rows.iter().any(|row| row.confidence.is_some());
        let mut lost = 0;
        for row in &self.rows {
            // The source's vertices of a map are counted here.
            let firsts = [if self.is_map { 0 } else { first }, first];
            let mut pair = [0; 2];
            for (k, shape) in shapes.into_iter().enumerate() {
                let index = row.pair[k]
                    .checked_sub(firsts[k])
                    .filter(|&index| index < counts[k]);
                pair[k] = index.ok_or_else(|| {
                    let (given, count, name) = (row.pair[k], counts[k], shape.path.display());
                    let last = (count + first).saturating_sub(1);
                    let problem =
                        format!("vertex {given} of {name} does not exist (it has {count}: {first} to {last})");
                    self.wrong(path, row.at, &problem)
                })? as u32;
            }
            let [from, to] = [0, 1].map(|k| shapes[k].vertex_of_number(pair[k]));
            let (Some(from), Some(to)) = (from, to) else {
                lost += 1;
                continue;
            };
            found.pairs.push([from, to]);
            if said {
                found.confidence.push(row.confidence.unwrap_or(1.0));
            }
        }
        let (name, all) = (path.display(), self.rows.len());
        if lost == all {
            let problem = format!("all {all} pairs name points that were left out of their clouds");
            return Err(ShapeError::malformed(path, problem));
        }
        if lost > 0 {
            let note = format!(
                "{name}: {lost} of {all} pairs name points that were left out: passed over"
            );
            found.notes.push(note);
        }
        Ok(found)
    }

    /// What the first vertex counts as, 0 or 1, and what was decided about it.
    fn first_vertex(
        &self,
        path: &Path,
        counts: [u64; 2],
        shapes: [&Shape; 2],
    ) -> (u64, Vec<String>) {
        let name = path.display();
        let has = |is: fn(u64, u64) -> bool| {
            let from = usize::from(self.is_map);
            self.rows
                .iter()
                .any(|row| (from..2).any(|k| is(row.pair[k], counts[k])))
        };
        let (has_zero, has_last) = (
            has(|index, _| index == 0),
            has(|index, count| index == count),
        );
        let mut notes = Vec::new();
        let lost = self.count - self.rows.len();
        let what = if self.is_map { "vertices" } else { "points" };
        if lost > 0 {
            notes.push(format!(
                "{name}: {lost} of {} {what} have no partner (-1)",
                self.count
            ));
        }
        if let Some(first) = self.declared {
            return (first, notes);
        }
        if has_last && !has_zero {
            notes.push(format!(
                "{name}: no vertex is 0 and one is the number of vertices: taken as counted from 1"
            ));
            return (1, notes);
        }
        let pairs = || self.rows.iter().map(|row| row.pair).collect::<Vec<_>>();
        if !self.is_map && !has_zero && counting::is_from_one(&pairs(), shapes) {
            notes.push(format!(
                "{name}: no vertex is 0, and near vertices stay near if they count from 1: taken as counted from 1; if they \
                 count from 0, write \"# counted from 0\" into the file"
            ));
            return (1, notes);
        }
        if self.is_map && !has_zero {
            let cure = match self.is_array {
                true => "subtract 1",
                false => "write \"# counted from 1\" into the file",
            };
            notes.push(format!(
                "{name}: no vertex is 0, and none is the number of vertices: taken as counted from 0; if they count from \
                 1, {cure}"
            ));
        }
        (0, notes)
    }

    fn wrong(&self, path: &Path, at: usize, problem: &str) -> ShapeError {
        match self.is_array {
            true => ShapeError::malformed(path, format!("row {at}: {problem}")),
            false => ShapeError::line(path, at, problem),
        }
    }
}

/// Two whole numbers, and perhaps a share of 1.
fn parse_pair(fields: &[&str]) -> Option<([u64; 2], Option<f32>)> {
    let [source, target, rest @ ..] = fields else {
        return None;
    };
    let confidence = match rest {
        [] => None,
        [given] => {
            let given: f32 = given.parse().ok()?;
            Some((0.0..=1.0).contains(&given).then_some(given)?)
        }
        _ => return None,
    };
    let index = |field: &str| u64::try_from(whole_number(field)?).ok();
    Some(([index(source)?, index(target)?], confidence))
}

/// A whole number, which programs also write as `12.0` or `1.2e+01`.
fn whole_number(field: &str) -> Option<i64> {
    let exact = field.parse().ok();
    exact.or_else(|| {
        let number: f64 = field.parse().ok()?;
        // Beyond 2^53 numbers are not exact, and no shape has so many vertices.
        (number.fract() == 0.0 && number.abs() < 9e15).then_some(number as i64)
    })
}

/// A field without quotes around it.
fn unquoted(field: &str) -> &str {
    field.trim_matches(['"', '\'']).trim()
}

/// Whether fields are the names of columns; one may have none.
fn are_names(fields: &[&str]) -> bool {
    let names: Vec<&str> = fields.iter().map(|field| unquoted(field)).collect();
    let is_name = |name: &&str| name.is_empty() || name.starts_with(char::is_alphabetic);
    names.iter().all(is_name) && names.iter().any(|name| !name.is_empty())
}

#[cfg(test)]
mod tests;
