//! The program end to end: every test runs the real binary in a temporary folder. `tests/README.md` says
//! how to run them.

#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]
#![allow(clippy::panic_in_result_fn, reason = "tests fail by panics")]

mod aligned;
mod appended;
mod backends;
mod bad_comparisons;
mod bad_methods;
mod bad_recipes;
mod bad_runs;
mod bad_shapes;
mod batches;
mod closed_forms;
mod comparison;
mod evaluation;
mod extraction;
mod failures;
mod front_door;
mod golden;
mod information;
mod interruption;
mod matching;
mod methods;
mod morphing;
mod normals;
mod old_runs;
mod outputs;
mod paper;
mod picking;
mod progress;
mod raw_scans;
mod resume;
mod samples;
mod sequences;
mod support;
mod viewing;
