//! Polygons into triangles: a fan where the polygon is convex, ears cut off where it is not.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;

use crate::geometry::linear::{add, cross, difference, dot};

/// Polygons over numbered vertices.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    corners: Vec<u32>,
    /// Where each polygon ends among the corners.
    ends: Vec<usize>,
}

impl Polygons {
    /// Adds a polygon. One of fewer than three corners has no area and becomes nothing.
    pub(super) fn push(&mut self, corners: &[u32]) {
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
    }

    /// Adds a strip of triangles: each corner from the third on makes one with the two before it, wound alike.
    pub(super) fn push_strip(&mut self, corners: &[u32]) {
        for (k, three) in corners.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]];
            self.push(&if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }

    /// The triangles of all polygons in their order.
    ///
    /// # Panics
    /// If a polygon names a vertex that is not there.
    pub(super) fn triangles(&self, vertices: &[[f64; 3]]) -> Vec<[u32; 3]> {
        let place = |number: u32| vertices[number as usize];
        self.triangles_at(place)
    }

    /// The same with vertices that a function knows.
    pub(super) fn triangles_at(&self, place: impl Fn(u32) -> [f64; 3]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.ends.len());
        let mut cutter = Cutter::default();
        let mut start = 0;
        for &end in &self.ends {
            cutter.add(&mut triangles, &self.corners[start..end], &place);
            start = end;
        }
        triangles
    }
}

/// Adds a polygon as a fan of triangles around its first corner: exact for convex polygons.
///
/// Polygons of fewer than three corners have no area and are passed over.
pub(super) fn push_fan(triangles: &mut Vec<[u32; 3]>, corners: &[u32]) {
    for edge in corners.get(1..).unwrap_or_default().windows(2) {
        triangles.push([corners[0], edge[0], edge[1]]);
    }
}

/// Cuts polygons, with its buffers.
#[derive(Default)]
struct Cutter {
    places: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    found: Vec<usize>,
    ears: Earcut<f64>,
}

impl Cutter {
    fn add(
        &mut self,
        triangles: &mut Vec<[u32; 3]>,
        corners: &[u32],
        place: impl Fn(u32) -> [f64; 3],
    ) {
        if corners.len() > 3 {
            self.measure(corners, place);
            if self.is_bent_in() && self.cut(corners.len()) {
                let threes = self.found.as_chunks::<3>().0.iter();
                triangles.extend(threes.map(|three| three.map(|k| corners[k])));
                return;
            }
        }
        push_fan(triangles, corners);
    }

    /// Takes the corners relative to the first, in units of their extent: files have any unit.
    fn measure(&mut self, corners: &[u32], place: impl Fn(u32) -> [f64; 3]) {
        let first = place(corners[0]);
        let away = corners.iter().map(|&k| difference(place(k), first));
        self.places.clear();
        self.places.extend(away);
        let extent = self
            .places
            .iter()
            .flatten()
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        if extent > 0.0 {
            self.places.iter_mut().flatten().for_each(|x| *x /= extent);
        }
    }

    /// Whether the fan has a triangle that faces the other way than the polygon as a whole: then it covers more than
    /// the polygon.
    fn is_bent_in(&self) -> bool {
        let [first, rest @ ..] = &self.places[..] else {
            return false;
        };
        let normals = || {
            let edges = rest.windows(2);
            edges.map(|edge| cross(difference(edge[0], *first), difference(edge[1], *first)))
        };
        let whole = normals().fold([0.0; 3], add);
        // A corner on a straight line has a normal of rounding alone.
        let least = -1e-9 * dot(whole, whole);
        normals().any(|normal| dot(normal, whole) < least)
    }

    /// Cuts the ears off in the polygon's plane; whether that gives as many triangles as it must.
    fn cut(&mut self, corners: usize) -> bool {
        if !project3d_to_2d(&self.places, corners, &mut self.flat) {
            return false;
        }
        let holes: [usize; 0] = [];
        self.ears
            .earcut(self.flat.iter().copied(), &holes, &mut self.found);
        // Fewer where edges cross each other or corners lie on one line.
        self.found.len() == 3 * (corners - 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;

    /// The triangles of one polygon.
    fn of(corners: &[[f64; 3]]) -> Mesh<f64> {
        let mut polygons = Polygons::default();
        polygons.push(&(0..corners.len() as u32).collect::<Vec<_>>());
        let triangles = polygons.triangles(corners);
        Mesh::new(corners.to_vec(), triangles)
    }

    #[test]
    fn a_polygon_becomes_a_fan_and_less_than_a_triangle_becomes_nothing() {
        let mut triangles = Vec::new();
        push_fan(&mut triangles, &[]);
        push_fan(&mut triangles, &[1, 2]);
        push_fan(&mut triangles, &[4, 5, 6, 7]);
        assert_eq!(triangles, [[4, 5, 6], [4, 6, 7]]);
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(of(&square).triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_polygon_with_a_notch_has_the_area_of_the_polygon_in_any_plane_and_unit() {
        // A U of width 3 with a notch of 1 by 2: area 7.
        let outline = [
            [0, 0],
            [3, 0],
            [3, 3],
            [2, 3],
            [2, 1],
            [1, 1],
            [1, 3],
            [0, 3],
        ];
        for unit in [1e-12, 1.0, 1e9] {
            for start in 0..outline.len() {
                let mut turned = outline;
                turned.rotate_left(start);
                let corners = turned.map(|[x, y]| {
                    let (x, y) = (f64::from(x) * unit, f64::from(y) * unit);
                    [0.6 * x, 0.8 * x, y + 5.0 * unit]
                });
                let mesh = of(&corners);
                assert_eq!(mesh.triangles.len(), 6);
                let area = mesh.area() / unit / unit;
                assert!((area - 7.0).abs() < 1e-6, "{area} from corner {start}");
                let normals = mesh.triangles.iter().map(|t| mesh.area_vector(*t));
                let sum = normals.fold([0.0; 3], add);
                // All face the way of the outline.
                let along = dot(sum, [0.8, -0.6, 0.0]) / 2.0 / unit / unit;
                assert!((along - 7.0).abs() < 1e-6, "{along} from corner {start}");
            }
        }
    }

    #[test]
    fn a_polygon_that_crosses_itself_is_still_a_fan() {
        let bow = [[0.0; 3], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(of(&bow).triangles.len(), 2);
    }

    #[test]
    fn strips_alternate_so_that_all_triangles_are_wound_alike() {
        let mut polygons = Polygons::default();
        polygons.push_strip(&[0, 1, 2, 3, 4]);
        let flat = |k: u32| [f64::from(k / 2), f64::from(k % 2), 0.0];
        let triangles = polygons.triangles_at(flat);
        assert_eq!(triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    }
}
