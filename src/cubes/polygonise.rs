//! From node values to one indexed mesh: a vertex on every crossed grid edge, shared by the four
//! cells round it, and the loops of every cell cut into triangles (`cell.rs`).
//!
//! A vertex first lies where the straight line between the two node values is zero. The field is
//! evaluated there once more, and the vertex moves to the zero of the parabola through the three
//! values: along an edge that the surface barely crosses a distance is nearly a parabola. On the
//! sphere of the tests, at 64 cells, this takes the largest error of a vertex from 2.0e-4 to 2.0e-5
//! (a cell is 3.1e-2), that of the volume from 1.6e-3 to 1.3e-3, and costs a seventh more values.

use rustc_hash::FxHashMap;

use super::cell::{Loop, cut_into_triangles, lower_end, trace_loops};
use super::grid::ExtractError;
use super::lattice::{Node, pack};
use super::search::{Search, corner};
use crate::geometry::Mesh;

/// Vertices keep this distance from grid nodes, in cells: at a node, those of all its crossed
/// edges would coincide.
const FROM_NODE: f64 = 1e-3;

/// A grid edge on which the field changes sign, with the values at its ends.
struct Crossing {
    node: Node,
    axis: usize,
    values: [f64; 2],
}

impl Crossing {
    /// The zero of the straight line between both ends, in cells from the node.
    fn straight(&self) -> f64 {
        let [f_0, f_1] = self.values;
        keep_off_nodes(f_0 / (f_0 - f_1))
    }

    /// The zero of the parabola that also takes `value` at the zero of the straight line.
    fn curved(&self, value: f64) -> f64 {
        let ([f_0, f_1], t) = (self.values, self.straight());
        // f_0 + (f_1 - f_0) s + bend s (s - 1): one root in [0, 1], since the signs differ there.
        let bend = (value - f_0 - (f_1 - f_0) * t) / (t * (t - 1.0));
        let slope = f_1 - f_0 - bend;
        let root = (slope * slope - 4.0 * bend * f_0).max(0.0).sqrt();
        let towards_f_1 = if f_1 > f_0 { root } else { -root };
        // Of the two ways to write this root, the one whose terms do not cancel.
        keep_off_nodes(if slope * towards_f_1 > 0.0 {
            -2.0 * f_0 / (slope + towards_f_1)
        } else {
            (towards_f_1 - slope) / (2.0 * bend)
        })
    }

    fn place(&self, along: f64) -> [f64; 3] {
        let mut place = self.node.map(f64::from);
        place[self.axis] += along;
        place
    }
}

fn keep_off_nodes(along: f64) -> f64 {
    along.clamp(FROM_NODE, 1.0 - FROM_NODE)
}

/// Makes the mesh of a finished search, and says whether it ends at the box.
pub(super) fn polygonise<F, E>(
    search: &mut Search<'_, F>,
) -> Result<(Mesh<f32>, bool), ExtractError<E>>
where
    F: FnMut(&[[f32; 3]]) -> Result<Vec<f32>, E>,
{
    let crossings = crossings(search);
    let cells = search.grid.cells();
    let on_box = |crossing: &Crossing| {
        let at_end = |axis: usize| [0, cells[axis]].contains(&crossing.node[axis]);
        (0..3).any(|axis| axis != crossing.axis && at_end(axis))
    };
    let crosses_box = crossings.iter().any(on_box);
    let index: FxHashMap<(u64, usize), u32> = crossings
        .iter()
        .enumerate()
        .map(|(i, crossing)| ((pack(crossing.node), crossing.axis), i as u32))
        .collect();
    let vertices = placed(search, &crossings)?;
    let mut mesh = Mesh::new(vertices, Vec::new());
    for (cell, _) in search.lattice.known() {
        if let Some(values) = mixed_corners(search, cell) {
            trace_loops(&values, |line| add_loop(&mut mesh, &index, cell, line));
        }
    }
    Ok((mesh, crosses_box))
}

