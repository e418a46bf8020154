//! What all targets share: a file with the fuzzer's bytes, and what must hold of a shape that was read.

use std::path::{Path, PathBuf};

use isomorph::Shape;

/// A folder of this process in memory, made once.
fn place() -> &'static Path {
    static PLACE: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    PLACE.get_or_init(|| {
        let memory = Path::new("/dev/shm");
        let base = if memory.is_dir() {
            memory.to_path_buf()
        } else {
            std::env::temp_dir()
        };
        let place = base.join(format!("isomorph-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&place).expect("a folder");
        place
    })
}

/// Writes bytes into a file of this name; its path.
pub fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let path = place().join(name);
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).expect("a folder");
    }
    std::fs::write(&path, bytes).expect("written");
    path
}

/// Reads the bytes as a shape of this ending: it is sound and no larger than its file allows, or there is one line
/// of error that names the file.
pub fn shape(ending: &str, bytes: &[u8]) {
    let name = format!("shape.{ending}");
    let path = written(&name, bytes);
    match Shape::read(&path) {
        Err(error) => one_line(&error.to_string(), &name),
        Ok(shape) => {
            let mesh = &shape.mesh;
            let count = mesh.vertices.len();
            // Numbers of an archive are compressed: a thousand times at most.
            let most = if ending == "npz" {
                1100 * bytes.len()
            } else {
                bytes.len()
            };
            assert!(
                count <= most && mesh.triangles.len() <= most,
                "larger than its file"
            );
            assert!(mesh.vertices.iter().flatten().all(|x| x.is_finite()));
            let corners = mesh.triangles.iter().flatten();
            assert!(corners.copied().all(|at| (at as usize) < count));
            assert!(
                mesh.normals
                    .as_ref()
                    .is_none_or(|normals| normals.len() == count)
            );
        }
    }
}

/// An error is one line that names its file.
pub fn one_line(text: &str, name: &str) {
    assert!(text.contains(name), "{text:?} does not name {name}");
    assert!(!text.contains('\n'), "{text:?} has two lines");
}
