//! `isomorph match`: pairs of vertices of two shapes that belong together, found from the shapes
//! alone.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::{Ending, Usage};
use crate::atomic::write_atomically;
use crate::charts::{ChartError, Line, Panel, line_chart};
use crate::matching::{MatchOptions, Matching, Rigid, match_shapes};
use crate::shape;

/// Find which points of two shapes correspond, and write them as pairs
///
/// For two poses or states of one thing, as meshes or point clouds, complete or with parts missing.
/// The pairs can be given to a recipe as data.correspondences; data.correspondences = "match" has
/// training find them itself. Each pair is checked in both directions; how far points come back
/// from where they began that are carried to the other shape and back says how much to trust them.
#[derive(Debug, Args)]
pub(super) struct MatchArgs {
    /// The shape at time 0: PLY or OBJ, a mesh or a point cloud
    source: PathBuf,

    /// The shape at time 1
    target: PathBuf,

    /// Where to write source_index,target_index,confidence lines
    #[arg(long, short, value_name = "FILE", default_value = "pairs.csv")]
    output: PathBuf,

    /// Keep this many pairs at most, spread evenly over the source [default: all]
    #[arg(long, value_name = "N")]
    count: Option<usize>,

    /// Keep pairs of this confidence or more, 0 to 1
    #[arg(long, value_name = "C", default_value_t = MatchOptions::default().least_confidence)]
    confidence: f64,

    /// The shapes are in one frame already: look for no rigid motion between them
    #[arg(long)]
    aligned: bool,

    /// Points spread over each mesh, and the most that are taken of a cloud
    #[arg(long, value_name = "N", default_value_t = MatchOptions::default().points)]
    points: usize,

    /// Points that move on their own; more follow finer motion, in time that grows with the square
    #[arg(long, value_name = "N", default_value_t = MatchOptions::default().nodes)]
    nodes: usize,

    /// Names the points that are drawn
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,

    /// Also draw how far points come back from where they began, as SVG
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: MatchArgs) -> Result<Ending> {
    if let Some(path) = &args.picture
        && path
            .extension()
            .is_none_or(|extension| !extension.eq_ignore_ascii_case("svg"))
    {
        return Err(Usage(format!("--picture {}: must end in .svg", path.display())).into());
    }
    let options = MatchOptions {
        points: args.points,
        nodes: args.nodes,
        aligned: args.aligned,
        least_confidence: args.confidence,
        count: args.count,
        seed: args.seed,
    };
    let (source, target) = (shape::read(&args.source)?, shape::read(&args.target)?);
    let matching = match_shapes(&source, &target, &options)?;
    let figure = args
        .picture
        .as_ref()
        .map(|_| figure(&matching))
        .transpose()?;
    matching.write_csv(&args.output)?;
    if let (Some(path), Some(figure)) = (&args.picture, figure) {
        write_atomically(path, |out| out.write_all(figure.as_bytes()))?;
    }
    if args.json {
        let report = Report {
            source: &args.source,
            target: &args.target,
            output: &args.output,
            pairs: matching.pairs.len(),
            matching: &matching,
        };
        println!("{}", serde_json::to_string(&report)?);
    } else {
        print!("{}", text(&matching, &args)?);
    }
    Ok(Ending::Done)
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
fn text(found: &Matching, args: &MatchArgs) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let own = |length: f64| length / found.scale;
    let kept = match args.count {
        Some(count) if count <= found.pairs.len() => ", spread evenly",
        _ => "",
    };
    writeln!(
        text,
        "pairs        {} of {} mutual nearest neighbours (confidence {} or more{kept}): {}",
        found.pairs.len(),
        found.mutual,
        args.confidence,
        args.output.display()
    )?;
    let coverage = &found.coverage;
    writeln!(
        text,
        "coverage     {:.1} % of the source, {:.1} % of the target within {:.3} of a pair ({} normalised)",
        100.0 * coverage.source,
        100.0 * coverage.target,
        own(coverage.radius),
        coverage.radius
    )?;
    let ways = [
        ("cycle        from the source and back", &found.cycle.source),
        ("             from the target and back", &found.cycle.target),
    ];
    for (label, cycle) in ways {
        writeln!(
            text,
            "{label}: median {:.4}, 95 % {:.4} normalised ({:.4}, {:.4} in the shapes' unit)",
            cycle.median,
            cycle.quantile_95,
            own(cycle.median),
            own(cycle.quantile_95)
        )?;
    }
    writeln!(text, "rigid part   {}", rigid_text(&found.rigid))?;
    writeln!(text, "time         {:.1} s", found.seconds)?;
    Ok(text)
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

/// Places at which a distribution is drawn.
const PLACES: usize = 200;

/// The share of points that come back to within a distance, over the distance.
fn figure(found: &Matching) -> Result<String, ChartError> {
    let line = |label: &str, sorted: &[f64]| {
        let last = sorted.len() - 1;
        let place = |k: usize| {
            let share = k as f64 / PLACES as f64;
            [
                sorted[(share * last as f64).round() as usize],
                100.0 * share,
            ]
        };
        Line {
            label: label.to_owned(),
            points: (0..=PLACES).map(place).collect(),
            ..Line::default()
        }
    };
    let cycle = &found.cycle;
    let most = cycle.source.quantile_95.max(cycle.target.quantile_95);
    let panel = Panel {
        title: "share of points that come back to within a distance".to_owned(),
        x_label: "distance from where they began (normalised)".to_owned(),
        y_label: "points (%)".to_owned(),
        x_range: (most > 0.0).then_some([0.0, 1.5 * most]),
        lines: vec![
            line("source to target and back", &cycle.source.sorted),
            line("target to source and back", &cycle.target.sorted),
        ],
        ..Panel::default()
    };
    line_chart("Cycle consistency", &[panel])
}
