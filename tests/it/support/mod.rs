//! What the tests share: shapes with known answers, their files, and the program itself.
//!
//! | file | what it holds |
//! |---|---|
//! | `command.rs` | a command of many words as its arguments |
//! | `mesh.rs` | spheres and bars, and the measures of a triangle mesh |
//! | `ply.rs` | PLY written and read, independently of the program |
//! | `workplace.rs` | a temporary folder in which the program runs, and how a command ended |
//! | `sequence.rs` | frames of a mesh that moves, as a folder of meshes and as `.anime` |
//! | `run.rs` | the folder of a run: checkpoints, metrics, frames |

pub(crate) mod command;
pub(crate) mod mesh;
pub(crate) mod ply;
pub(crate) mod run;
pub(crate) mod sequence;
pub(crate) mod workplace;
