//! Pairs of corresponding vertices picked by hand, on a page in the browser.
//!
//! | file | what it does |
//! |---|---|
//! | `mod.rs` | [`Picker`], two shapes and the file that their pairs go to |
//! | `server.rs` | [`Served`], the page at an address of this machine alone |
//! | `http.rs` | one request read strictly, one answer written |
//!
//! The page itself is in `viewer/`. It sends the text of the whole pairs file. The text is read as `data.correspondences`
//! reads it, and only then written, whole or not at all.

mod http;
mod server;

use std::path::{Path, PathBuf};

use crate::atomic::{check_writable, write_atomically};
use crate::error::{Error, Result};
use crate::formats::{Kept, Shape};
use crate::shape::Correspondences;
use crate::viewer::PickPage;

pub use server::Served;

/// The most bytes of positions and triangles that a page holds. As text they take a third more, and browsers end
/// strings at half a gigabyte.
const MOST_BYTES: usize = 256 << 20;

/// Two shapes whose pairs are picked, and the file that the pairs go to.
#[derive(Debug)]
pub struct Picker {
    /// As the page shows them: their vertices are all that there are.
    shapes: [Shape; 2],
    /// Which vertices of their files these are.
    kept: [Option<Kept>; 2],
    output: PathBuf,
    given: Option<String>,
}

impl Picker {
    /// Reads both shapes, and the pairs to begin with if there are any. `output` is the file that pairs go to.
    ///
    /// # Errors
    /// A file that cannot be read; pairs of vertices that do not exist; a folder in which `output` cannot be
    /// written; shapes too large for a page.
    pub fn open(source: &Path, target: &Path, given: Option<&Path>, output: &Path) -> Result<Self> {
        let mut shapes = [Shape::read(source)?, Shape::read(target)?];
        let given = match given {
            Some(path) => {
                let known = Correspondences::read(path, &shapes[0], &shapes[1])?;
                let text = String::from_utf8_lossy(&std::fs::read(path)?).into_owned();
                // As it is, with its names, unless the page would read other pairs from it: arrays, maps, vertices
                // counted from 1.
                Some(match is_read_alike(&text, &known) {
                    true => text,
                    false => known.text(),
                })
            }
            None => None,
        };
        let bytes = |shape: &Shape| 6 * shape.mesh.vertices.len() + 12 * shape.mesh.triangles.len();
        let bytes: usize = shapes.iter().map(bytes).sum();
        if bytes > MOST_BYTES {
            return Err(Error::usage(format!(
                "{} and {}: {} MiB of vertices and triangles, at most {} fit on a page; find pairs with `isomorph \
                 match`, or pick them on smaller shapes",
                source.display(),
                target.display(),
                bytes >> 20,
                MOST_BYTES >> 20
            )));
        }
        check_writable(output)?;
        let kept = shapes.each_mut().map(|shape| shape.kept.take());
        Ok(Self {
            shapes,
            kept,
            output: output.to_owned(),
            given,
        })
    }

    /// Writes the page as a file. It works on any machine; pairs are saved as a download of the browser.
    ///
    /// # Errors
    /// What the file system says; the message names the file.
    pub fn write_page(&self, path: &Path) -> Result<()> {
        let html = self.html(self.given.clone(), false);
        write_atomically(path, |out| out.write_all(html.as_bytes()))?;
        Ok(())
    }

    /// Offers the page at an address of this machine, which no other machine reaches.
    ///
    /// # Errors
    /// What the system says, if it has no free port or no random numbers.
    pub fn serve(self) -> Result<Served> {
        Served::new(self)
    }

    /// The page with these pairs to begin with.
    fn html(&self, given: Option<String>, served: bool) -> String {
        let name = |path: &Path| {
            let name = path.file_name().unwrap_or(path.as_os_str());
            name.to_string_lossy().into_owned()
        };
        PickPage {
            names: [0, 1].map(|side| name(&self.shapes[side].path)),
            meshes: [0, 1].map(|side| &self.shapes[side].mesh),
            output: name(&self.output),
            given,
            served,
        }
        .html()
    }

    /// Writes the text of a pairs file, whole or not at all, if it is one; how many pairs it has.
    fn save(&self, text: &str) -> Result<usize> {
        let [source, target] = &self.shapes;
        let mut found = Correspondences::parse(text, &self.output, source, target)?;
        if self.kept == [None, None] {
            write_atomically(&self.output, |out| out.write_all(text.as_bytes()))?;
            return Ok(found.pairs.len());
        }
        for pair in &mut found.pairs {
            for (vertex, kept) in pair.iter_mut().zip(&self.kept) {
                *vertex = Kept::number_of(kept.as_ref(), *vertex);
            }
        }
        write_atomically(&self.output, |out| out.write_all(found.text().as_bytes()))?;
        Ok(found.pairs.len())
    }
}

/// Whether a text has these pairs as lines of numbers with commas between, counted from 0: what the page reads.
fn is_read_alike(text: &str, known: &Correspondences) -> bool {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    let filled = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let without_names = filled.skip_while(|line| line.starts_with(char::is_alphabetic));
    let pair = |line: &str| -> Option<[u32; 2]> {
        let mut fields = line.split(',').map(|field| field.trim().parse().ok());
        Some([fields.next()??, fields.next()??])
    };
    let found: Option<Vec<_>> = without_names.map(pair).collect();
    found.is_some_and(|found| found == known.pairs)
}

#[cfg(test)]
mod tests;
