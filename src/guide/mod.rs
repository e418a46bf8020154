//! The guide: how to use isomorph, how it works, and how to carry the work on.
//!
//! | chapter | what it is for |
//! |---|---|
//! | [`first_steps`] | from nothing to a first result, and what to look at |
//! | [`worked_jobs`] | three jobs from files to an animation, with commands, pictures and times |
//! | [`sequences`] | one motion through three shapes and more |
//! | [`many_runs`] | thousands of pairs: on one machine, and on a cluster with Slurm |
//! | [`shapes`] | files, normals, correspondences, coordinates |
//! | [`recipes`] | the settings of a run: presets, sections, the ten keys that people change |
//! | [`results`] | what a run leaves, how to measure it, and how good the method is |
//! | [`troubleshooting`] | from a symptom or a message to the key or command that helps |
//! | [`glossary`] | the words of the field and of this project |
//! | [`library`] | isomorph from your own Rust program |
//! | [`method`] | the equations, where each lives, and what each part is worth |
//! | [`design`] | decisions of the program, and what they rest on |
//! | [`performance`] | how long a step takes on a CPU and on a GPU |
//! | [`python`] | isomorph from Python: arrays in, arrays out |
//! | [`python_api`] | all functions of the package for Python |
//! | [`robustness`] | what was tried to break isomorph: files, kills, disks, numbers, drivers |
//! | [`carrying_on`] | for those who change isomorph: the map, worked examples, tests |
//!
//! The chapters are the Markdown files of this folder. `links.txt` comes before each of them and turns
//! links between chapters into links of this documentation: of two definitions of one name the first counts.

pub mod first_steps {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("first_steps.md")]
}

pub mod worked_jobs {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("worked_jobs.md")]
}

pub mod sequences {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("sequences.md")]
}

pub mod many_runs {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("many_runs.md")]
}

pub mod shapes {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("shapes.md")]
}

pub mod recipes {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("recipes.md")]
}

pub mod results {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("results.md")]
}

pub mod troubleshooting {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("troubleshooting.md")]
}

pub mod glossary {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("glossary.md")]
}

pub mod library {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("library.md")]
}

pub mod method {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("method.md")]
}

pub mod design {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("design.md")]
}

pub mod performance {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("performance.md")]
}

pub mod python {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("python.md")]
}

pub mod python_api {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("python_api.md")]
}

pub mod robustness {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("robustness.md")]
}

pub mod carrying_on {
    #![doc = include_str!("links.txt")]
    #![doc = include_str!("carrying_on.md")]
}
