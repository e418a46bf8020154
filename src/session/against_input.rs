//! The surfaces at the ends of a run held against the shapes that it was given: what contradicts them is said.
//!
//! All lengths are in normalised units. The limits are those that no run of the samples and of the evaluation
//! protocol comes near; a result beyond them is not what was asked for, whatever its cause.

use rayon::prelude::*;

use crate::event::Event;
use crate::geometry::density::usual_spacing;
use crate::geometry::linear::{difference, length};
use crate::geometry::{Mesh, NeighbourSearch, TriangleSearch};
use crate::shape::{Keyframe, LEAST_MISSING, key_name, share_beyond};
use crate::surface::frames::Frame;
use crate::surface::learned::Learned;

/// Places at which distances are taken.
const PLACES: usize = 4000;

/// The most that the input may be away from the surface, in the mean.
const REACHED: f64 = 0.01;

/// The most that the surface may be away from a closed mesh, in the mean.
const BEYOND_MESH: f64 = 0.01;

/// The same from the points of a cloud, whose holes are closed over; so many spacings are added.
const BEYOND_CLOUD: f64 = 0.03;
const SPACINGS: f64 = 1.0;

/// The most shapes that are all kept for this.
const MOST_SHAPES: usize = 32;

/// How much the volume of a closed mesh may change, as a share.
const VOLUME: f64 = 0.1;

/// How much its area may change, as a share.
const AREA: f64 = 0.15;

/// Holes through a surface that its closed mesh does not have: up to so many, fingers that touch may make.
const HOLES: i64 = 12;

/// Pieces with less than this share of the area may be tips that a cell cuts off.
const PIECE: f64 = 0.01;

/// A part of a closed mesh is thin, and lost, where it lies farther outside of the surface than so many of its edges, each
/// about as long as a cell of the grid: tips are cut short by less.
const LOST_BEYOND: f64 = 2.0;

/// The share of a closed mesh that is lost before it is said.
const LEAST_LOST: f64 = 5e-4;

/// A shape as it was given, for comparison with the surface at its time.
pub(super) struct End {
    name: String,
    time: f64,
    points: Vec<[f32; 3]>,
    mesh: Option<Mesh<f32>>,
    /// Whether each point lies at the border of what is known; empty where nothing is missing.
    border: Vec<bool>,
    /// How far the surface is from a sheet inside of it.
    inside: f64,
}

impl End {
    /// All shapes of a run; of very many the first and the last.
    pub(super) fn all(keys: &[Keyframe]) -> Vec<Self> {
        let count = keys.len();
        let end = |(k, key): (usize, &Keyframe)| Self {
            name: key_name(k, count),
            time: key.time,
            points: key.cloud.points.clone(),
            mesh: key.mesh.clone(),
            border: key.border.clone(),
            inside: key
                .sheet
                .as_ref()
                .map_or(0.0, |sheet| f64::from(sheet.thickness) / 2.0),
        };
        let is_kept =
            |(k, _): &(usize, &Keyframe)| count <= MOST_SHAPES || *k == 0 || *k + 1 == count;
        keys.iter().enumerate().filter(is_kept).map(end).collect()
    }

    /// What of this end's surface contradicts it; nothing if no surface is of its time.
    pub(super) fn contradicted(&self, frames: &[Frame]) -> Vec<Event> {
        let own = frames.iter().find(|frame| frame.time == self.time);
        let Some(frame) = own else {
            return Vec::new();
        };
        let said = self.findings(&frame.mesh);
        let doubtful = |(finding, cure): (String, &str)| Event::Doubtful {
            finding: format!("the surface at {} {finding}", frame.entry.time),
            cure: cure.to_owned(),
        };
        said.into_iter().map(doubtful).collect()
    }

    /// The share of a closed mesh that its surface lacks; none of other shapes, whose points may be noise.
    fn share_lost(&self, surface: &Mesh<f32>) -> Option<f64> {
        let search = self.mesh.as_ref().and(TriangleSearch::new(surface))?;
        let edges = some(&surface.triangles).map(|triangle| {
            let [a, b, _] = surface.corners(*triangle);
            length(difference(b, a))
        });
        let most = LOST_BEYOND * mean(edges);
        let is_lost = |x: &[f32; 3]| {
            let closest = search.closest(*x, 0);
            f64::from(closest.squared).sqrt() > most && !search.is_behind(&closest, *x)
        };
        let lost = self.points.par_iter().filter(|x| is_lost(x)).count();
        Some(lost as f64 / self.points.len() as f64)
    }

