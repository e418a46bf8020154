//! A mesh or a point cloud as its file gives it, and what its readers share.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::{FEWEST_POINTS, ShapeError};
use crate::geometry::linear::{is_finite, times};
use crate::geometry::similarity::Similarity;
use crate::geometry::{Extent, Mesh, cloud_area};

/// A mesh or a point cloud as its file gives it: in the user's coordinates and vertex order.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Where it was read from; it opens every message about the shape.
    pub path: PathBuf,
    /// Positions in float64, so that georeferenced coordinates survive until normalised; polygons as fans
    /// of triangles, none for a point cloud; the file's normals, if it gives one for each vertex.
    pub mesh: Mesh<f64>,
    /// What was decided about the contents of the file, one sentence each.
    pub notes: Vec<String>,
    /// Which vertices of the file these are, where some were left out.
    pub(crate) kept: Option<Kept>,
}

/// Which vertices of a file a shape has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Kept {
    /// The number in the file of each vertex of the shape, ascending.
    numbers: Vec<u32>,
    /// How many the file has.
    of: usize,
}

impl Kept {
    /// The number in the file of a shape's vertex.
    pub(crate) fn number_of(kept: Option<&Self>, vertex: u32) -> u32 {
        kept.map_or(vertex, |kept| kept.numbers[vertex as usize])
    }

    /// What there is one of for each vertex of the file, for those of the shape.
    pub(super) fn select<T: Copy>(&self, of_file: &[T]) -> Vec<T> {
        let kept = self.numbers.iter();
        kept.map(|number| of_file[*number as usize]).collect()
    }
}

impl Shape {
    /// A point cloud that is in no file.
    pub fn cloud(vertices: Vec<[f64; 3]>) -> Self {
        Self::of(Mesh::new(vertices, Vec::new()))
    }

    /// A mesh, or a point cloud, that is in no file.
    pub fn of(mesh: Mesh<f64>) -> Self {
        Self {
            path: PathBuf::from("shape"),
            mesh,
            notes: Vec::new(),
            kept: None,
        }
    }

    /// A mesh, or a point cloud, of the file at `path`.
    pub(crate) fn at(path: &Path, mesh: Mesh<f64>) -> Self {
        Self {
            path: path.to_owned(),
            ..Self::of(mesh)
        }
    }

    /// Whether the shape has faces; without any it is a point cloud.
    pub fn is_mesh(&self) -> bool {
        !self.mesh.triangles.is_empty()
    }

    /// How many vertices the file has; some may be left out of the shape.
    pub(crate) fn file_count(&self) -> usize {
        let kept = self.kept.as_ref();
        kept.map_or(self.mesh.vertices.len(), |kept| kept.of)
    }

    /// The number in the file of one of the shape's vertices.
    pub(crate) fn number_in_file(&self, vertex: u32) -> u32 {
        Kept::number_of(self.kept.as_ref(), vertex)
    }

    /// The shape's vertex that has this number in the file, unless it was left out.
    pub(crate) fn vertex_of_number(&self, number: u32) -> Option<u32> {
        let Some(kept) = &self.kept else {
            return ((number as usize) < self.mesh.vertices.len()).then_some(number);
        };
        kept.numbers.binary_search(&number).ok().map(|at| at as u32)
    }

    /// A cloud without the points that are not to be kept; vertices keep their numbers in the file.
    ///
    /// # Panics
    /// If the shape is a mesh, or there is not one answer for each point.
    pub(crate) fn keeping(mut self, keep: &[bool]) -> Self {
        assert!(!self.is_mesh(), "triangles name vertices");
        assert_eq!(keep.len(), self.mesh.vertices.len(), "one for each point");
        if keep.iter().all(|keep| *keep) {
            return self;
        }
        let of = self.file_count();
        let stay = || {
            keep.iter()
                .enumerate()
                .filter(|(_, keep)| **keep)
                .map(|(k, _)| k)
        };
        let numbers = stay().map(|k| self.number_in_file(k as u32)).collect();
        self.kept = Some(Kept { numbers, of });
        self.mesh.vertices = stay().map(|k| self.mesh.vertices[k]).collect();
        let normals = self.mesh.normals.as_ref();
        self.mesh.normals = normals.map(|normals| stay().map(|k| normals[k]).collect());
        self
    }

    /// The same shape elsewhere, turned and sized; vertices keep their numbers.
    pub(crate) fn laid_by(&self, way: &Similarity) -> Self {
        let mut shape = self.clone();
        if *way == Similarity::IDENTITY {
            return shape;
        }
        for vertex in &mut shape.mesh.vertices {
            *vertex = way.apply(*vertex);
        }
        for normal in shape.mesh.normals.iter_mut().flatten() {
            let turned = times(&way.rotation, normal.map(f64::from));
            *normal = turned.map(|part| part as f32);
        }
        shape
    }

