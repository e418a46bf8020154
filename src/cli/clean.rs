//! `isomorph clean`: a raw scan without what is no part of its surface, to be looked at.

use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::{CleanOptions, Shape};
use serde_json::json;

use super::{Failure, Result, print};

/// Leave out of a scan what is no part of its surface: repeated, stray and misplaced points
///
/// Training does the same by itself (data.clean = "auto"). Use this command to inspect what is left out. Points
/// in one place, points that repeat another, stray points, and small parts far from the rest are left out of a
/// cloud; small pieces far from the rest are left out of a mesh.
#[derive(Debug, Args)]
pub(super) struct CleanArgs {
    /// Mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    shape: PathBuf,

    /// Output file, .ply or .obj, with positions, normals and faces
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,

    /// A point is astray if its neighbours are so many times as far as theirs are
    #[arg(long, value_name = "TIMES", default_value_t = CleanOptions::default().strays)]
    strays: f64,

    /// A part far from the rest is left out if it has less than this share of the points; 0 keeps all parts
    #[arg(long, value_name = "SHARE", default_value_t = CleanOptions::default().part)]
    part: f64,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: CleanArgs) -> Result {
    let refused = |name: &str, value: f64, allowed: &str| {
        Err(Failure::Usage(format!(
            "--{name} {value}: must be {allowed}"
        )))
    };
    if !(args.strays > 1.0 && args.strays.is_finite()) {
        return refused("strays", args.strays, "more than 1");
    }
    if !(0.0..=1.0).contains(&args.part) {
        return refused("part", args.part, "0 to 1");
    }
    let options = CleanOptions {
        strays: args.strays,
        part: args.part,
    };
    let shape = Shape::read(&args.shape)?;
    let before = counts(&shape);
    let cleaned = shape.cleaned(&options);
    // Vertices that no triangle uses would still stretch the box of the file.
    Shape::of(cleaned.mesh.only_used()).write(&args.output)?;
    let after = counts(&cleaned);
    if args.json {
        let report = json!({
            "shape": args.shape,
            "output": args.output,
            "vertices": [before[0], after[0]],
            "triangles": [before[1], after[1]],
            "notes": cleaned.notes,
        });
        return print(&format!("{report}\n"));
    }
    print(&text(&cleaned, [before, after], &args.output))
}

/// Vertices and triangles.
fn counts(shape: &Shape) -> [usize; 2] {
    [shape.mesh.vertices.len(), shape.mesh.triangles.len()]
}

/// What is printed for people.
fn text(cleaned: &Shape, [before, after]: [[usize; 2]; 2], output: &Path) -> String {
    let mut text = format!("{}: {} of {} points", output.display(), after[0], before[0]);
    if before[1] > 0 {
        text += &format!(", {} of {} triangles", after[1], before[1]);
    }
    text += "\n";
    for note in &cleaned.notes {
        text += &format!("note: {note}\n");
    }
    if cleaned.notes.is_empty() {
        text += "nothing was left out\n";
    }
    text
}
