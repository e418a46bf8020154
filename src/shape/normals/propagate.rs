//! Signs that pass from neighbour to neighbour, and stop where the cloud as a whole contradicts.

use rayon::prelude::*;

use crate::geometry::Neighbour;
use crate::geometry::linear::{difference, dot};

/// How much two parts must lose by a link that makes them contradict each other, in points that
/// surely know which way is out, for the link to be refused.
const CONTRADICTION: f64 = 1.0;

/// The least share of a part's evidence, for one sign over the other, for it to have a say.
const COHERENCE: f64 = 0.7;

/// How much the agreement of two neighbours counts beside the evidence of a point.
const NEIGHBOUR: f64 = 0.5;

/// Two neighbours, and how their signs go together.
struct Link {
    from: u32,
    to: u32,
    /// 1 if the two normals surely agree, -1 if one of them is surely to be turned.
    agreement: f32,
}

/// The signs, 1 or -1, under which the unit normals agree with their neighbours' and, part by part,
/// with the evidence: 1 where a normal as given surely points out, -1 where it surely points in.
pub(super) fn signs(
    points: &[[f64; 3]],
    normals: &[[f64; 3]],
    neighbours: &[Vec<Neighbour>],
    evidence: &[f64],
) -> Vec<f64> {
    let links = links(points, normals, neighbours);
    let mut parts = Parts::new(evidence);
    // Surest first, as in Kruskal's spanning tree: a doubtful link decides only what no better one did.
    for link in &links {
        parts.join(link);
    }
    parts.settle(&links)
}

/// All links of the neighbour graph, surest first.
fn links(points: &[[f64; 3]], normals: &[[f64; 3]], neighbours: &[Vec<Neighbour>]) -> Vec<Link> {
    let mut links: Vec<Link> = Vec::new();
    for (from, found) in neighbours.iter().enumerate() {
        for to in found.iter().map(|neighbour| neighbour.index as usize) {
            // Every point is its own first neighbour. Links found from both ends do no harm: the second
            // joins what is joined already.
            if to != from {
                links.push(Link {
                    from: from as u32,
                    to: to as u32,
                    agreement: agreement(
                        difference(points[to], points[from]),
                        normals[from],
                        normals[to],
                    ) as f32,
                });
            }
        }
    }
    // Ties are broken by the indices, so that the signs are the same on every run.
    links.par_sort_unstable_by(|a, b| {
        let surest = b.agreement.abs().total_cmp(&a.agreement.abs());
        surest.then((a.from, a.to).cmp(&(b.from, b.to)))
    });
    links
}

/// How the signs of two normals go together, which lie `apart`.
///
/// The mirror between two points of a sphere, of a straight edge or of two sheets face to face maps
/// the one outward normal to the other (König and Gumhold, "Consistent propagation of normal
/// orientations in point clouds", VMV 2009, who walk along the curve that this mirror closes). It
/// is the less sure the more squarely one looks at the other: then they lie on two sheets, or
/// noise has moved them apart.
fn agreement(apart: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let distance = dot(apart, apart).sqrt();
    // Two points at one place have no line between them to look along.
    if distance == 0.0 {
        return dot(a, b);
    }
    let (x, y) = (dot(apart, a) / distance, dot(apart, b) / distance);
    (dot(a, b) - 2.0 * x * y) * (1.0 - x.abs().max(y.abs()))
}

/// Sets of points whose signs are tied to each other (union-find with parity), with what is known
/// of each as a whole.
struct Parts {
    parent: Vec<u32>,
    /// Whether a member's sign is opposite to its parent's.
    opposite: Vec<bool>,
    size: Vec<u32>,
    /// Of a root: the sum of its members' evidence for its sign as given.
    evidence: Vec<f64>,
    /// Of a root: the sum of the magnitudes of that evidence.
    magnitude: Vec<f64>,
}

