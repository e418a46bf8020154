//! Points as text, one on each line: XYZ, CSV, PTS, ASC and the like.
//!
//! | columns | what they are |
//! |---|---|
//! | 3 | x y z |
//! | 4 | x y z and an intensity, which is passed over |
//! | 6 | x y z and a normal or a colour |
//! | 7 | x y z, an intensity, and a normal or a colour |
//! | 9, 10 | the same with both |
//!
//! Three columns are a normal if a number in them is negative, or they have length 1 on every line, and else a colour. A first line of names decides
//! instead, where it has x, y and z; then the columns may come in any order, with others among them. Numbers are
//! separated by semicolons, else by commas, else by spaces or tabs. Lines that begin with `#` or `//` are passed over.
//! A single whole number before the points is their count (PTS).

use std::path::Path;

use super::error::ShapeError;
use super::lines::{fields, lines, number, refuse_utf_16, shown};
use super::shape::{Shape, file_bytes};
use crate::geometry::Mesh;
use crate::geometry::linear::{length, unit};

/// How far the length of a normal may be from 1: files state them with as few as two digits.
const UNIT: f64 = 0.02;

/// The points of a file, with what else is known of each.
pub(super) struct Cloud {
    pub points: Vec<[f64; 3]>,
    pub normals: Option<Vec<[f32; 3]>>,
    /// Red, green, blue and opacity, 0 to 1.
    pub colours: Option<Vec<[f32; 4]>>,
    notes: Vec<String>,
}

/// Reads the geometry of a cloud.
pub(super) fn read(path: &Path) -> Result<Shape, ShapeError> {
    let cloud = Cloud::read(path)?;
    let mesh = Mesh {
        vertices: cloud.points,
        triangles: Vec::new(),
        normals: cloud.normals,
    };
    Ok(Shape {
        notes: cloud.notes,
        ..Shape::at(path, mesh)
    })
}

/// Where things stand in a line.
#[derive(Clone, Copy)]
struct Columns {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    colour: Option<[usize; 3]>,
}

impl Cloud {
    /// Reads a file.
    ///
    /// # Errors
    /// The file and the line: what is no number, another number of columns than before, or one without a meaning.
    pub(super) fn read(path: &Path) -> Result<Self, ShapeError> {
        let table = Table::read(path)?;
        let (columns, note) = table.columns(path)?;
        let of = |columns: [usize; 3]| table.rows().map(move |row| columns.map(|at| row[at]));
        let normals = columns.normal.map(|at| of(at).map(unit).collect());
        let colours = columns.colour.map(|at| {
            let most = of(at).flatten().fold(0.0, f64::max);
            let one = match most {
                0.0..=1.0 => 1.0,
                0.0..=255.0 => 255.0,
                _ => 65535.0,
            };
            let shown = |[r, g, b]: [f64; 3]| [r / one, g / one, b / one, 1.0];
            of(at)
                .map(|colour| shown(colour).map(|part| part as f32))
                .collect()
        });
        Ok(Self {
            points: of(columns.position).collect(),
            normals,
            colours,
            notes: note.into_iter().collect(),
        })
    }
}

/// The numbers of a file.
struct Table {
    /// The names of the columns, in lower case, where the file gives them.
    names: Option<Vec<String>>,
    width: usize,
    values: Vec<f64>,
    /// The line of the first point.
    first: usize,
}

impl Table {
    fn read(path: &Path) -> Result<Self, ShapeError> {
        let bytes = file_bytes(path)?;
        refuse_utf_16(path, &bytes)?;
        let (mut names, mut count) = (None, None);
        let (mut width, mut values, mut first) = (0, Vec::new(), 0);
        for (at, line) in lines(&bytes) {
            let is_comment = line.starts_with('#') || line.starts_with("//");
            let content = line.trim_start_matches(['#', '/']).trim();
            // A separator after the last number is no field.
            let words: Vec<&str> =
                fields(content.strip_suffix([';', ',']).unwrap_or(content)).collect();
            if width == 0 && names.is_none() && is_header(&words, is_comment) {
                names = Some(words.iter().map(|word| name(word)).collect());
                continue;
            }
            if is_comment {
                continue;
            }
            if let (0, None, [word]) = (width, count, &words[..])
                && let Ok(found) = word.parse::<usize>()
            {
                count = Some((at, found));
                continue;
            }
            if width == 0 {
                (width, first) = (words.len(), at);
            }
            if words.len() != width {
                let found = words.len();
                let problem = format!(
                    "{:?}: {found} columns, {width} in the lines before",
                    shown(&line)
                );
                return Err(ShapeError::line(path, at, problem));
            }
            for word in words {
                values.push(number(path, at, word)?);
            }
        }
        if width == 0 {
            return Err(ShapeError::malformed(path, "no points (lines \"x y z\")"));
        }
        let found = values.len() / width;
        match count {
            Some((at, said)) if said != found => {
                let problem = format!(
                    "{said} points are announced, but {found} follow: truncated or malformed"
                );
                Err(ShapeError::line(path, at, problem))
            }
            _ => Ok(Self {
                names,
                width,
                values,
                first,
            }),
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.width)
    }

