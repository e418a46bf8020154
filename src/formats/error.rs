//! What can be wrong with a shape: one line each, *where: what is wrong (found, allowed); what to
//! do*.

use std::io;
use std::path::PathBuf;

/// The least number of points that a cloud, or a sample of a mesh, may have: fewer say too little
/// about a surface, and leave nothing to estimate normals and areas from.
pub(crate) const FEWEST_POINTS: usize = 64;

/// Why shapes could not be read or made into a pair. Vertices, faces and frames count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// The file system refused.
    #[error("{}: cannot be read: {reason}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the file system said.
        reason: io::Error,
    },
    /// Nothing is in the file.
    #[error("{}: the file is empty", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The extension is none that can be read.
    #[error("{}: unknown kind of shape (extension {extension:?}; allowed: {allowed})", .path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Its extension, in lower case.
        extension: String,
        /// The extensions that are allowed.
        allowed: String,
    },
    /// A sequence was given where one shape is expected.
    #[error("{}: is a sequence of frames, not one shape; save one frame as .ply or .obj", .path.display())]
    NotOneShape {
        /// The file.
        path: PathBuf,
    },
    /// The contents are not what the format demands, at a place that the problem names.
    #[error("{}: {problem}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Place and problem.
        problem: String,
    },
    /// A line of a text file is not what the format demands.
    #[error("{}:{line}: {problem}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1 as editors do.
        line: usize,
        /// What was found and what is allowed.
        problem: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("{}: vertex {vertex} is at {value:?}: coordinates must be finite numbers", .path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The vertex.
        vertex: usize,
        /// Its coordinates.
        value: [f64; 3],
    },
    /// A face refers to a vertex that does not exist.
    #[error("{}: face {face} refers to vertex {index} (the file has {vertices} vertices{base})", .path.display())]
    IndexOutOfRange {
        /// The file.
        path: PathBuf,
        /// The face.
        face: usize,
        /// The index as the file gives it.
        index: i64,
        /// How many vertices the file has.
        vertices: usize,
        /// How the format counts, where it is not from 0.
        base: &'static str,
    },
    /// A cloud, or a sample, too small to stand for a surface.
    #[error("{}: {found} points, at least {} needed", .path.display(), FEWEST_POINTS)]
    TooFewPoints {
        /// The file.
        path: PathBuf,
        /// How many points it has.
        found: usize,
    },
    /// Every vertex has the same position.
    #[error("{}: all {vertices} vertices are at {place:?}: a shape needs an extent", .path.display())]
    OnePlace {
        /// The file.
        path: PathBuf,
        /// How many vertices it has.
        vertices: usize,
        /// Where they are.
        place: [f64; 3],
    },
    /// Points on a line.
    #[error(
        "{}: all {vertices} points lie on one line: no surface passes through them; check which columns were exported",
        .path.display()
    )]
    OneLine {
        /// The file.
        path: PathBuf,
        /// How many points it has.
        vertices: usize,
    },
    /// There is no surface to speak of, or one too large for float64.
    #[error(
        "{}: surface area {area}: must be positive and finite; check the faces, and whether coordinates are sensible",
        .path.display()
    )]
    Area {
        /// The file.
        path: PathBuf,
        /// Its area.
        area: f64,
    },
    /// A frame was asked for that the sequence does not have.
    #[error("{}: frame {frame} (the sequence has frames 0 to {last})", .path.display())]
    Frame {
        /// The file.
        path: PathBuf,
        /// The frame asked for.
        frame: usize,
        /// The last frame.
        last: usize,
    },
    /// `same-vertices` was asked of shapes that do not share a vertex order.
    #[error(
        "correspondences = \"same-vertices\": {} has {source_vertices} vertices, {} has \
         {target_vertices}: the counts must be equal; give pairs in a file instead",
        .source_path.display(), .target_path.display()
    )]
    VertexCounts {
        /// The source's file.
        source_path: PathBuf,
        /// Its number of vertices.
        source_vertices: usize,
        /// The target's file.
        target_path: PathBuf,
        /// Its number of vertices.
        target_vertices: usize,
    },
    /// The pairs mirror the shape.
    #[error(
        "the pairs mirror {} into {}: no continuous motion does that; mirror one of the files (the sign of one axis), \
         correct the pairs, or set data.mirrored = true", .source_path.display(), .target_path.display()
    )]
    Mirrored {
        /// The source's file.
        source_path: PathBuf,
        /// The target's file.
        target_path: PathBuf,
    },
    /// A file of correspondences holds none.
    #[error("{}: no correspondences, at least 1 needed; for none set correspondences = \"none\"", .path.display())]
    NoCorrespondences {
        /// The file.
        path: PathBuf,
    },
    /// An option of the data section that no shapes can satisfy.
    #[error("data.{option} = {found}: must be {allowed}")]
    Option {
        /// The key in the recipe.
        option: &'static str,
        /// Its value.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// Normals of the file were asked for, and it has none that serve.
    #[error("{}: {problem}; set data.normals to \"auto\" or \"estimate\"", .path.display())]
    Normals {
        /// The file.
        path: PathBuf,
        /// Why its normals do not serve.
        problem: String,
    },
}

impl ShapeError {
    /// A [`ShapeError::Malformed`] in the file at `path`.
    pub(crate) fn malformed(path: &std::path::Path, problem: impl Into<String>) -> Self {
        Self::Malformed {
            path: path.to_owned(),
            problem: problem.into(),
        }
    }

    /// A [`ShapeError::Line`] in the file at `path`, line counted from 1.
    pub(crate) fn line(path: &std::path::Path, line: usize, problem: impl Into<String>) -> Self {
        Self::Line {
            path: path.to_owned(),
            line,
            problem: problem.into(),
        }
    }
}
