//! How a surface passes through one cubic cell: closed loops over its edges, cut into triangles.
//!
//! The usual table of 256 cases is not needed. Each face of the cell is decided from its own four
//! values, so the two cells that share it always agree:
//!
//! * walking round a face counter-clockwise as seen from outside the cell, the surface line runs
//!   from each crossing that *enters* the inside (f < 0) to the crossing that leaves it again;
//! * with four crossings there are two ways to do that. The bilinear interpolant of the face has
//!   a saddle; the two inside corners are joined when it is negative there, that is when the
//!   product of their values exceeds that of the outside corners.
//!
//! Each crossed edge lies in two faces of the cell, entered in one and left in the other, so the
//! lines close to loops. Seen from the whole grid, the four cells round a crossed edge form one
//! ring: the mesh is closed and oriented, and every vertex is a manifold point.
//!
//! A loop is cut by diagonals that never join two edges of one face: the cell beyond that face
//! might draw the same diagonal, and the edge would lie in four triangles. Where no such cut
//! exists the loop gets a vertex in its middle instead.
//!
//! Corner `c` has coordinates `(c & 1, c >> 1 & 1, c >> 2)`. Edge `4 a + k` runs along axis `a`;
//! the bits of `k` are its place on the two axes that follow `a` cyclically.

/// Most crossed edges in one loop: all of them.
const MOST: usize = 12;
/// Marks an edge that the surface does not cross.
const NO_EDGE: u8 = u8::MAX;

/// The edges of a cell that one closed line of the surface crosses, in order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loop {
    edges: [u8; MOST],
    length: usize,
}

impl Loop {
    pub(super) fn edges(&self) -> &[u8] {
        &self.edges[..self.length]
    }
}

/// The corner at the lower end of an edge, as three coordinates 0 or 1, and the edge's axis.
pub(super) fn lower_end(edge: u8) -> ([u32; 3], usize) {
    let axis = usize::from(edge / 4);
    let mut corner = [0; 3];
    corner[(axis + 1) % 3] = u32::from(edge & 1);
    corner[(axis + 2) % 3] = u32::from(edge >> 1 & 1);
    (corner, axis)
}

/// The edge between two corners that differ in one coordinate.
fn edge_between(from: usize, to: usize) -> u8 {
    let axis = (from ^ to).trailing_zeros() as usize;
    let place = from >> ((axis + 1) % 3) & 1 | (from >> ((axis + 2) % 3) & 1) << 1;
    (4 * axis + place) as u8
}

/// The corners of a face, counter-clockwise as seen from outside the cell.
fn face_corners(axis: usize, upper: bool) -> [usize; 4] {
    let (first, second) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = usize::from(upper) << axis;
    if upper {
        [base, base | first, base | first | second, base | second]
    } else {
        [base, base | second, base | first | second, base | first]
    }
}

/// Whether two edges lie in a common face of the cell.
fn share_face(one: u8, other: u8) -> bool {
    let ((p, a), (q, b)) = (lower_end(one), lower_end(other));
    (0..3).any(|axis| axis != a && axis != b && p[axis] == q[axis])
}

/// Calls `found` with every loop of the surface in a cell with these corner values.
pub(super) fn trace_loops(values: &[f32; 8], mut found: impl FnMut(&Loop)) {
    let mut next = [NO_EDGE; MOST];
    for axis in 0..3 {
        for upper in [false, true] {
            link_face(values, face_corners(axis, upper), &mut next);
        }
    }
    for start in 0..MOST {
        let mut line = Loop {
            edges: [NO_EDGE; MOST],
            length: 0,
        };
        let mut edge = start;
        while next[edge] != NO_EDGE {
            line.edges[line.length] = edge as u8;
            line.length += 1;
            // Taking the link away marks the edge as walked: each lies in one loop only.
            edge = usize::from(std::mem::replace(&mut next[edge], NO_EDGE));
        }
        if line.length > 0 {
            found(&line);
        }
    }
}