/// All crossed edges of the grid, in a fixed order.
fn crossings<F>(search: &Search<'_, F>) -> Vec<Crossing> {
    let mut found = Vec::new();
    for (node, value) in search.lattice.known() {
        for axis in 0..3 {
            let Some(beyond) = search.lattice.get(corner(node, 1 << axis, 1)) else {
                continue;
            };
            if (value < 0.0) != (beyond < 0.0) {
                let values = [f64::from(value), f64::from(beyond)];
                found.push(Crossing { node, axis, values });
            }
        }
    }
    found
}

/// The vertices of all crossings, in the same order.
fn placed<F, E>(
    search: &mut Search<'_, F>,
    crossings: &[Crossing],
) -> Result<Vec<[f32; 3]>, ExtractError<E>>
where
    F: FnMut(&[[f32; 3]]) -> Result<Vec<f32>, E>,
{
    let grid = search.grid;
    let straight = |crossing: &Crossing| grid.position(crossing.place(crossing.straight()));
    let first: Vec<[f32; 3]> = crossings.iter().map(straight).collect();
    let values = search.values(&first)?;
    let curved = |(crossing, value): (&Crossing, f32)| {
        grid.position(crossing.place(crossing.curved(f64::from(value))))
    };
    Ok(crossings.iter().zip(values).map(curved).collect())
}

/// The corner values of the cell above `cell` if the surface passes through it.
fn mixed_corners<F>(search: &Search<'_, F>, cell: Node) -> Option<[f32; 8]> {
    // Cells that the surface crosses are complete; one with an unknown corner is not crossed.
    let mut nodes = [cell; 8];
    for (which, node) in nodes.iter_mut().enumerate() {
        *node = corner(cell, which as u32, 1);
    }
    let values = search.lattice.get_all(nodes)?;
    let inside = values.iter().filter(|&&value| value < 0.0).count();
    (1..8).contains(&inside).then_some(values)
}

/// Adds the triangles of one loop.
fn add_loop(mesh: &mut Mesh<f32>, index: &FxHashMap<(u64, usize), u32>, cell: Node, line: &Loop) {
    let vertex = |&edge: &u8| {
        let (offset, axis) = lower_end(edge);
        index[&(pack(std::array::from_fn(|i| cell[i] + offset[i])), axis)]
    };
    let around: Vec<u32> = line.edges().iter().map(vertex).collect();
    let points: Vec<[f32; 3]> = around.iter().map(|&i| mesh.vertices[i as usize]).collect();
    if let Some(triangles) = cut_into_triangles(line, &points) {
        mesh.triangles.extend(
            triangles
                .into_iter()
                .map(|triangle| triangle.map(|i| around[i])),
        );
        return;
    }
    let middle = mesh.vertices.len() as u32;
    let mean =
        |axis: usize| points.iter().map(|point| point[axis]).sum::<f32>() / points.len() as f32;
    mesh.vertices.push(std::array::from_fn(mean));
    for (i, &from) in around.iter().enumerate() {
        mesh.triangles
            .push([from, around[(i + 1) % around.len()], middle]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_met_exactly_and_a_straight_line_too() {
        // Falling, rising, with the vertex of the parabola between the ends, and with f_0 = 0.
        let parabolas: [fn(f64) -> f64; 5] = [
            |s| 0.3 - s,
            |s| (s - 0.25) * (s + 2.0),
            |s| 1.0 - 4.0 * (s - 0.3) * (s - 0.3),
            |s| s * (0.75 - s),
            |s| (s + 0.1) * (s - 0.9),
        ];
        for (field, zero) in parabolas.iter().zip([0.3, 0.25, 0.8, 0.75, 0.9]) {
            let crossing = Crossing {
                node: [0; 3],
                axis: 0,
                values: [field(0.0), field(1.0)],
            };
            let found = crossing.curved(field(crossing.straight()));
            // The formula is exact; rounding grows where the first point is close to an end.
            assert!((found - zero).abs() < 1e-9, "{found} for {zero}");
        }
    }
}
