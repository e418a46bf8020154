//! The signed distance of a shape as it is, without training: what the flow carries with the preset "instant".
//!
//! Of a closed mesh it is exact, sharp edges included ([`TriangleSearch`]). Of a cloud, or of a mesh that is not
//! closed, it is that of the closed mesh that [`reconstruct`] makes of its points with normals.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::border::{Known, KnownSearch};
use super::far::FarField;
use super::keyframes::{Keyframe, PointCloud, Sheet};
use super::reconstruct::reconstruct;
use crate::geometry::linear::{cross, difference, scaled, unit};
use crate::geometry::{Closest, Mesh, TriangleSearch};

/// Queries that a core takes at a time: near ones together, since the last answer starts the next search.
const AT_A_TIME: usize = 512;

/// Closer to the surface than this, in normalised units, its own normal is the gradient: rounding.
const ON_SURFACE: f32 = 1e-5;

/// Places at which a mesh is searched for parts that lie inside others.
const LOOKED_AT: usize = 4000;

/// How far outside of a surface these places are, in normalised units.
const OUTSIDE: f32 = 1e-3;

/// What a signed distance is made from: all that a checkpoint has to hold of a shape. Normalised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SolidParts {
    /// The vertices of a closed mesh.
    pub points: Vec<[f32; 3]>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Whether parts of it may lie inside others: of a file's mesh, not of the zero set of a field.
    #[serde(default = "unknown")]
    pub may_overlap: bool,
    /// Where the shape is known, if it is not everywhere.
    #[serde(default)]
    pub known: Option<Known>,
    /// The thickness of an open sheet, whose mesh it then is: inside is what is nearer than half of that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f32>,
}

/// Checkpoints of before do not say.
const fn unknown() -> bool {
    true
}

impl SolidParts {
    /// Of a key frame; `None` if it is neither a closed mesh nor has normals, or its points close to nothing.
    pub(crate) fn of(key: &Keyframe) -> Option<Self> {
        if let Some(Sheet { mesh, thickness }) = &key.sheet {
            return Some(Self {
                points: mesh.vertices.clone(),
                triangles: mesh.triangles.clone(),
                may_overlap: false,
                known: None,
                thickness: Some(*thickness),
            });
        }
        let parts = match &key.mesh {
            Some(mesh) => Self {
                points: mesh.vertices.clone(),
                triangles: mesh.triangles.clone(),
                may_overlap: true,
                known: None,
                thickness: None,
            },
            None => Self::of_cloud(&key.cloud)?,
        };
        Some(Self {
            known: Known::of(&key.cloud.points, &key.border),
            ..parts
        })
    }

    /// Of points with normals that are known all around; `None` if they have no normals, or close to nothing.
    pub(crate) fn of_cloud(cloud: &PointCloud) -> Option<Self> {
        let closed = reconstruct(&cloud.points, cloud.normals.as_ref()?)?;
        Some(Self {
            points: closed.vertices,
            triangles: closed.triangles,
            may_overlap: false,
            known: None,
            thickness: None,
        })
    }

    /// Whether [`Solid::new`] makes a shape of them.
    pub(crate) fn is_sound(&self) -> bool {
        let has_area = || {
            let mesh = Mesh::new(self.points.clone(), self.triangles.clone());
            let mut areas = mesh.triangles.iter().map(|t| mesh.triangle_area(*t));
            areas.any(|area| area > 0.0)
        };
        self.is_whole() && has_area()
    }

    /// Whether the numbers fit together: what a damaged file need not.
    fn is_whole(&self) -> bool {
        let count = self.points.len();
        let finite = |rows: &[[f32; 3]]| rows.as_flattened().iter().all(|part| part.is_finite());
        let named = self.triangles.as_flattened().iter();
        let known = self.known.as_ref().is_none_or(Known::is_whole);
        let is_thick = |own: f32| own.is_finite() && own > 0.0;
        known
            && self.thickness.is_none_or(is_thick)
            && count > 0
            && finite(&self.points)
            && named.clone().all(|&index| (index as usize) < count)
    }
}

/// A shape with its signed distance.
pub(crate) struct Solid {
    parts: SolidParts,
    exact: Exact,
    far: FarField,
    known: Option<KnownSearch>,
}