/// Enters the surface lines of one face into `next`: from each entering crossing to a leaving one.
fn link_face(values: &[f32; 8], corners: [usize; 4], next: &mut [u8; MOST]) {
    let inside = corners.map(|corner| values[corner] < 0.0);
    let joined = inside_corners_join(corners.map(|corner| values[corner]));
    for i in 0..4 {
        if inside[i] || !inside[(i + 1) % 4] {
            continue;
        }
        let leaves = |step: &usize| inside[(i + step) % 4] && !inside[(i + step + 1) % 4];
        let forwards = [1, 2, 3];
        let backwards = [3, 2, 1];
        let step = if joined { backwards } else { forwards }
            .into_iter()
            .find(leaves);
        let leaving = i + step.expect("who enters the inside on a closed walk leaves it again");
        let crossing = |j: usize| edge_between(corners[j % 4], corners[(j + 1) % 4]);
        next[usize::from(crossing(i))] = crossing(leaving);
    }
}

/// Whether the inside corners of a face with four crossings are connected across its middle.
fn inside_corners_join([a, b, c, d]: [f32; 4]) -> bool {
    // Products of f32 are exact in f64, so both cells at the face find the same answer.
    let (ac, bd) = (f64::from(a) * f64::from(c), f64::from(b) * f64::from(d));
    match (a < 0.0, b < 0.0, c < 0.0, d < 0.0) {
        (true, false, true, false) => ac > bd,
        (false, true, false, true) => bd > ac,
        _ => false,
    }
}

/// Cuts a loop into triangles with the least sum of squared diagonals, as indices into the loop;
/// `None` where every cut would need a diagonal within a face of the cell.
///
/// `points` are the crossings in the order of the loop.
pub(super) fn cut_into_triangles(line: &Loop, points: &[[f32; 3]]) -> Option<Vec<[usize; 3]>> {
    let n = line.length;
    assert_eq!(points.len(), n, "one point per crossed edge");
    // least[i][j]: the best cut of the part of the loop from i to j; apex[i][j]: the third corner
    // of the triangle on the chord from i to j.
    let mut least = [[0.0_f64; MOST]; MOST];
    let mut apex = [[0; MOST]; MOST];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let costs = (i + 1..j).map(|k| (least[i][k] + least[k][j], k));
            let (cost, k) = costs
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .expect("span of 2 or more");
            let closing_side = span == n - 1;
            least[i][j] = cost
                + if closing_side {
                    0.0
                } else {
                    diagonal(line, points, i, j)
                };
            apex[i][j] = k;
        }
    }
    least[0][n - 1].is_finite().then(|| {
        let mut triangles = Vec::with_capacity(n - 2);
        let mut chords = vec![(0, n - 1)];
        while let Some((i, j)) = chords.pop() {
            if j > i + 1 {
                let k = apex[i][j];
                triangles.push([i, k, j]);
                chords.extend([(i, k), (k, j)]);
            }
        }
        triangles
    })
}

