//! Which reader a file is for.

use std::path::Path;

use super::error::ShapeError;
use super::shape::Shape;
use super::{cloud, gltf, npy, obj, off, ply, stl};

/// What a file of a shape may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Stanford PLY.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// STL, binary or ascii.
    Stl,
    /// Geomview OFF.
    Off,
    /// glTF 2.0, in one file or with others beside it.
    Gltf,
    /// Arrays of numpy.
    Npy,
    /// Points in text.
    Cloud,
}

/// The endings of file names, in lower case, and what they say.
const ENDINGS: [(&str, Format); 16] = [
    ("ply", Format::Ply),
    ("obj", Format::Obj),
    ("stl", Format::Stl),
    ("off", Format::Off),
    ("glb", Format::Gltf),
    ("gltf", Format::Gltf),
    ("npy", Format::Npy),
    ("npz", Format::Npy),
    ("xyz", Format::Cloud),
    ("xyzn", Format::Cloud),
    ("xyzrgb", Format::Cloud),
    ("pts", Format::Cloud),
    ("asc", Format::Cloud),
    ("txt", Format::Cloud),
    ("csv", Format::Cloud),
    ("tsv", Format::Cloud),
];

impl Format {
    /// The format that the ending of a file's name says, in either case.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        let known = ENDINGS
            .iter()
            .find(|(known, _)| ending.eq_ignore_ascii_case(known));
        known.map(|(_, format)| *format)
    }
}

/// All endings that can be read, as messages list them: `.ply, .obj, ...`.
pub(super) fn allowed_endings() -> String {
    let dotted: Vec<String> = ENDINGS
        .iter()
        .map(|(ending, _)| format!(".{ending}"))
        .collect();
    dotted.join(", ")
}

/// Reads a mesh or a point cloud; the extension says which format it is in, in either case.
///
/// Polygons are triangulated as fans. Vertices come in the order of the file; those of STL and glTF, which state a
/// vertex many times, in the order of their first use. A sequence of frames (`.anime`) is read by
/// [`Sequence::read`](super::Sequence::read).
///
/// # Errors
/// One line that names the file, the place in it, what was found there and what is allowed: a file
/// that is missing, empty, truncated or not of its format, coordinates that are not finite, faces
/// that refer to vertices that do not exist, a cloud of fewer than [`FEWEST_POINTS`](super::FEWEST_POINTS) points,
/// vertices all in one place, no area.
pub(crate) fn read(path: &Path) -> Result<Shape, ShapeError> {
    read_any(path)?.checked()
}

/// Reads points of any kind and number, whether or not they could be a shape: to be moved by a motion.
///
/// # Errors
/// Those of [`read`] that are about the file.
pub(crate) fn read_any(path: &Path) -> Result<Shape, ShapeError> {
    match Format::of(path) {
        Some(Format::Ply) => ply::read(path),
        Some(Format::Obj) => obj::read(path),
        Some(Format::Stl) => stl::read(path),
        Some(Format::Off) => off::read(path),
        Some(Format::Gltf) => gltf::read(path),
        Some(Format::Npy) => npy::read(path),
        Some(Format::Cloud) => cloud::read(path),
        None => Err(unknown(path)),
    }
}

/// Why a file of another ending is refused.
fn unknown(path: &Path) -> ShapeError {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let extension = extension.to_ascii_lowercase();
    let path = path.to_owned();
    match extension.as_str() {
        "anime" => ShapeError::NotOneShape { path },
        _ => ShapeError::UnknownFormat {
            path,
            extension,
            allowed: allowed_endings(),
        },
    }
}

impl Shape {
    /// Reads a mesh or a point cloud: PLY, OBJ, STL, OFF, glTF, arrays of numpy or points in text, by the ending of its
    /// name. The chapter [shapes](crate::guide::shapes) has what is read of each.
    ///
    /// # Errors
    /// One line that names the file, the place in it, what was found there and what is allowed.
    ///
    /// # Examples
    /// ```no_run
    /// let fox = isomorph::Shape::read("data/fox/source.ply")?;
    /// println!("{} vertices", fox.mesh.vertices.len());
    /// # Ok::<(), isomorph::Error>(())
    /// ```
    pub fn read(path: impl AsRef<Path>) -> crate::Result<Self> {
        Ok(read(path.as_ref())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        read(path).expect_err("refused").to_string()
    }

    #[test]
    fn the_extension_decides_and_an_unknown_one_lists_what_is_allowed() {
        let text = message(Path::new("shape.step"));
        assert!(
            text.contains("shape.step") && text.contains(".ply, .obj"),
            "{text}"
        );
        assert!(message(Path::new("walk.ANIME")).contains("sequence"));
        assert!(message(Path::new("no/such.PLY")).starts_with("no/such.PLY: cannot be read"));
    }

    #[test]
    fn a_folder_and_an_empty_file_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("shape.obj");
        std::fs::write(&path, b"").expect("written");
        assert!(message(&path).ends_with("shape.obj: the file is empty"));
        std::fs::create_dir(folder.path().join("folder.ply")).expect("created");
        assert!(message(&folder.path().join("folder.ply")).contains("cannot be read"));
    }
}
