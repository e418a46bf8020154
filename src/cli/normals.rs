//! `isomorph normals`: the normals of a point cloud as training would estimate them, to be looked at.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::Shape;
use isomorph::normals::{Estimate, estimate};
use serde::Serialize;

use super::{Failure, Result, print};

/// Estimate the normals of a point cloud, and write them with its points
///
/// The normals point out of the shape. Training does the same by itself where a cloud has no normals
/// (data.normals = "auto"), or for any cloud with data.normals = "estimate". Use this command to inspect the
/// normals before training. The vertices of a mesh are used as a cloud.
#[derive(Debug, Args)]
pub(super) struct NormalsArgs {
    /// Point cloud: PLY, OBJ, NPY, text and the like
    shape: PathBuf,

    /// Output file for points and normals, .ply or .obj
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: NormalsArgs) -> Result {
    let output = &args.output;
    let is = |format: &str| {
        let ending = output.extension();
        ending.is_some_and(|given| given.eq_ignore_ascii_case(format))
    };
    if !is("ply") && !is("obj") {
        let output = output.display();
        return Err(Failure::Usage(format!(
            "--output {output}: must end in .ply or .obj"
        )));
    }
    let found = estimate(&Shape::read(&args.shape)?);
    found.write(output)?;
    if !args.json {
        return print(&text(&found, output));
    }
    let report = Report {
        shape: &args.shape,
        output,
        estimate: &found,
    };
    print(&(serde_json::to_string(&report)? + "\n"))
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    shape: &'a Path,
    output: &'a Path,
    #[serde(flatten)]
    estimate: &'a Estimate,
}

/// What is printed for people.
fn text(found: &Estimate, output: &Path) -> String {
    // Writing to a string does not fail.
    let mut text = String::new();
    let percent = |share: f64| 100.0 * share;
    let _ = writeln!(
        text,
        "normals      {} estimated: {}",
        found.points,
        output.display()
    );
    let _ = writeln!(
        text,
        "outside      clear at {:.1} % of the points; the whole cloud contradicts {:.1} %",
        percent(found.clear),
        percent(found.contradicted)
    );
    if let Some(own) = &found.own {
        let _ = writeln!(
            text,
            "own normals  {:.2} % on the same side; median angle between the lines {:.1} degrees",
            percent(own.same_side),
            own.median_angle
        );
    }
    let _ = writeln!(text, "time         {:.1} s", found.seconds);
    text
}
