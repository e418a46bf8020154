//! The program end to end: every test runs the real binary in a temporary folder. `tests/README.md` says
//! how to run them.

mod backends;
mod bad_comparisons;
mod bad_recipes;
mod bad_runs;
mod bad_shapes;
mod closed_forms;
mod comparison;
mod evaluation;
mod extraction;
mod golden;
mod information;
mod matching;
mod methods;
mod normals;
mod outputs;
mod paper;
mod resume;
mod support;