    /// What the columns mean, and a sentence where that was guessed.
    fn columns(&self, path: &Path) -> Result<(Columns, Option<String>), ShapeError> {
        if let Some(named) = self.names.as_ref().and_then(|names| self.named(names)) {
            return Ok((named, None));
        }
        let mut columns = Columns {
            position: [0, 1, 2],
            normal: None,
            colour: None,
        };
        let triples: &[usize] = match self.width {
            3 | 4 => &[],
            6 => &[3],
            7 => &[4],
            9 => &[3, 6],
            10 => &[4, 7],
            width => {
                let problem = format!(
                    "{width} columns: must be 3 (x y z), 6, 7, 9 or 10; or name them in a first line, such as x,y,z"
                );
                return Err(ShapeError::line(path, self.first, problem));
            }
        };
        for &start in triples {
            let at = [start, start + 1, start + 2];
            if columns.normal.is_none() && self.are_normals(at) {
                columns.normal = Some(at);
            } else if columns.colour.is_none() {
                columns.colour = Some(at);
            }
        }
        // Beside normals there is nothing to doubt.
        let doubtful = columns.colour.filter(|_| columns.normal.is_none());
        let note = doubtful.map(|[from, _, to]| {
            let (name, from, to) = (path.display(), from + 1, to + 1);
            format!(
                "{name}: columns {from} to {to} are never negative and not of length 1: taken for \
                 colours, not normals"
            )
        });
        Ok((columns, note))
    }

    /// Columns by their names; none where x, y and z are not among them.
    fn named(&self, names: &[String]) -> Option<Columns> {
        let find = |wanted: [&str; 3]| {
            let at = wanted.map(|wanted| names.iter().position(|name| name == wanted));
            let [Some(a), Some(b), Some(c)] = at else {
                return None;
            };
            (a.max(b).max(c) < self.width).then_some([a, b, c])
        };
        let any = |all: &[[&str; 3]]| all.iter().find_map(|wanted| find(*wanted));
        Some(Columns {
            position: find(["x", "y", "z"])?,
            normal: any(&[["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]]),
            colour: any(&[["r", "g", "b"], ["red", "green", "blue"]]),
        })
    }

    /// Whether three columns hold normals: one of the numbers is negative, which no colour is, or they have length 1,
    /// or 0 where there is none. MeshLab writes normals of any length.
    fn are_normals(&self, columns: [usize; 3]) -> bool {
        let all = || self.rows().map(move |row| columns.map(|at| row[at]));
        let is_unit = |found: f64| (found - 1.0).abs() < UNIT;
        let mut lengths = all().map(length).filter(|found| *found != 0.0).peekable();
        all().flatten().any(|number| number < 0.0)
            || lengths.peek().is_some() && lengths.all(is_unit)
    }
}

/// A name of a column without quotes, in lower case.
fn name(word: &str) -> String {
    word.trim_matches(['"', '\'']).trim().to_ascii_lowercase()
}

/// Whether words are names of columns; in a comment they are if x, y and z are among them.
fn is_header(words: &[&str], is_comment: bool) -> bool {
    let names: Vec<String> = words.iter().map(|word| name(word)).collect();
    let is_name =
        |name: &String| name.starts_with(char::is_alphabetic) && name.parse::<f64>().is_err();
    let has = |wanted: &str| names.iter().any(|name| name == wanted);
    match is_comment {
        true => ["x", "y", "z"].into_iter().all(has),
        false => names.len() > 1 && names.iter().all(|name| name.is_empty() || is_name(name)),
    }
}

#[cfg(test)]
pub(crate) mod tests;