    /// Without points that have no place; a note says how many they were.
    fn with_places(self) -> Self {
        let keep: Vec<bool> = self.mesh.vertices.iter().map(is_finite).collect();
        let lost = keep.iter().filter(|keep| !**keep).count();
        if lost == 0 {
            return self;
        }
        let (name, count) = (self.path.display(), keep.len());
        let note =
            format!("{name}: {lost} of {count} points have no place (NaN or infinite): left out");
        let mut shape = self.keeping(&keep);
        shape.notes.push(note);
        shape
    }

    /// Surface area in the user's units squared: of the triangles of a mesh, or estimated from the
    /// density of a cloud ([`cloud_area`]).
    ///
    /// # Errors
    /// [`ShapeError::Area`] if it is zero or overflows.
    pub(crate) fn area(&self) -> Result<f64, ShapeError> {
        let area = if self.is_mesh() {
            self.mesh.area()
        } else {
            cloud_area(&self.mesh.vertices)
        };
        if area > 0.0 && area.is_finite() {
            Ok(area)
        } else {
            Err(ShapeError::Area {
                path: self.path.clone(),
                area,
            })
        }
    }

    /// What every shape must satisfy, whatever its format.
    ///
    /// Points of a cloud that have no place are left out.
    pub(super) fn checked(self) -> Result<Self, ShapeError> {
        let shape = if self.is_mesh() {
            self
        } else {
            self.with_places()
        };
        shape.made_sure()
    }

    fn made_sure(self) -> Result<Self, ShapeError> {
        let infinite = |vertex: &[f64; 3]| !is_finite(vertex);
        let vertices = &self.mesh.vertices;
        if let Some(vertex) = vertices.iter().position(infinite) {
            let value = vertices[vertex];
            return Err(ShapeError::NotFinite {
                path: self.path,
                vertex,
                value,
            });
        }
        if !self.is_mesh() && vertices.len() < FEWEST_POINTS {
            let found = vertices.len();
            return Err(ShapeError::TooFewPoints {
                path: self.path,
                found,
            });
        }
        if vertices.iter().all(|vertex| vertex == &vertices[0]) {
            let (vertices, place) = (vertices.len(), vertices[0]);
            return Err(ShapeError::OnePlace {
                path: self.path,
                vertices,
                place,
            });
        }
        if self.is_mesh() {
            self.area()?;
        } else if on_one_line(vertices) {
            let vertices = vertices.len();
            return Err(ShapeError::OneLine {
                path: self.path,
                vertices,
            });
        }
        Ok(self.with_note_on_precision())
    }

    /// Says where 32-bit coordinates are too coarse for the shape, such as those of a map.
    fn with_note_on_precision(mut self) -> Self {
        let numbers = || self.mesh.vertices.iter().flatten().copied();
        if !are_rounded_to_32_bits(numbers()) {
            return self;
        }
        let largest = numbers().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        // Between two numbers of 32 bits that are as large.
        let step = largest * f64::from(f32::EPSILON);
        let share = step / Extent::of(self.mesh.vertices.iter().copied()).diagonal();
        if share > COARSE {
            let (path, percent) = (self.path.display(), 100.0 * share);
            self.notes.push(format!(
                "{path}: coordinates near {largest:.0} in 32 bits are {step:.3} apart, {percent:.2} % of the shape's \
                 size, so finer detail is lost; export them relative to a place near the shape, or in 64 bits"
            ));
        }
        self
    }
}

/// The step between coordinates, relative to the shape's size, from which on it is noticed.
const COARSE: f64 = 1e-4;

/// Whether numbers were rounded to 32 bits: all are numbers of 32 bits, and a tenth has the last of these bits.
/// Whole numbers, and those of a few decimals, have it not.
fn are_rounded_to_32_bits(numbers: impl Iterator<Item = f64>) -> bool {
    let (mut all, mut last) = (0_usize, 0_usize);
    for x in numbers {
        let narrow = x as f32;
        if f64::from(narrow) != x {
            return false;
        }
        all += 1;
        last += (narrow.to_bits() & 1) as usize;
    }
    10 * last > all
}

/// Whether points are all on one line, but for rounding.
fn on_one_line(points: &[[f64; 3]]) -> bool {
    let from = |point: &[f64; 3]| DVec3::from_array(*point) - DVec3::from_array(points[0]);
    let all = points.iter().map(from);
    let longest = all.clone().max_by(|a, b| a.length().total_cmp(&b.length()));
    let longest = longest.unwrap_or_default();
    let along = longest.normalize_or_zero();
    all.map(|v| v.reject_from_normalized(along).length())
        .all(|off| off <= 1e-7 * longest.length())
}

