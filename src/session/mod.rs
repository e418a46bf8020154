//! What a program does with a run: train it, go on with it, open it, extract and measure it. Front ends use
//! these and hold no more than words.
//!
//! | file | what it holds |
//! |---|---|
//! | `train.rs`, `train/begun.rs` | [`Session`]: a run from its recipe, or from its newest checkpoint |
//! | `trained.rs` | [`Trained`]: a run that is opened, and what can be asked of it |
//! | `against_input.rs` | the surfaces at the ends held against the shapes that were given |
//! | `extract.rs` | the surfaces of a run as files, with a picture of them |
//! | `report.rs`, `report_data.rs`, `report_log.rs`, `report_truth.rs` | the page of a run, `report.html` |
//! | `warp.rs`, `dense_map.rs` | the motion put to use: points of any file, and a map from vertices to vertices |
//! | `sampled_field.rs`, `export.rs` | `f` and `V` for other programs: on a grid, and as networks |
//! | `evaluate.rs`, `measure.rs` | a run held against the true frames between its key frames |
//! | `compare.rs`, `compared.rs` | methods side by side on pairs of frames |
//! | `pairs.rs`, `normals.rs` | correspondences and normals found from shapes alone |
//! | `morph.rs`, `morph_size.rs` | a recipe for two files, what it assumes, and what speaks against the result |
//! | `bench.rs`, `bench_run.rs` | what a step and what a whole run costs on this machine |
//! | `describe.rs` | what a file or a run is |
//! | `prepare.rs` | the shapes of a recipe made ready |
//! | `memory_need.rs` | how much memory a run takes |
//! | `learner.rs`, `learner/` | the loop that trains a method |
//! | `not_finite.rs` | where a method in training has no number |
//! | `grown.rs` | runs to which key frames were appended |
//! | `learned.rs` | from a method or a checkpoint to surfaces and motion |
//! | `folder.rs`, `lock.rs`, `checkpoint.rs` | the folder of a run, for one process, and whole checkpoints or none |
//! | `self_test.rs` | a device held against a processor before it trains |
//! | `log.rs`, `metrics.rs` | what a run leaves in writing: `run.log`, `metrics.jsonl` |
//! | `stop.rs` | a flag that ends the work early |

mod against_input;
mod align;
pub(crate) mod bench;
pub(crate) mod bench_run;
mod chain;
pub(crate) mod checkpoint;
mod clock;
pub(crate) mod compare;
mod compared;
pub(crate) mod dense_map;
pub(crate) mod describe;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod extract;
pub(crate) mod folder;
pub(crate) mod grown;
mod learned;
pub(crate) mod learner;
mod lock;
mod log;
mod measure;
mod memory_need;
pub(crate) mod metrics;
pub(crate) mod morph;
mod morph_size;
pub(crate) mod normals;
mod not_finite;
pub(crate) mod pace;
pub(crate) mod pairs;
mod prepare;
pub(crate) mod report;
mod report_data;
mod report_log;
mod report_truth;
pub(crate) mod sampled_field;
pub(crate) mod self_test;
pub(crate) mod state;
pub(crate) mod stop;
pub(crate) mod train;
pub(crate) mod trained;
pub(crate) mod warp;

pub use train::Session;
pub use trained::Trained;
