//! A field of splines (`velocity.kind = "spline"`): V is found by Gauss-Newton, and what it carries are the
//! signed distances of the shapes themselves. Nothing is trained, and no backend takes part.
//!
//! The mathematics is in the package `isomorph-spline`. What turns shapes into its problem, and its field into
//! surfaces, is the library's.

use super::spec::{Acts, Keys, MethodSpec, Needs};
use super::spec_of;
use crate::recipe::rule::Rule;
use crate::recipe::schema::section;
use crate::recipe::{Motion, Recipe, VelocityKind};

/// The most steps: Gauss-Newton has converged long before. Each time that key frames are appended, its steps are added.
pub(crate) const MOST_STEPS: usize = 500;

/// Splines.
pub(super) static SPLINE: MethodSpec = MethodSpec {
    name: "velocity-field",
    geometry: None,
    velocity: Some(VelocityKind::Spline),
    about: "the shapes themselves, carried by a field V of splines that is solved for",
    citation: "the objective of the default method; the solver is ours",
    needs: Needs::NOTHING,
    is_baseline: false,
    acts: Acts {
        implicit: Keys::None,
        velocity: Keys::Only(&["kind", "time-dependent"]),
        loss: Keys::Only(&["matching", "on-surface", "strain", "divergence", "screw"]),
        training: Keys::Only(&[
            "steps",
            "correspondence-batch",
            "time-steps",
            "band-widths",
            "box-margin",
            "seed",
            "log-every",
        ]),
    },
    own: Some(<SplineKeys as crate::recipe::schema::Keyed>::SECTION),
    fixed: &[
        (
            "training.steps",
            "the levels of the grid are a share of the steps",
        ),
        ("spline.spacing", "a field keeps its grid"),
        ("spline.coarse-shares", "a field keeps its grid"),
        ("spline.motion", "one field, or several"),
        ("spline.sheet-thickness", "a field keeps its shapes"),
    ],
    // Presets of networks have far more steps.
    changes: &["training.steps=18"],
    // The mean interval is the unit of time of these weights.
    takes_many: true,
    many: &[
        "loss.strain=1.0",
        "loss.divergence=1.0",
        "loss.screw=10.0",
        "training.steps=10",
        "training.time-steps=1",
        "training.band-widths=[0.005, 0.02]",
        "spline.spacing=0.07",
        "spline.coarse-shares=[0.5]",
        "spline.band=4000",
    ],
    steps_of_interval: None,
};

section! {
    /// The grid and the solver of velocity.kind = "spline".
    spline: SplineKeys {
        /// Edge of a cell of the grid. Finer cells follow finer motion; time grows with the number of
        /// cells that the shape passes through.
        spacing: f64 = 0.05 | 0.05 | 0.05 | 0.05 | 0.05,
            Rule::number(0.01, 1.0).unit("normalised units");
        /// Levels of coarser cells that come first, each of half the edge of the one before. A number is
        /// the share of the steps still left that its level takes.
        coarse_shares: Vec<f64> = [0.45, 0.4] | [0.45, 0.4] | [0.45, 0.4] | [0.45, 0.4] | [0.45, 0.4],
            Rule::list(0.0, 0.9);
        /// The motion through more than two key frames. "smooth": one field through all of them, whose speed has no
        /// jump. "pairs": from each to the next by itself, for cuts and comparisons.
        motion: Motion = "smooth" | "smooth" | "smooth" | "smooth" | "smooth",
            Rule::word(Motion::WORDS);
        /// Thickness of an open sheet, such as cloth, which encloses nothing: its surface is as far as half of that from the
        /// sheet.
        sheet_thickness: f64 = 0.02 | 0.02 | 0.02 | 0.02 | 0.02,
            Rule::number(0.0, 0.5).unit("normalised units").zero("closes sheets behind them by a cushion");
        /// Samples of the space around the moving surface in each step, where the regularisers act.
        band: usize = 24_000 | 24_000 | 24_000 | 24_000 | 24_000, Rule::whole(100, 10_000_000);
        /// Points of each surface in each step that must arrive on the other one. Where no pairs are given through many key
        /// frames there are up to twelve times as many, as the surfaces alone decide.
        surface_samples: usize = 300 | 300 | 300 | 300 | 300, Rule::whole(1, 1_000_000);
        /// Distance below which a residual counts as a square, not as a distance.
        robust: f64 = 0.003 | 0.003 | 0.003 | 0.003 | 0.003,
            Rule::above_zero(1.0).unit("normalised units");
        /// Most iterations of conjugate gradients in a step.
        iterations: usize = 80 | 80 | 80 | 80 | 80, Rule::whole(1, 10_000);
        /// Where these iterations stop, as a share of the first residual.
        tolerance: f64 = 0.03 | 0.03 | 0.03 | 0.03 | 0.03, Rule::above_zero(1.0);
    }
}

/// Whether the recipe's method is solved for, on the processor, instead of trained on a backend.
pub fn is_solved(recipe: &Recipe) -> bool {
    *spec_of(recipe) == SPLINE
}

/// The keys of the spline of a recipe whose method [`is_solved`].
///
/// # Panics
/// If it is another.
pub fn keys(recipe: &Recipe) -> SplineKeys {
    recipe.keys_of()
}
