//! How much memory a run takes, before it takes it: an upper bound from recipe and shapes.
//!
//! The figures are peaks of whole runs on an AMD EPYC with two cores, 2026-11-28, rounded up by a third or more, because
//! a run that is let in and fails is worse than one that is refused. Memory of a graphics card is not part of it.

use isomorph_training::method::{self, spline};

use crate::error::{Error, Result};
use crate::recipe::Recipe;

const MIB: u64 = 1 << 20;

/// The program, its threads and a page. (130 to 190 MiB with small shapes.)
const PROGRAM: u64 = 200 * MIB;

/// A vertex of a file with its triangles, and what is searched in them. (750 bytes, two closed meshes of a million.)
const OF_A_VERTEX: u64 = 900;

/// A point that is trained on. (480 bytes, 200 key frames of 20,000.)
const OF_A_POINT: u64 = 600;

/// A weight with its gradients, the state of the optimiser and what a checkpoint is made from. (60 to 100 bytes.)
const OF_A_WEIGHT: u64 = 130;

/// Layers whose values a sample holds at a time, in both networks, with their derivatives: of end fields, and of one
/// network of position and time. (2 and 6.)
const LAYERS: [u64; 2] = [4, 10];

/// A node of the grid of splines. (80 to 120 bytes.)
const OF_A_NODE: u64 = 200;

/// Coefficients of a node: three for each of two functions of time.
const NODE_WEIGHTS: u64 = 6;

/// The greatest extent of what is covered by that grid, in normalised units.
const EXTENT: f64 = 2.5;

/// A cell of the grid of a surface, for each of the cells behind it, which are not held. (410 to 440 bytes.)
const OF_A_COLUMN: u64 = 600;

/// What a run takes at its peak, in bytes, and the keys that decide on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MemoryNeed {
    /// The program and the shapes: always.
    shapes: u64,
    /// Beside them while it trains.
    training: u64,
    /// Beside them while surfaces are found.
    surfaces: u64,
}

impl MemoryNeed {
    /// Of a recipe and the numbers of its shapes' vertices.
    pub(super) fn of(recipe: &Recipe, vertices: &[usize]) -> Self {
        let count = |number: usize| number as u64;
        let points = vertices.iter().map(|own| recipe.data.points.max(*own));
        let points: u64 = points.map(count).sum();
        let vertices: u64 = vertices.iter().copied().map(count).sum();
        let training = match spline::is_solved(recipe) {
            true => of_splines(recipe),
            false => of_networks(recipe),
        };
        let surfaces = match recipe.result.frames {
            0 => 0,
            _ => OF_A_COLUMN.saturating_mul(count(recipe.result.resolution).pow(2)),
        };
        Self {
            shapes: (OF_A_VERTEX.saturating_mul(vertices))
                .saturating_add(OF_A_POINT.saturating_mul(points))
                .saturating_add(PROGRAM),
            training,
            surfaces,
        }
    }

    /// All of it, in bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.shapes.saturating_add(self.training.max(self.surfaces))
    }

    /// Whether a run may begin that must not take more than `limit` bytes.
    ///
    /// # Errors
    /// What it takes, and what would make it less.
    pub(super) fn within(&self, limit: u64) -> Result<()> {
        if self.bytes() <= limit {
            return Ok(());
        }
        Err(Error::usage(format!(
            "this run takes up to {}, and {} are allowed: {} for the program and the shapes, {} more for training, {} \
             more for surfaces; lower data.points, training.batch, implicit.width or result.resolution, or allow more",
            Mebibytes(self.bytes()),
            Mebibytes(limit),
            Mebibytes(self.shapes),
            Mebibytes(self.training),
            Mebibytes(self.surfaces),
        )))
    }
}

/// What is said where a run takes more than was foreseen, and than is allowed.
pub(super) fn exceeded(peak: u64, limit: u64) -> String {
    format!(
        "training has taken {}, and {} are allowed: its newest checkpoint holds all steps so far; go on with a smaller \
         training.batch, or allow more",
        Mebibytes(peak),
        Mebibytes(limit)
    )
}

/// Bytes in words, rounded up.
struct Mebibytes(u64);

impl std::fmt::Display for Mebibytes {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{} MiB", self.0.div_ceil(MIB))
    }
}

fn of_splines(recipe: &Recipe) -> u64 {
    OF_A_NODE.saturating_mul(nodes(recipe))
}

/// Nodes of the grid of splines.
fn nodes(recipe: &Recipe) -> u64 {
    // A conversion that saturates.
    (EXTENT / spline::keys(recipe).spacing).powi(3) as u64
}

