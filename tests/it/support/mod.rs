//! What the tests share: shapes with known answers, their files, and the program itself.
//!
//! | file | what it holds |
//! |---|---|
//! | `mesh.rs` | spheres and bars, and the measures of a triangle mesh |
//! | `ply.rs` | PLY written and read, independently of the program |
//! | `workplace.rs` | a temporary folder in which the program runs, and how a command ended |
//! | `run.rs` | the folder of a run: checkpoints, metrics, frames |

pub mod mesh;
pub mod ply;
pub mod run;
pub mod workplace;