/// The length of the file, or why it cannot be read; an empty one is refused here.
pub(super) fn file_length(path: &Path) -> Result<u64, ShapeError> {
    let unreadable = |reason| ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(unreadable(std::io::ErrorKind::IsADirectory.into()));
    }
    match metadata.len() {
        0 => Err(ShapeError::Empty {
            path: path.to_owned(),
        }),
        length => Ok(length),
    }
}

/// The whole of a file; an empty one is refused.
pub(crate) fn file_bytes(path: &Path) -> Result<Vec<u8>, ShapeError> {
    file_length(path)?;
    std::fs::read(path).map_err(|reason| ShapeError::Unreadable {
        path: path.to_owned(),
        reason,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_that_say_nothing_are_refused() {
        let cloud = |vertices: Vec<[f64; 3]>| {
            let path = PathBuf::from("cloud.ply");
            let mesh = Mesh::new(vertices, Vec::new());
            let shape = Shape {
                path,
                ..Shape::of(mesh)
            };
            shape.checked().expect_err("refused").to_string()
        };
        assert!(cloud(vec![[1.0; 3]; 12]).contains("12 points, at least 64 needed"));
        assert!(cloud(vec![[1.0; 3]; 100]).contains("all 100 vertices are at"));
        assert!(cloud(vec![[f64::NAN; 3]; 100]).contains("0 points, at least 64 needed"));
    }

    #[test]
    fn points_on_a_line_are_refused_and_those_beside_it_are_not() {
        let cloud = |off: f64| {
            let place = |k: i32| {
                [
                    1e6 + f64::from(k),
                    3.0 - 2.0 * f64::from(k),
                    off * f64::from(k % 3),
                ]
            };
            let mesh = Mesh::new((0..100).map(place).collect(), Vec::new());
            Shape::of(mesh).checked()
        };
        let text = cloud(0.0).expect_err("a line").to_string();
        assert!(text.contains("all 100 points lie on one line"), "{text}");
        cloud(0.01).expect("a strip");
    }

    #[test]
    fn coordinates_that_32_bits_are_too_coarse_for_are_noticed() {
        // A ring of radius 1 at a place of a map, as 32 bits and as 64.
        let ring = |east: f64, narrow: bool| {
            let place = |k: u32| {
                let angle = f64::from(k) / 10.0;
                let point = [east + angle.cos(), angle.sin(), angle.cos() * angle.sin()];
                point.map(|x| if narrow { f64::from(x as f32) } else { x })
            };
            let mesh = Mesh::new((0..64).map(place).collect(), Vec::new());
            Shape::of(mesh).checked().expect("a shape").notes
        };
        let notes = ring(500_000.0, true);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(
            notes[0].contains("coordinates near 500001 in 32 bits"),
            "{notes:?}"
        );
        for (east, narrow) in [(500_000.0, false), (100.0, true)] {
            assert_eq!(ring(east, narrow), Vec::<String>::new(), "{east}, {narrow}");
        }
    }

    #[test]
    fn a_mesh_without_area_is_refused() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let path = PathBuf::from("line.obj");
        let mesh = Mesh::new(vertices, vec![[0, 1, 2]]);
        let shape = Shape {
            path,
            ..Shape::of(mesh)
        };
        let text = shape.checked().expect_err("refused").to_string();
        assert!(text.starts_with("line.obj: surface area 0"), "{text}");
    }

    #[test]
    fn points_without_a_place_are_left_out_and_the_others_keep_their_numbers() {
        let place = |k: i32| [f64::from(k), f64::from(k * k % 7), 0.0];
        let mut vertices: Vec<[f64; 3]> = (0..100).map(place).collect();
        vertices[7][2] = f64::NAN;
        vertices[20][0] = f64::INFINITY;
        let normals = (0..100).map(|k| [k as f32, 0.0, 0.0]).collect();
        let mesh = Mesh {
            vertices,
            triangles: Vec::new(),
            normals: Some(normals),
        };
        let shape = Shape::at(Path::new("cloud.ply"), mesh)
            .checked()
            .expect("a cloud");
        let note = "cloud.ply: 2 of 100 points have no place (NaN or infinite): left out";
        assert_eq!(shape.notes, [note]);
        assert_eq!((shape.mesh.vertices.len(), shape.file_count()), (98, 100));
        assert_eq!((shape.number_in_file(7), shape.number_in_file(97)), (8, 99));
        assert_eq!(shape.vertex_of_number(7), None);
        assert_eq!(shape.vertex_of_number(99), Some(97));
        assert_eq!(shape.vertex_of_number(100), None);
        assert_eq!(
            shape.mesh.normals.as_ref().expect("normals")[7],
            [8.0, 0.0, 0.0]
        );
        // Left out twice: numbers are still those of the file.
        let every: Vec<bool> = (0..98).map(|k| k % 2 == 1).collect();
        let half = shape.keeping(&every);
        assert_eq!((half.number_in_file(3), half.file_count()), (8, 100));
    }
}
