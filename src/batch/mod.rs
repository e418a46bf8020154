//! Many runs: a file of jobs, worked through on this machine or on a cluster.
//!
//! | file | what it does |
//! |---|---|
//! | `jobs.rs` | reads the file: pairs, sequences, all pairs of some files, each with the next |
//! | `run.rs` | works through the jobs, each in a process of its own, some at a time |
//! | `machine.rs` | cores, memory, and how many jobs at a time they hold |
//! | `table.rs` | where all jobs stand, and what the rest will take |
//! | `collect.rs` | the figures of all runs as CSV, JSON, Parquet and a page |
//! | `figures.rs` | a row of them, and rows as files |
//! | `slurm.rs` | the script of a Slurm job array |
//!
//! Nothing about a job is kept but its run folder, and for one that could not even begin, a line in `errors/`. So a
//! batch may be stopped, killed, extended and started again, on any number of machines that share the folder.

mod collect;
mod figures;
mod jobs;
mod machine;
mod run;
mod slurm;
mod table;

pub use collect::{Collected, collect};
pub use jobs::{Batch, Job};
pub use machine::{at_a_time, cores};
pub use run::{Ended, RunBatch, Share, Told, run, run_one};
pub use slurm::{Slurm, slurm_script};
pub use table::{Estimate, JobStatus, estimate, statuses};
