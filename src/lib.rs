//! isomorph learns a continuous deformation between 3D shapes: a time-varying signed distance field carried
//! by an explicit velocity field.
//!
//! ```no_run
//! use isomorph::{Backend, Recipe, Session};
//!
//! # fn main() -> Result<(), isomorph::Error> {
//! let recipe = Recipe::between("a.ply", "b.ply")?;
//! let mut session = Session::prepare(recipe, "runs/pair", Backend::Flex)?;
//! let trained = session.train(|event| println!("{event}"))?;
//! let half_way = trained.surface(0.5, 192)?;
//! println!("{} triangles", half_way.mesh.triangles.len());
//! # Ok(())
//! # }
//! ```
//!
//! | item | what it is |
//! |---|---|
//! | [`Recipe`] | all that decides a run, from a TOML file or made here |
//! | [`Shape`], [`Keyframes`] | meshes and point clouds; two or more of them made ready for training |
//! | [`Session`] | a run in training: prepared, trained, resumed, stopped |
//! | [`Trained`] | a run that is opened: surfaces, distances, velocities, carried points |
//! | [`Event`] | what is reported while work goes on; front ends show it |
//! | [`Backend`] | where networks are trained and evaluated, chosen by value |
//! | [`Error`] | one type for all that can go wrong; its [`ErrorKind`] decides the exit status |
//! | [`correspondence`], [`picking`], [`normals`], [`evaluation`], [`comparison`], [`benchmark`] | pairs found or picked, normals found; runs, methods and machines measured |
//! | [`guide`] | the guide: first steps, recipes, results, method, design |
//!
//! The command line is one front end of this library and uses nothing else.

pub mod event;
pub mod guide;

mod atomic;
mod backend;
pub mod batch;
mod charts;
mod compare;
mod cubes;
mod error;
mod evaluate;
mod formats;
mod geometry;
mod gltf;
mod kinds;
mod landmarks;
mod matching;
mod memory;
mod picture;
mod processor;
mod session;
mod shape;
mod solved;
mod surface;
mod viewer;

pub use backend::Backend;
pub use error::{Error, ErrorKind, Result};
pub use event::Event;
pub use formats::{Shape, SurfaceFormat};
pub use geometry::{Mesh, Scalar};
pub use gltf::Precision;
pub use isomorph_training::recipe;
pub use recipe::Recipe;
pub use session::dense_map::{DenseMap, MappedVertex};
pub use session::describe::describe;
pub use session::export::{Exported, export};
pub use session::extract::{ExtractOptions, even_times};
pub use session::folder::is_run;
pub use session::grown::Appended;
pub use session::pace::Ease;
pub use session::report::current_report;
pub use session::sampled_field::FieldGrid;
pub use session::stop::StopFlag;
pub use session::trained::{Distances, Surface};
pub use session::warp::Warped;
pub use session::{Session, Trained};
pub use shape::{CleanOptions, Keyframe, Keyframes, PointCloud};
pub use surface::frames::OutputFormat;

/// What a run logs of its steps: `metrics.jsonl`, written and read.
pub mod metrics {
    pub use crate::session::metrics::{Metrics, TermMetrics};
}

/// Two files to an animation: a recipe chosen for them, and doubts about the result in words.
pub mod morph {
    pub use crate::session::morph::{Doubt, MorphOptions, MorphPlan, MorphWatch, plan_morph};
}

/// Corresponding vertices of two shapes, found from the shapes alone.
pub mod correspondence {
    pub use crate::matching::{
        Coverage, Cycle, MatchOptions, MatchedPair, Matching, Quantiles, Rigid,
    };
    pub use crate::session::pairs::{find, find_from, known_pairs};
}

/// Corresponding vertices of two shapes, picked by hand on a page in the browser.
pub mod picking {
    pub use crate::landmarks::{Picker, Served};
}

/// Where runs stand.
pub mod status {
    pub use crate::session::state::{RunState, RunStatus, run_status};
}

/// Normals of a raw point cloud, all pointing out of the shape.
pub mod normals {
    pub use crate::session::normals::{AgainstOwn, Estimate, estimate};
}

/// Runs held against true frames.
pub mod evaluation {
    pub use crate::evaluate::{
        Compared, Drift, Evaluation, FrameResult, GroundTruth, KeysEvaluation, Metrics,
    };
    pub use crate::session::evaluate::EvaluateOptions;
}

/// Methods side by side on pairs of frames.
pub mod comparison {
    pub use crate::compare::{Comparison, command_line, table};
    pub use crate::session::compare::{CompareOptions, compare, known};
}

/// What a training step and a whole run cost on this machine, and whether its GPU computes right numbers.
pub mod benchmark {
    pub use crate::session::bench::{
        BenchOptions, Measured, PhaseCost, Phases, Size, bench, unused,
    };
    pub use crate::session::bench_run::{BenchRun, Cost, Job, MeasuredRun, StageCost, bench_run};
    pub use crate::session::self_test::{Checked, SelfTest, self_test};
}