fn of_networks(recipe: &Recipe) -> u64 {
    let (f, v) = (&recipe.implicit, &recipe.velocity);
    let weights = |depth: usize, width: usize| depth as u64 * (width as u64).pow(2);
    let is_one = !method::has_end_fields(recipe);
    // One for each key frame, and as many columns of V's last layer.
    let keys = recipe.data.keyframes.len() as u64;
    let fields = if is_one { 1 } else { keys };
    let last = if keys > 2 { 3 * (keys + 1) } else { 0 };
    let motion = match method::starts_solved(recipe) {
        true => NODE_WEIGHTS * nodes(recipe),
        false => weights(v.depth, v.width) + last * v.width as u64,
    };
    let weights = fields * weights(f.depth, f.width) + motion;
    let layers = LAYERS[usize::from(is_one)];
    let sample = layers * size_of::<f32>() as u64 * (f.width + v.width) as u64;
    let samples = recipe.training.batch + recipe.training.correspondence_batch;
    (OF_A_WEIGHT.saturating_mul(weights)).saturating_add(sample.saturating_mul(samples as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn need(changes: &[&str], vertices: &[usize]) -> MemoryNeed {
        let mut recipe = Recipe::between("a.ply", "b.ply").expect("two paths");
        for change in changes {
            recipe.with(change).expect("a good change");
        }
        MemoryNeed::of(&recipe, vertices)
    }

    /// Peaks of whole runs on `data/fox`, in MiB; the last of the fox with 1.2 million vertices. Those of a trained spline
    /// are by an Intel Xeon, 2026-11-29.
    const PEAKS: [(&[&str], usize, u64); 11] = [
        (&["preset=instant", "result.resolution=384"], 5000, 214),
        (&["preset=instant", "result.resolution=768"], 5000, 412),
        (&["preset=instant", "data.points=200000"], 5000, 188),
        (&["preset=instant", "spline.spacing=0.03"], 5000, 185),
        (&["preset=quick"], 5000, 187),
        (
            &[
                "preset=quick",
                "velocity.kind=trained-spline",
                "training.guided-until=0.6",
            ],
            5000,
            163,
        ),
        (&["preset=default", "implicit.width=512"], 5000, 339),
        (&["preset=default", "training.batch=65536"], 5000, 310),
        (&["preset=paper"], 5000, 476),
        (&["preset=paper", "training.batch=65536"], 5000, 1618),
        (&["preset=instant", "result.resolution=64"], 1_179_650, 1919),
    ];

    #[test]
    fn what_was_measured_is_within_the_bound_and_not_far_below_it() {
        for (changes, vertices, peak) in PEAKS {
            let bound = need(changes, &[vertices, vertices]).bytes() / MIB;
            assert!(bound >= peak, "{changes:?}: {bound} for {peak}");
            // Large batches of small networks are the farthest off.
            assert!(bound <= 4 * peak, "{changes:?}: {bound} for {peak}");
        }
        // 200 clouds of 20,000 points.
        let bound = need(&["preset=instant"], &[20_000; 200]).bytes() / MIB;
        assert!((1925..4 * 1925).contains(&bound), "{bound}");
    }

    #[test]
    fn a_run_that_takes_more_is_refused_with_the_number_that_would_do() {
        let need = need(&["preset=paper"], &[5000, 5000]);
        let enough = need.bytes().div_ceil(MIB);
        need.within(enough * MIB).expect("as much as it takes");
        let refused = need.within(enough * MIB - MIB).expect_err("less");
        let said = refused.to_string();
        assert!(said.contains(&format!("up to {enough} MiB")), "{said}");
        assert!(said.contains("training.batch"), "{said}");
    }

    #[test]
    fn the_greatest_recipe_does_not_overflow() {
        let changes = [
            "implicit.width=4096",
            "implicit.depth=32",
            "training.batch=1000000",
            "result.resolution=2048",
        ];
        let need = need(&changes, &[usize::MAX, usize::MAX]);
        assert_eq!(need.bytes(), u64::MAX);
    }

    #[test]
    fn a_run_that_has_taken_more_than_was_foreseen_ends_with_a_checkpoint_and_can_go_on() {
        use crate::formats::Shape;
        use crate::{Backend, Session};
        let place = tempfile::tempdir().expect("a folder");
        let files = [0.0, 0.3].map(|by| {
            let path = place.path().join(format!("{by}.ply"));
            let sphere = crate::geometry::testing::bumpy_sphere(16);
            let moved = sphere.moved(|[x, y, z]| [x + by, y, z]);
            Shape::of(moved).write(&path).expect("a file");
            path
        });
        let mut recipe = Recipe::between(&files[0], &files[1]).expect("two files");
        for change in [
            "preset=quick",
            "training.steps=6",
            "training.log-every=2",
            "training.guided-until=0",
            "training.batch=100",
            "data.points=200",
            "implicit.width=8",
            "velocity.width=8",
            "result.frames=0",
        ] {
            recipe.with(change).expect("a good change");
        }
        let run = place.path().join("run");
        let mut session = Session::prepare(recipe, &run, Backend::Flex).expect("shapes");
        let limit = need_of(&session);
        // More than was foreseen: every page of it is written to.
        let held = vec![1_u8; limit as usize];
        let ended = session.within_memory(limit).train(|_| ());
        assert_eq!(held.iter().filter(|byte| **byte == 1).count(), held.len());
        let said = ended.err().expect("it takes too much").to_string();
        assert!(said.contains("are allowed"), "{said}");
        // Without a limit, from the first step that was reported on.
        session = Session::resume(&run, &[], Backend::Flex).expect("a checkpoint");
        let mut first = None;
        let on_event = |event: &crate::Event| {
            if let crate::Event::Started { first_step, .. } = event {
                first = Some(*first_step);
            }
        };
        session.train(on_event).expect("no limit");
        assert!(
            first.is_some_and(|step| (1..6).contains(&step)),
            "{first:?}"
        );
    }

    fn need_of(session: &crate::Session) -> u64 {
        MemoryNeed::of(session.recipe(), &session.sizes()).bytes()
    }
}
