//! Which vertices of a mesh hang together: disjoint sets of vertices, joined by triangles.

/// Disjoint sets of vertices.
#[derive(Debug)]
pub(crate) struct Connected {
    parents: Vec<u32>,
}

impl Connected {
    /// Vertices that stand for each other (`parents[v]` is `v` or a vertex at the same place that comes
    /// before it), joined where a triangle uses them.
    pub(crate) fn new(parents: Vec<u32>, triangles: &[[u32; 3]]) -> Self {
        let mut sets = Self { parents };
        for &[a, b, c] in triangles {
            sets.join(a, b);
            sets.join(a, c);
        }
        sets
    }

    /// The vertex that stands for the set of `vertex`; shortens the way there for the next time.
    pub(crate) fn root(&mut self, mut vertex: u32) -> u32 {
        while self.parents[vertex as usize] != vertex {
            let above = self.parents[self.parents[vertex as usize] as usize];
            self.parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_join_what_they_use_and_the_first_vertex_stands_for_all() {
        let mut sets = Connected::new((0..8).collect(), &[[5, 6, 7], [1, 2, 3], [3, 4, 2]]);
        let roots: Vec<u32> = (0..8).map(|vertex| sets.root(vertex)).collect();
        assert_eq!(roots, [0, 1, 1, 1, 1, 5, 5, 5]);
    }
}