    fn findings(&self, surface: &Mesh<f32>) -> Vec<(String, &'static str)> {
        let name = &self.name[..];
        let Some(search) = TriangleSearch::new(surface) else {
            return vec![("is empty".to_owned(), LONGER)];
        };
        let mut found = Vec::new();
        let reached =
            mean(some(&self.points).map(|x| f64::from(search.closest(*x, 0).squared).sqrt()));
        if reached > REACHED + self.inside {
            found.push((
                format!("misses the {name} by {reached:.3} in the mean, of a size of about 1"),
                LONGER,
            ));
        }
        // Of a shape that is known in part, the surface must have more.
        let beyond = match self.border.is_empty() {
            true => self.beyond(surface),
            false => 0.0,
        };
        let most = if self.mesh.is_some() {
            BEYOND_MESH
        } else {
            BEYOND_CLOUD
        };
        if beyond > most {
            found.push((
                format!("has parts where the {name} has none: {beyond:.3} from it in the mean"),
                GHOSTS,
            ));
        }
        if let Some(mesh) = &self.mesh {
            compare_closed(name, mesh, surface, &mut found);
        }
        found
    }

    /// What is said of the other end, if a share of it arrives where this shape is not known.
    pub(super) fn unsupported(&self, other: &Self, learned: &Learned) -> Option<Event> {
        if self.border.is_empty() {
            return None;
        }
        let some: Vec<[f32; 3]> = some(&other.points).copied().collect();
        let motion = learned.motion().ok()?;
        let arrived = motion.carry(&some, other.time, self.time);
        let share = share_beyond(&self.points, &self.border, &arrived);
        let (own, of) = (&self.name, &other.name);
        (share > LEAST_MISSING).then(|| {
            Event::Note(format!(
                "{:.0} % of the {of} has no counterpart in the {own}: there the motion is a guess from what is near by",
                100.0 * share
            ))
        })
    }

    /// How far the surface is from the shape, in the mean.
    fn beyond(&self, surface: &Mesh<f32>) -> f64 {
        let of_mesh = self.mesh.as_ref().and_then(TriangleSearch::new);
        if let Some(search) = of_mesh {
            let away =
                some(&surface.vertices).map(|x| f64::from(search.closest(*x, 0).squared).sqrt());
            return mean(away);
        }
        let wide = |x: &[f32; 3]| x.map(f64::from);
        let points: Vec<[f64; 3]> = self.points.iter().map(wide).collect();
        let search = NeighbourSearch::new(&points);
        let spacing = usual_spacing(&points);
        let away =
            some(&surface.vertices).map(|x| search.nearest_one(wide(x)).squared_distance.sqrt());
        (mean(away) - SPACINGS * spacing).max(0.0)
    }
}

/// What is said of thin parts, such as fingers, that the cells of the grid have passed over.
pub(super) fn lost(ends: &[End], frames: &[Frame]) -> Option<Event> {
    let shares = ends.iter().filter_map(|end| {
        let frame = frames.iter().find(|frame| frame.time == end.time)?;
        Some((end.share_lost(&frame.mesh)?, frame.entry.time))
    });
    let (share, time) = shares.max_by(|one, other| one.0.total_cmp(&other.0))?;
    (share > LEAST_LOST).then(|| {
        Event::Note(format!(
            "surfaces lack thin parts, up to {:.2} % of a shape (at {time}), as cells of the grid are larger than these; \
             raise result.resolution, or use `isomorph extract RUN --resolution N`",
            100.0 * share
        ))
    })
}

/// What a surface has otherwise than the closed mesh that it should be.
fn compare_closed(
    name: &str,
    mesh: &Mesh<f32>,
    surface: &Mesh<f32>,
    found: &mut Vec<(String, &'static str)>,
) {
    let given = mesh.components_by_place().len();
    let all = surface.components();
    let least = PIECE * all.iter().map(|piece| piece.area).sum::<f64>();
    let large = all.iter().filter(|piece| piece.area >= least).count();
    if large > given {
        found.push((
            format!("is in {large} pieces, the {name} in {given}"),
            GHOSTS,
        ));
    }
    // Parts that pass through each other count twice in the mesh and once in the surface.
    if given > 1 {
        return;
    }
    let volume = surface.volume() / mesh.volume();
    if (volume - 1.0).abs() > VOLUME {
        found.push((
            format!("has {volume:.2} times the volume of the {name}"),
            FINER,
        ));
    }
    let area = surface.area() / mesh.area();
    if (area - 1.0).abs() > AREA {
        found.push((format!("has {area:.2} times the area of the {name}"), FINER));
    }
    let holes = |mesh: &Mesh<f32>, pieces: usize| pieces as i64 - mesh.euler_characteristic() / 2;
    let (now, before) = (holes(surface, all.len()), holes(&welded(mesh), given));
    if now > before + HOLES {
        found.push((
            format!("has {now} holes through it, the {name} {before}"),
            FINER,
        ));
    }
}

/// A mesh with vertices at one place made one, so that its edges are shared, and without triangles that lose a corner by
/// that, as at the poles of a sphere made of rings.
fn welded(mesh: &Mesh<f32>) -> Mesh<f32> {
    let first = crate::geometry::weld(&mesh.vertices);
    let name = |vertex: u32| first[vertex as usize];
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(name));
    let whole = triangles.filter(|[a, b, c]| a != b && b != c && c != a);
    Mesh::new(mesh.vertices.clone(), whole.collect())
}