impl Parts {
    fn new(evidence: &[f64]) -> Self {
        let count = evidence.len();
        Self {
            parent: (0..count as u32).collect(),
            opposite: vec![false; count],
            size: vec![1; count],
            evidence: evidence.to_vec(),
            magnitude: evidence.iter().map(|x| x.abs()).collect(),
        }
    }

    /// The root of a member's part, and whether its sign is opposite to the root's.
    fn root(&mut self, member: u32) -> (usize, bool) {
        let mut at = member as usize;
        let mut opposite = false;
        while self.parent[at] as usize != at {
            let parent = self.parent[at] as usize;
            // Path halving.
            self.opposite[at] ^= self.opposite[parent];
            self.parent[at] = self.parent[parent];
            opposite ^= self.opposite[at];
            at = self.parent[at] as usize;
        }
        (at, opposite)
    }

    /// Joins the parts of two neighbours, unless both know better.
    fn join(&mut self, link: &Link) {
        let (a, turned_a) = self.root(link.from);
        let (b, turned_b) = self.root(link.to);
        if a == b {
            return;
        }
        // The link is about two members; what is to be tied are their roots.
        let opposite = turned_a ^ turned_b ^ (link.agreement < 0.0);
        let sign = if opposite { -1.0 } else { 1.0 };
        let together = self.evidence[a] + sign * self.evidence[b];
        let lost = self.evidence[a].abs() + self.evidence[b].abs() - together.abs();
        // Only two coherent parts can refuse a link: where the points of a part contradict each other
        // the sum of their evidence is mostly noise.
        if lost > CONTRADICTION && self.coherence(a).min(self.coherence(b)) > COHERENCE {
            return;
        }
        // The smaller below the larger keeps the paths to the roots short.
        let (large, small) = if self.size[a] < self.size[b] {
            (b, a)
        } else {
            (a, b)
        };
        self.parent[small] = large as u32;
        self.opposite[small] = opposite;
        self.size[large] += self.size[small];
        self.evidence[large] += sign * self.evidence[small];
        self.magnitude[large] += self.magnitude[small];
    }

    /// How much of a part's evidence is for one and the same sign: 0 for half and half, 1 for all.
    fn coherence(&self, root: usize) -> f64 {
        self.evidence[root].abs() / self.magnitude[root].max(f64::MIN_POSITIVE)
    }

