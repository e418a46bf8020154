//! Which reader a file is for.

use std::path::Path;

use super::error::ShapeError;
use super::shape::Shape;
use super::{obj, ply};

/// Reads a mesh or a point cloud; the extension says which format it is in, in either case.
///
/// PLY and OBJ, polygons triangulated as fans, vertices in the order of the file. A sequence of
/// frames (`.anime`) is read by [`Sequence::read`](super::Sequence::read).
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
    let extension = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    match extension.as_str() {
        "ply" => ply::read(path),
        "obj" => obj::read(path),
        "anime" => Err(ShapeError::NotOneShape {
            path: path.to_owned(),
        }),
        _ => Err(ShapeError::UnknownFormat {
            path: path.to_owned(),
            extension,
        }),
    }
}

impl Shape {
    /// Reads a mesh or a point cloud, PLY or OBJ by the ending of its name.
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
        let text = message(Path::new("shape.stl"));
        assert!(
            text.contains("shape.stl") && text.contains(".ply, .obj"),
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