/// So many of them, evenly chosen.
fn some<T>(all: &[T]) -> impl Iterator<Item = &T> {
    all.iter().step_by(all.len().div_ceil(PLACES).max(1))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value;
        count += 1;
    }
    sum / f64::from(count.max(1))
}

const LONGER: &str = "train longer (training.steps), or with another preset; if the shape has thin parts, raise \
     result.resolution";
const GHOSTS: &str = "look at it; stray points or wrong normals are the usual cause: see `isomorph info` of the file, \
     and the chapter troubleshooting of the guide";
const FINER: &str = "raise result.resolution; if it stays, parts are thinner than the points are apart: raise data.points";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_of_rings_has_no_holes_at_its_poles() {
        let (rings, around) = (8u32, 12u32);
        let vertex = |k: u32| {
            let polar = std::f32::consts::PI * (k / around) as f32 / rings as f32;
            let angle = std::f32::consts::TAU * (k % around) as f32 / around as f32;
            // Exactly on the axis at the poles.
            let ring = if (k / around).is_multiple_of(rings) {
                0.0
            } else {
                polar.sin()
            };
            [ring * angle.cos(), ring * angle.sin(), polar.cos()]
        };
        let vertices = (0..(rings + 1) * around).map(vertex).collect();
        let quads = (0..rings * around).map(|k| {
            let next = k / around * around + (k + 1) % around;
            [[k, k + around, next], [next, k + around, next + around]]
        });
        let sphere = Mesh::new(vertices, quads.flatten().collect());
        assert_eq!(welded(&sphere).euler_characteristic(), 2);
    }
    use crate::geometry::EdgeSharing;
    use crate::geometry::testing::{bumpy_sphere, together};

    fn narrow(mesh: &Mesh<f64>) -> Mesh<f32> {
        mesh.moved(|x| x.map(|part| part as f32))
    }

    fn end(mesh: &Mesh<f64>, closed: bool) -> End {
        let mesh = narrow(mesh);
        End {
            name: "source".to_owned(),
            time: 0.0,
            points: mesh.vertices.clone(),
            mesh: closed.then_some(mesh),
            border: Vec::new(),
            inside: 0.0,
        }
    }

    fn said(end: &End, surface: &Mesh<f64>) -> Vec<String> {
        let surface = narrow(surface);
        let found = end.findings(&surface);
        found.into_iter().map(|(finding, _)| finding).collect()
    }

    #[test]
    fn a_surface_that_is_its_input_contradicts_nothing() {
        let ball = bumpy_sphere(40);
        for closed in [true, false] {
            assert!(said(&end(&ball, closed), &ball).is_empty());
            // As coarse as a grid may be.
            assert!(said(&end(&ball, closed), &bumpy_sphere(24)).is_empty());
        }
        assert!(EdgeSharing::of(&welded(&narrow(&ball))).is_closed());
    }

    #[test]
    fn thin_parts_that_a_surface_lacks_are_measured() {
        let ball = bumpy_sphere(40);
        // A needle that stands on the ball, thinner than any cell.
        let needle = ball.moved(|[x, y, z]| [0.01 * x, 0.01 * y, 0.6 + 0.3 * z]);
        let whole = together(&[ball.clone(), needle.clone()]);
        let share = |mesh: &Mesh<f64>, closed, surface: &Mesh<f64>| {
            end(mesh, closed).share_lost(&narrow(surface))
        };
        assert_eq!(share(&whole, true, &whole), Some(0.0));
        assert_eq!(share(&ball, true, &bumpy_sphere(24)), Some(0.0));
        let lost = share(&whole, true, &ball).expect("of a closed mesh");
        assert!((lost - 0.5).abs() < 0.01, "half of the vertices: {lost}");
        // What lies inside of the surface is hidden, not lost; the points of a cloud may be noise.
        let hidden = together(&[ball.clone(), needle.moved(|[x, y, z]| [x, y, z - 0.6])]);
        assert_eq!(share(&hidden, true, &ball), Some(0.0));
        assert_eq!(share(&whole, false, &ball), None);
    }

    #[test]
    fn a_ghost_a_shrunken_surface_and_an_empty_one_are_named() {
        let ball = bumpy_sphere(40);
        let ghost = together(&[ball.clone(), ball.moved(|x| x.map(|part| 0.3 * part))]);
        let found = said(&end(&ball, true), &ghost);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(
            found[0].starts_with("has parts where the source has none"),
            "{found:?}"
        );
        assert!(
            found[1].starts_with("is in 2 pieces, the source in 1"),
            "{found:?}"
        );
        let found = said(&end(&ball, false), &ghost);
        assert!(found[0].starts_with("has parts where"), "{found:?}");
        let small = ball.moved(|x| x.map(|part| 0.9 * part));
        let found = said(&end(&ball, true), &small);
        assert!(
            found[0].starts_with("misses the source by 0.03"),
            "{found:?}"
        );
        assert!(
            found
                .iter()
                .any(|text| text.contains("0.73 times the volume")),
            "{found:?}"
        );
        assert_eq!(said(&end(&ball, true), &Mesh::default()), ["is empty"]);
    }
}