    /// The signs of all members: each part's own evidence decides, unless more speaks against it
    /// in the links that were refused. A few points that are wrong about their outside do not
    /// stand against all of their neighbours; a finger does, held by few links at its root.
    fn settle(mut self, links: &[Link]) -> Vec<f64> {
        let count = self.parent.len();
        let relative = |(root, opposite)| (root, if opposite { -1.0 } else { 1.0 });
        let roots: Vec<(usize, f64)> = (0..count as u32)
            .map(|member| relative(self.root(member)))
            .collect();
        // Of each root: the sign of its part, at first by its own evidence.
        let mut signs: Vec<f64> = (self.evidence.iter())
            .map(|&evidence| if evidence < 0.0 { -1.0 } else { 1.0 })
            .collect();
        let between = |link: &Link| {
            let [(a, sign_a), (b, sign_b)] =
                [link.from, link.to].map(|member| roots[member as usize]);
            let agreement = NEIGHBOUR * f64::from(link.agreement) * sign_a * sign_b;
            (a != b).then_some((a, b, agreement))
        };
        // A link within a part keeps its agreement when the part is turned as a whole, so that only
        // links between two parts can decide.
        let refused: Vec<(usize, usize, f64)> = links.iter().filter_map(between).collect();
        let mut hold = vec![0.0; count];
        loop {
            // Two passes: the first sets what a part holds by itself, the second adds each link to it. A part
            // in several links is set to the same value each time.
            for &(a, b, _) in &refused {
                hold[a] = signs[a] * self.evidence[a];
                hold[b] = signs[b] * self.evidence[b];
            }
            for &(a, b, agreement) in &refused {
                hold[a] += agreement * signs[a] * signs[b];
                hold[b] += agreement * signs[a] * signs[b];
            }
            // Each turn takes from what contradicts more than rounding could give back: it ends.
            let weakest = (refused.iter())
                .flat_map(|&(a, b, _)| [a, b])
                .min_by(|&a, &b| hold[a].total_cmp(&hold[b]));
            match weakest {
                Some(part) if hold[part] < -1e-6 => signs[part] = -signs[part],
                _ => break,
            }
        }
        let sign = |&(root, relative): &(usize, f64)| signs[root] * relative;
        roots.iter().map(sign).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

    #[test]
    fn the_mirror_between_two_outward_normals_maps_them_to_each_other() {
        let half = 0.5_f64.sqrt();
        // Side by side, around an edge, and face to face, nearly: the squarer, the less sure.
        assert_eq!(agreement([1.0, 0.0, 0.0], UP, UP), 1.0);
        let edge = agreement([1.0, 0.0, -1.0], UP, [1.0, 0.0, 0.0]);
        assert!((edge - (1.0 - half)).abs() < 1e-12, "{edge}");
        let sheets = agreement([0.6, 0.0, 0.8], UP, DOWN);
        assert!(sheets > 0.0 && sheets < 0.1, "{sheets}");
        assert!(agreement([1.0, 0.0, 0.0], UP, DOWN) == -1.0);
        // At one place there is no mirror.
        assert_eq!(agreement([0.0; 3], UP, DOWN), -1.0);
    }

    /// A row of points along x, each the neighbour of the next.
    fn row(count: usize) -> (Vec<[f64; 3]>, Vec<Vec<Neighbour>>) {
        let points = (0..count).map(|i| [i as f64, 0.0, 0.0]).collect();
        let next = |i: usize| Neighbour {
            index: (i + 1).min(count - 1) as u32,
            squared_distance: 1.0,
        };
        (points, (0..count).map(|i| vec![next(i)]).collect())
    }

    #[test]
    fn parts_that_know_better_refuse_a_link() {
        // The link in the middle leans, so that it comes last; both halves are sure of up.
        let (points, neighbours) = row(8);
        let lean = |i: usize| if i < 4 { UP } else { [0.0, 0.6, -0.8] };
        let given: Vec<[f64; 3]> = (0..8).map(lean).collect();
        let evidence: Vec<f64> = (0..8).map(|i| if i < 4 { 1.0 } else { 0.9 }).collect();
        let found = signs(&points, &given, &neighbours, &evidence);
        assert_eq!(found, [1.0; 8]);
        // Halves of which one is of two minds follow the other.
        let mixed = [1.0, 1.0, 1.0, 1.0, 0.4, -0.4, 0.4, -0.3];
        let found = signs(&points, &given, &neighbours, &mixed);
        assert_eq!(found, [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0]);
    }

    #[test]
    fn a_point_alone_does_not_stand_against_its_neighbours() {
        let (points, neighbours) = row(5);
        // Two neighbours at half a point each.
        let wrong = |certainty: f64| [1.0, 1.0, -certainty, 1.0, 1.0];
        let found = signs(&points, &[UP; 5], &neighbours, &wrong(0.9));
        assert_eq!(found, [1.0; 5]);
        // Surer than both together it would.
        let found = signs(&points, &[UP; 5], &neighbours, &wrong(1.1));
        assert_eq!(found, [1.0, 1.0, -1.0, 1.0, 1.0]);
    }

    #[test]
    fn a_part_without_evidence_follows_its_neighbours() {
        let (points, neighbours) = row(5);
        let normals = [DOWN, UP, DOWN, UP, UP];
        let evidence = [-0.5, 0.0, 0.0, 0.0, 0.0];
        let found = signs(&points, &normals, &neighbours, &evidence);
        assert_eq!(found, [-1.0, 1.0, -1.0, 1.0, 1.0]);
    }
}
