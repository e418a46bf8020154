//! `isomorph match`: pairs of vertices of two shapes that belong together, found from the shapes
//! alone.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::correspondence::{MatchOptions, Matching, Rigid, find, find_from};
use isomorph::{CleanOptions, Shape};
use serde::Serialize;

use super::{Failure, QuietArgs, Result, is_same_file, print};

/// Find pairs of corresponding points of two shapes
///
/// The shapes are two poses or states of one thing, as meshes or point clouds, complete or with missing
/// parts. Name the file of pairs in a recipe as data.correspondences. With data.correspondences = "match",
/// training finds the pairs itself. Pairs are checked in both directions. The round-trip error shows how
/// reliable they are. It is the distance of points from their start after they were moved to the other
/// shape and back.
#[derive(Debug, Args)]
pub(super) struct MatchArgs {
    /// Shape at time 0, a mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    source: PathBuf,

    /// Shape at time 1
    target: PathBuf,

    /// Output file with lines of source_index,target_index,confidence
    #[arg(long, short, value_name = "FILE", default_value = "pairs.csv")]
    output: PathBuf,

    /// Pairs that are known, such as those of `isomorph pick`: the search follows them, and they are kept
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,

    /// Keep at most this many pairs, spread evenly over the source [default: all]
    #[arg(long, value_name = "N")]
    count: Option<usize>,

    /// Smallest confidence of a pair that is kept, 0 to 1
    #[arg(long, value_name = "C", default_value_t = MatchOptions::default().least_confidence)]
    confidence: f64,

    /// Skip the search for a rigid motion, because the shapes are in the same coordinates already
    #[arg(long)]
    aligned: bool,

    /// Use all points as they are; else what is no part of a surface is left out, as `isomorph clean` does
    #[arg(long)]
    raw: bool,

    /// Points sampled on each mesh, and the largest number used from a cloud
    #[arg(long, value_name = "N", default_value_t = MatchOptions::default().points)]
    points: usize,

    /// Points that move independently; more follow finer motion, and time grows with the square of their
    /// number
    #[arg(long, value_name = "N", default_value_t = MatchOptions::default().nodes)]
    nodes: usize,

    /// Random seed for sampling
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Also draw the distribution of the round-trip error, as SVG
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    quiet: QuietArgs,
}

pub(super) fn run(args: MatchArgs) -> Result {
    if let Some(path) = &args.picture
        && path
            .extension()
            .is_none_or(|extension| !extension.eq_ignore_ascii_case("svg"))
    {
        let path = path.display();
        return Err(Failure::Usage(format!(
            "--picture {path}: must end in .svg"
        )));
    }
    let given = args.pairs.as_ref();
    if given.is_some_and(|given| is_same_file(given, &args.output)) {
        let path = args.output.display();
        return Err(Failure::Usage(format!(
            "{path}: holds the given pairs, which the result would replace; choose another file with -o"
        )));
    }
    let options = MatchOptions {
        points: args.points,
        nodes: args.nodes,
        aligned: args.aligned,
        least_confidence: args.confidence,
        count: args.count,
        seed: args.seed,
    };
    let [source, target] = [&args.source, &args.target].map(|path| -> Result<Shape> {
        let shape = Shape::read(path)?;
        let shape = if args.raw {
            shape
        } else {
            shape.cleaned(&CleanOptions::default())
        };
        if !args.quiet.quiet {
            shape
                .notes
                .iter()
                .for_each(|note| eprintln!("note: {note}"));
        }
        Ok(shape)
    });
    let (source, target) = (source?, target?);
    let mut terminal = args.quiet.terminal(&args.output);
    let show = |event: &isomorph::Event| terminal.show(event);
    let matching = match &args.pairs {
        Some(given) => find_from(&source, &target, given, &options, show)?,
        None => find(&source, &target, &options, show)?,
    };
    matching.write_pairs(&args.output)?;
    if let Some(path) = &args.picture {
        matching.write_picture(path)?;
    }
    if !args.json {
        return print(&text(&matching, &args));
    }
    let report = Report {
        source: &args.source,
        target: &args.target,
        output: &args.output,
        pairs: matching.pairs.len(),
        matching: &matching,
    };
    print(&(serde_json::to_string(&report)? + "\n"))
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    source: &'a Path,
    target: &'a Path,
    output: &'a Path,
    pairs: usize,
    #[serde(flatten)]
    matching: &'a Matching,
}

/// What is printed for people.
fn text(found: &Matching, args: &MatchArgs) -> String {
    // Writing to a string does not fail.
    let mut text = String::new();
    let own = |length: f64| length / found.scale;
    let kept = match args.count {
        Some(count) if count <= found.pairs.len() => ", spread evenly",
        _ => "",
    };
    let _ = writeln!(
        text,
        "pairs        {} of {} mutual nearest neighbours (confidence {} or more{kept}): {}",
        found.pairs.len(),
        found.mutual,
        args.confidence,
        args.output.display()
    );
    if found.given > 0 {
        let _ = writeln!(
            text,
            "given        {} of them, kept as they are",
            found.given
        );
    }
    let coverage = &found.coverage;
    let _ = writeln!(
        text,
        "coverage     {:.1} % of the source, {:.1} % of the target within {:.3} of a pair ({} normalised)",
        100.0 * coverage.source,
        100.0 * coverage.target,
        own(coverage.radius),
        coverage.radius
    );
    let ways = [
        ("cycle        from the source and back", &found.cycle.source),
        ("             from the target and back", &found.cycle.target),
    ];
    for (label, cycle) in ways {
        let _ = writeln!(
            text,
            "{label}: median {:.4}, 95 % {:.4} normalised ({:.4}, {:.4} in the shapes' unit)",
            cycle.median,
            cycle.quantile_95,
            own(cycle.median),
            own(cycle.quantile_95)
        );
    }
    let _ = writeln!(text, "rigid part   {}", rigid_text(&found.rigid));
    let _ = writeln!(text, "time         {:.1} s", found.seconds);
    text
}

fn rigid_text(rigid: &Rigid) -> String {
    if rigid.distance == rigid.distance_unmoved {
        return format!("none (surfaces {:.4} apart)", rigid.distance);
    }
    format!(
        "{:.1} degrees, then {:?} (surfaces {:.4} apart, {:.4} without it)",
        rigid.degrees, rigid.translation, rigid.distance, rigid.distance_unmoved
    )
}
