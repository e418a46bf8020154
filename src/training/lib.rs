//! Training: what a recipe says, the samples of a step, the methods and what a step of each minimises.
//!
//! All of it is generic over the burn backend and compiled once for each in a package of its own
//! (`flex/`, `ndarray/`, `wgpu/`), behind a border without type parameters: an [`engine::Engine`] gives a
//! [`engine::Trainer`], and that gives a [`deformation::Deformation`]. What stands above the border is not
//! compiled again when a backend changes, and no backend is compiled again when that changes.
//!
//! | file | what it holds |
//! |---|---|
//! | `recipe/` | the TOML file that decides a run, typed, checked and printed back |
//! | `data.rs` | key frames as points: what methods draw their samples from |
//! | `samples.rs` | the samples of a step, on the host, and their equal parts |
//! | `turns.rs` | which interval of many a step is made in |
//! | `hollows.rs` | where a surface encloses space that is not inside |
//! | `guided.rs` | what V learns from a field that is there already |
//! | `method/` | what is trained: the default method and those that it is compared with, one file each |
//! | `settings.rs` | the recipe in the model's types |
//! | `schedule.rs` | phases, ramp and learning rates by step |
//! | `motion.rs` | what a step needs of `V`: trajectories, matching, regularisers |
//! | `flow_step.rs` | the objective of a step with end fields that the flow carries |
//! | `network_step.rs` | the same with `f(x, t)` in one network |
//! | `posed.rs` | the objective of a part, its terms and its gradients |
//! | `optimiser.rs` | Adam with a limited gradient |
//! | `weights.rs` | networks as plain arrays, for other programs |
//! | `records.rs` | networks and optimiser states as bytes |
//! | `alike.rs` | whether such bytes are of the recipe's network |
//! | `engine.rs` | the border to training: a backend without its type |
//! | `probe.rs` | the operations of a run in small, to compare a device with another |
//! | `deformation.rs` | the border to what was trained: values and motion of points on the host |
//! | `key_times.rs` | which interval between key frames a time lies in |
//! | `in_turns.rs` | the same through many key frames: what there is from each to the next |
//! | `report.rs` | phases and terms, as they are reported |
//! | `flop.rs` | what a step costs |
//! | `spheres.rs` | key frames that need no file: for measuring and testing |
//! | `workers.rs`, `tensors.rs` | cores, and tensors from and to the host |
//!
//! Nothing here knows a file, a clock or a terminal.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

mod alike;
pub mod data;
pub mod deformation;
pub mod engine;
pub mod flop;
mod flow_step;
pub mod guided;
mod hollows;
pub mod in_turns;
pub mod key_times;
pub mod method;
mod motion;
mod network_step;
mod optimiser;
mod posed;
pub mod probe;
pub mod recipe;
pub mod records;
pub mod report;
pub mod samples;
pub mod schedule;
pub mod settings;
mod spheres;
mod tensors;
mod turns;
pub mod weights;
mod workers;

#[cfg(test)]
mod tests;