/// What an exact distance takes.
struct Exact {
    search: TriangleSearch,
    /// Whether parts of it lie inside others.
    overlaps: bool,
    /// Half of the thickness of a sheet.
    half: Option<f32>,
}

impl Solid {
    /// Arranged for queries; `None` if the parts do not fit together or have no area.
    pub(crate) fn new(parts: SolidParts) -> Option<Self> {
        if !parts.is_whole() {
            return None;
        }
        let mesh = Mesh::new(parts.points.clone(), parts.triangles.clone());
        let search = TriangleSearch::new(&mesh)?;
        let overlaps = parts.may_overlap && overlaps(&search);
        let half = parts.thickness.map(|own| own / 2.0);
        let exact = Exact {
            search,
            overlaps,
            half,
        };
        let far = FarField::new(&parts.points, |places| exact.distances(places));
        let known = parts.known.as_ref().map(Known::arranged);
        Some(Self {
            parts,
            exact,
            far,
            known,
        })
    }

    /// What it is made from.
    pub(crate) fn parts(&self) -> &SolidParts {
        &self.parts
    }

    /// How far the shape is known about each of the places, 0 to 1; `None` where it is so everywhere.
    pub(crate) fn known_at(&self, places: &[[f32; 3]]) -> Option<Vec<f32>> {
        self.known.as_ref().map(|known| known.at(places))
    }

    /// The signed distance at each of the places, negative inside.
    pub(crate) fn distances(&self, places: &[[f32; 3]]) -> Vec<f32> {
        self.exact.distances(places)
    }

    /// The same for a search of the surface: far from it within a few per cent only, and much faster.
    pub(crate) fn distances_to_search(&self, places: &[[f32; 3]]) -> Vec<f32> {
        let mut found: Vec<f32> = places
            .par_iter()
            .with_min_len(AT_A_TIME)
            .map(|&x| self.far.at(x).unwrap_or(f32::NAN))
            .collect();
        let unknown = |(_, value): &(usize, &f32)| value.is_nan();
        let near: Vec<usize> = found
            .iter()
            .enumerate()
            .filter(unknown)
            .map(|(k, _)| k)
            .collect();
        let at: Vec<[f32; 3]> = near.iter().map(|&k| places[k]).collect();
        for (k, value) in near.into_iter().zip(self.distances(&at)) {
            found[k] = value;
        }
        found
    }

    /// The unit gradient of the signed distance at each of the places.
    pub(crate) fn gradients(&self, places: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let Exact { search, .. } = &self.exact;
        let at = |&x: &[f32; 3]| {
            let closest = search.closest(x, 0);
            if closest.squared < ON_SURFACE * ON_SURFACE {
                unit(search.normal(&closest))
            } else {
                let away = unit(difference(x, closest.point));
                match self.exact.half {
                    Some(_) => away,
                    None => scaled(away, self.exact.sign(&closest, x)),
                }
            }
        };
        places.par_iter().with_min_len(AT_A_TIME).map(at).collect()
    }
}

impl Exact {
    fn distances(&self, places: &[[f32; 3]]) -> Vec<f32> {
        let chunks = places.par_chunks(AT_A_TIME);
        let found = chunks.map(|chunk| {
            let mut near = 0;
            let at = |&x: &[f32; 3]| {
                let closest = self.search.closest(x, near);
                near = closest.triangle;
                let away = closest.squared.sqrt();
                match self.half {
                    Some(half) => away - half,
                    None => self.sign(&closest, x) * away,
                }
            };
            chunk.iter().map(at).collect::<Vec<f32>>()
        });
        found.collect::<Vec<_>>().concat()
    }

    /// -1 inside, 1 outside. Where parts lie inside others the winding number decides.
    fn sign(&self, closest: &Closest, x: [f32; 3]) -> f32 {
        let inside = if self.overlaps {
            self.search.winding(x) > 0.5
        } else {
            self.search.is_behind(closest, x)
        };
        if inside { -1.0 } else { 1.0 }
    }
}