/// The cost of joining points `i` and `j` of a loop: infinite within a face of the cell.
fn diagonal(line: &Loop, points: &[[f32; 3]], i: usize, j: usize) -> f64 {
    if share_face(line.edges[i], line.edges[j]) {
        return f64::INFINITY;
    }
    (0..3)
        .map(|axis| f64::from(points[i][axis] - points[j][axis]).powi(2))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops(values: &[f32; 8]) -> Vec<Loop> {
        let mut all = Vec::new();
        trace_loops(values, |line| all.push(*line));
        all
    }

    fn midpoints(line: &Loop) -> Vec<[f32; 3]> {
        let middle = |&edge: &u8| {
            let (corner, axis) = lower_end(edge);
            let mut point = corner.map(|part| part as f32);
            point[axis] += 0.5;
            point
        };
        line.edges().iter().map(middle).collect()
    }

    /// Corner values for all 256 sign patterns, each with several sizes, so that both answers to
    /// every ambiguous face occur.
    fn all_patterns() -> impl Iterator<Item = [f32; 8]> {
        (0..256 * 64_u32).map(|i| {
            let (signs, sizes) = (i % 256, i / 256);
            std::array::from_fn(|corner| {
                let size = 1.0 + 3.0 * ((sizes * 37 + corner as u32 * 11) % 8) as f32;
                if signs >> corner & 1 == 1 {
                    -size
                } else {
                    size
                }
            })
        })
    }

    #[test]
    fn one_inside_corner_gives_one_triangle_that_faces_away_from_it() {
        for corner in 0..8 {
            let mut values = [1.0; 8];
            values[corner] = -1.0;
            let all = loops(&values);
            assert_eq!((all.len(), all[0].length), (1, 3));
            let points = midpoints(&all[0]);
            let [[i, j, k]] = cut_into_triangles(&all[0], &points).expect("a triangle")[..] else {
                panic!("one triangle")
            };
            let side = |a: usize, b: usize| {
                std::array::from_fn(|axis| f64::from(points[b][axis] - points[a][axis]))
            };
            let normal = crate::geometry::linear::cross(side(i, j), side(i, k));
            for (axis, part) in normal.into_iter().enumerate() {
                let outwards = if corner >> axis & 1 == 0 { 1.0 } else { -1.0 };
                assert!(part * outwards > 0.0, "corner {corner}: normal {normal:?}");
            }
        }
    }

    #[test]
    fn every_crossed_edge_lies_in_exactly_one_loop() {
        for values in all_patterns() {
            let mut walked: Vec<u8> = loops(&values)
                .iter()
                .flat_map(|l| l.edges().to_vec())
                .collect();
            walked.sort_unstable();
            let crossed = |&edge: &u8| {
                let (corner, axis) = lower_end(edge);
                let lower = (corner[0] | corner[1] << 1 | corner[2] << 2) as usize;
                (values[lower] < 0.0) != (values[lower | 1 << axis] < 0.0)
            };
            assert_eq!(
                walked,
                (0..12).filter(crossed).collect::<Vec<_>>(),
                "{values:?}"
            );
        }
    }

    #[test]
    fn neighbouring_cells_draw_the_same_lines_on_their_common_face() {
        // The upper face along an axis of one cell is the lower face of the next: same values,
        // opposite walk, so each line must come out reversed.
        for values in all_patterns() {
            for axis in 0..3 {
                let mut beyond = [1.0; 8];
                for corner in (0..8).filter(|corner| corner >> axis & 1 == 1) {
                    beyond[corner ^ 1 << axis] = values[corner];
                }
                let (mut here, mut there) = ([NO_EDGE; MOST], [NO_EDGE; MOST]);
                link_face(&values, face_corners(axis, true), &mut here);
                link_face(&beyond, face_corners(axis, false), &mut there);
                for edge in (0..12_u8).filter(|&edge| here[usize::from(edge)] != NO_EDGE) {
                    let moved = |edge: u8| {
                        let (corner, along) = lower_end(edge);
                        let corner = (corner[0] | corner[1] << 1 | corner[2] << 2) as usize;
                        usize::from(edge_between(
                            corner ^ 1 << axis,
                            corner ^ 1 << axis | 1 << along,
                        ))
                    };
                    let to = here[usize::from(edge)];
                    assert_eq!(usize::from(there[moved(to)]), moved(edge), "{values:?}");
                }
            }
        }
    }

    #[test]
    fn the_saddle_of_a_face_decides_whether_its_inside_corners_join() {
        assert!(inside_corners_join([-3.0, 1.0, -3.0, 1.0]));
        assert!(!inside_corners_join([-1.0, 3.0, -1.0, 3.0]));
        assert!(inside_corners_join([1.0, -3.0, 1.0, -3.0]));
        assert!(
            !inside_corners_join([-3.0, -3.0, 1.0, 1.0]),
            "two crossings only"
        );
    }

    #[test]
    fn no_diagonal_joins_two_edges_of_one_face_and_few_loops_need_a_middle() {
        let (mut cut, mut uncut, mut longest) = (0, 0, 0);
        for line in all_patterns().flat_map(|values| loops(&values)) {
            longest = longest.max(line.length);
            let Some(triangles) = cut_into_triangles(&line, &midpoints(&line)) else {
                uncut += 1;
                continue;
            };
            cut += 1;
            assert_eq!(triangles.len(), line.length - 2);
            for [i, j, k] in triangles {
                for (a, b) in [(i, j), (j, k), (k, i)] {
                    let neighbours = a.abs_diff(b) == 1 || a.abs_diff(b) == line.length - 1;
                    let apart = !share_face(line.edges[a], line.edges[b]);
                    assert!(neighbours || apart, "{line:?}: {a} to {b}");
                }
            }
        }
        println!("cut {cut}, middle {uncut}, longest loop {longest}");
        assert!(longest > 6, "the saddle rule makes long loops: {longest}");
        assert!(
            uncut * 10 < cut,
            "{uncut} loops of {} need a middle",
            cut + uncut
        );
    }
}
