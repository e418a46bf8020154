//! Meshes and clouds with fewer points: vertices of one cell of a grid become one.
//!
//! The grid is as fine as a number of points allows. Of the vertices in a cell the mean is shown, and the one nearest
//! to the mean stands for them where something is measured. Triangles within one cell, and those that occur
//! twice, are left out.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::geometry::Mesh;

/// A mesh with fewer points.
pub(crate) struct Thinned {
    /// Where the points are shown.
    pub mesh: Mesh<f32>,
    /// For each of them the vertex that stands for it.
    pub chosen: Vec<u32>,
}

/// A mesh with at most `most` vertices: itself if it has no more.
pub(crate) fn thinned(mesh: &Mesh<f32>, most: usize) -> Thinned {
    if mesh.vertices.len() <= most {
        return Thinned {
            mesh: Mesh::new(mesh.vertices.clone(), mesh.triangles.clone()),
            chosen: (0..mesh.vertices.len() as u32).collect(),
        };
    }
    // A surface meets about 1.6 cells of a grid for each of its squares of that side.
    let mut cell = (1.6 * mesh.area() / most as f64).sqrt() as f32;
    loop {
        let (of, count) = cells(&mesh.vertices, cell.max(f32::MIN_POSITIVE));
        if count <= most {
            return merged(mesh, &of, count);
        }
        cell *= ((count as f32 / most as f32).sqrt() * 1.02).max(1.05);
    }
}

/// The cell of each vertex, and how many cells there are.
fn cells(vertices: &[[f32; 3]], size: f32) -> (Vec<u32>, usize) {
    let mut known: FxHashMap<[i32; 3], u32> = FxHashMap::default();
    let of = vertices.iter().map(|x| {
        let next = known.len() as u32;
        let place = x.map(|part| (part / size).floor() as i32);
        *known.entry(place).or_insert(next)
    });
    let of = of.collect();
    (of, known.len())
}

fn merged(mesh: &Mesh<f32>, of: &[u32], count: usize) -> Thinned {
    let mut sums = vec![[0.0_f64; 4]; count];
    for (x, cell) in mesh.vertices.iter().zip(of) {
        let sum = &mut sums[*cell as usize];
        for k in 0..3 {
            sum[k] += f64::from(x[k]);
        }
        sum[3] += 1.0;
    }
    let mean = |sum: &[f64; 4]| [0, 1, 2].map(|k| (sum[k] / sum[3]) as f32);
    let vertices: Vec<[f32; 3]> = sums.iter().map(mean).collect();
    let mut best = vec![(f32::INFINITY, 0); count];
    for (k, (x, cell)) in mesh.vertices.iter().zip(of).enumerate() {
        let there = &vertices[*cell as usize];
        let away: f32 = (0..3).map(|j| (x[j] - there[j]).powi(2)).sum();
        let best = &mut best[*cell as usize];
        if away < best.0 {
            *best = (away, k as u32);
        }
    }
    let mut seen = FxHashSet::default();
    let triangles = mesh.triangles.iter().filter_map(|corners| {
        let [a, b, c] = corners.map(|corner| of[corner as usize]);
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        let is_new = a != b && b != c && c != a && seen.insert(sorted);
        is_new.then_some([a, b, c])
    });
    let triangles = triangles.collect();
    Thinned {
        mesh: Mesh::new(vertices, triangles),
        chosen: best.into_iter().map(|(_, vertex)| vertex).collect(),
    }
}

/// The numbers of at most `most` of so many points, evenly over their order.
pub(crate) fn thinned_cloud(count: usize, most: usize) -> Vec<u32> {
    let apart = count.div_ceil(most.max(1)).max(1);
    (0..count as u32).step_by(apart).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `n x n` vertices in the plane z = 0, of side 1.
    fn square(n: u32) -> Mesh<f32> {
        let at = |k: u32| k as f32 / (n - 1) as f32;
        let vertices = (0..n * n).map(|k| [at(k % n), at(k / n), 0.0]).collect();
        let cells = (0..(n - 1) * (n - 1)).map(|k| (k % (n - 1)) + n * (k / (n - 1)));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]);
        Mesh::new(vertices, triangles.collect())
    }

    #[test]
    fn a_mesh_keeps_its_form_with_fewer_points() {
        let mesh = square(60);
        let thin = thinned(&mesh, 500);
        let count = thin.mesh.vertices.len();
        assert!((200..=500).contains(&count), "{count} of 500");
        assert_eq!(thin.chosen.len(), count);
        // A rim of half a cell is lost: a cell has a side of about 1/20.
        assert!(
            (thin.mesh.area() - 1.0).abs() < 0.15,
            "{}",
            thin.mesh.area()
        );
        for (x, k) in thin.mesh.vertices.iter().zip(&thin.chosen) {
            let vertex = mesh.vertices[*k as usize];
            assert!((x[0] - vertex[0]).abs() < 0.05, "{x:?} and {vertex:?}");
        }
        for triangle in &thin.mesh.triangles {
            assert!(
                thin.mesh.area_vector(*triangle)[2] >= 0.0,
                "the side is kept"
            );
        }
    }

    #[test]
    fn a_mesh_that_is_small_enough_stays_as_it_is() {
        let mesh = square(5);
        let thin = thinned(&mesh, 25);
        assert_eq!(thin.mesh, mesh);
        assert_eq!(thinned_cloud(10, 4), [0, 3, 6, 9]);
        assert_eq!(thinned_cloud(3, 4), [0, 1, 2]);
    }
}