/// Whether some of the surface lies inside another part of it: places just outside of it are not outside.
fn overlaps(search: &TriangleSearch) -> bool {
    let corners = search.corners();
    let some = corners
        .par_iter()
        .step_by(corners.len().div_ceil(LOOKED_AT));
    some.any(|&[a, b, c]| {
        let normal = unit(cross(difference(b, a), difference(c, a)));
        let before = |axis: usize| (a[axis] + b[axis] + c[axis]) / 3.0 + OUTSIDE * normal[axis];
        search.winding([0, 1, 2].map(before)) > 0.5
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::testing::{bumpy_sphere, random_places};

    fn parts(mesh: &Mesh<f64>) -> SolidParts {
        SolidParts {
            points: mesh
                .vertices
                .iter()
                .map(|x| x.map(|part| part as f32))
                .collect(),
            triangles: mesh.triangles.clone(),
            may_overlap: true,
            known: None,
            thickness: None,
        }
    }

    #[test]
    fn a_sheet_is_as_thick_as_it_is_said_to_be() {
        // A square of side 1 in the plane z = 0.
        let square = Mesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            vec![[0, 1, 2], [0, 2, 3]],
        );
        let sheet = |thickness| {
            let thickness = Some(thickness);
            Solid::new(SolidParts {
                thickness,
                may_overlap: false,
                ..parts(&square)
            })
        };
        let solid = sheet(0.04).expect("a sheet");
        let places = [
            [0.5, 0.5, 0.05],
            [0.5, 0.5, -0.05],
            [0.5, 0.5, 0.0],
            [1.1, 0.5, 0.0],
            [0.3, 0.4, 0.01],
        ];
        let distances = solid.distances(&places);
        for (found, wanted) in distances.iter().zip([0.03, 0.03, -0.02, 0.08, -0.01]) {
            assert!((found - wanted).abs() < 1e-6, "{distances:?}");
        }
        let gradients = solid.gradients(&places);
        assert_eq!(gradients[0], [0.0, 0.0, 1.0]);
        assert_eq!(gradients[1], [0.0, 0.0, -1.0]);
        assert_eq!(gradients[3], [1.0, 0.0, 0.0]);
        for wrong in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(sheet(wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn distances_of_a_mesh_are_exact_and_their_gradients_lead_to_the_surface() {
        let solid = Solid::new(parts(&bumpy_sphere(40))).expect("a solid");
        let places = random_places(400, 0.8, 1);
        let (distances, gradients) = (solid.distances(&places), solid.gradients(&places));
        let inside = distances.iter().filter(|d| **d < 0.0).count();
        assert!((20..200).contains(&inside), "{inside} inside");
        let moved = places.iter().zip(distances.iter().zip(&gradients));
        let onto: Vec<[f32; 3]> = moved
            .map(|(x, (d, g))| [0, 1, 2].map(|axis| x[axis] - d * g[axis]))
            .collect();
        for left in solid.distances(&onto) {
            assert!(left.abs() < 2e-6, "{left}");
        }
    }

    #[test]
    fn a_part_inside_another_makes_no_surface_of_its_own() {
        let mut mesh = bumpy_sphere(24);
        let other = mesh.moved(|x| [x[0] + 0.3, x[1], x[2]]);
        let alone = Solid::new(parts(&mesh)).expect("a solid");
        assert!(!alone.exact.overlaps);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(other.vertices);
        let named = other.triangles.iter().map(|t| t.map(|index| index + first));
        mesh.triangles.extend(named);
        let both = Solid::new(parts(&mesh)).expect("a solid");
        // Along the middle: inside from one end to the other.
        for k in 0..100 {
            let x = [-0.35 + 0.01 * k as f32, 0.01, 0.02];
            assert!(both.distances(&[x])[0] < 0.0, "at {x:?}");
        }
    }

    #[test]
    fn parts_that_do_not_fit_together_make_none() {
        let good = parts(&bumpy_sphere(8));
        let mut wrong = good.clone();
        wrong.triangles[0][0] = 10_000;
        assert!(Solid::new(wrong).is_none());
        let mut wrong = good.clone();
        wrong.points[0][0] = f32::NAN;
        assert!(Solid::new(wrong).is_none());
        assert!(
            Solid::new(SolidParts {
                triangles: Vec::new(),
                ..good
            })
            .is_none()
        );
    }
}
