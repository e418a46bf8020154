//! `isomorph normals`: the normals of a point cloud as training would estimate them, to be looked at.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::{Ending, Usage};
use crate::formats::{SurfaceFormat, write_surface};
use crate::geometry::Mesh;
use crate::shape::{self, Shape, estimate_normals};

/// Estimate the normals of a point cloud, all pointing out of the shape, and write them with it
///
/// For clouds without normals, or with doubtful ones. Training does the same by itself where a cloud has none
/// (data.normals = "auto", or "estimate" for any); this shows beforehand what it would learn from. Of a mesh
/// the vertices are taken as a cloud.
#[derive(Debug, Args)]
pub(super) struct NormalsArgs {
    /// The cloud: PLY or OBJ
    shape: PathBuf,

    /// Where to write the points with their normals: .ply or .obj
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,

    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Certainties from this on, up or down, are called clear.
const CLEAR: f64 = 0.25;

pub(super) fn run(args: NormalsArgs) -> Result<Ending> {
    let format = format_of(&args.output)?;
    let cloud = shape::read(&args.shape)?;
    let began = Instant::now();
    let found = estimate_normals(&cloud.mesh.vertices);
    let seconds = began.elapsed().as_secs_f64();
    let oriented = Mesh {
        vertices: cloud.mesh.vertices.clone(),
        triangles: Vec::new(),
        normals: Some(found.normals.clone()),
    };
    write_surface(&oriented, &args.output, format)?;
    let share = |is: fn(f64) -> bool| {
        let count = found.certainty.iter().filter(|&&x| is(x)).count();
        count as f64 / found.certainty.len() as f64
    };
    let report = Report {
        shape: &args.shape,
        output: &args.output,
        points: found.normals.len(),
        clear: share(|certainty| certainty >= CLEAR),
        contradicted: share(|certainty| certainty <= -CLEAR),
        own: against_own(&cloud, &found.normals),
        seconds,
    };
    if args.json {
        println!("{}", serde_json::to_string(&report)?);
    } else {
        print!("{}", report.text()?);
    }
    Ok(Ending::Done)
}

fn format_of(path: &Path) -> Result<SurfaceFormat, Usage> {
    let formats = [SurfaceFormat::Ply, SurfaceFormat::Obj];
    let fits = |format: &SurfaceFormat| {
        path.extension()
            .is_some_and(|given| given.eq_ignore_ascii_case(format.extension()))
    };
    formats.into_iter().find(fits).ok_or_else(|| {
        Usage(format!(
            "--output {}: must end in .ply or .obj",
            path.display()
        ))
    })
}

/// The estimate beside the normals that the file has.
#[derive(Serialize)]
struct AgainstOwn {
    /// Share of the points whose two normals lie less than 90 degrees apart.
    same_side: f64,
    /// Median angle between the two lines, degrees.
    median_angle: f64,
}

/// Nothing if the file has no normals, or none with a direction.
fn against_own(cloud: &Shape, estimated: &[[f32; 3]]) -> Option<AgainstOwn> {
    let own = cloud.mesh.normals.as_ref()?.iter().zip(estimated);
    let directed = own.filter(|(own, _)| **own != [0.0; 3]);
    let cosine = |(a, b): (&[f32; 3], &[f32; 3])| -> f64 {
        a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
    };
    let mut cosines: Vec<f64> = directed.map(cosine).collect();
    if cosines.is_empty() {
        return None;
    }
    let same = cosines.iter().filter(|&&cosine| cosine > 0.0).count();
    cosines.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let median = cosines[cosines.len() / 2].abs().min(1.0);
    Some(AgainstOwn {
        same_side: same as f64 / cosines.len() as f64,
        median_angle: median.acos().to_degrees(),
    })
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    shape: &'a Path,
    output: &'a Path,
    points: usize,
    /// Share of the points whose side the cloud as a whole clearly tells, and it is this one.
    clear: f64,
    /// Share of those of which it clearly tells the other side.
    contradicted: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    own: Option<AgainstOwn>,
    seconds: f64,
}

impl Report<'_> {
    /// What is printed for people.
    fn text(&self) -> Result<String, std::fmt::Error> {
        let mut text = String::new();
        let percent = |share: f64| 100.0 * share;
        writeln!(
            text,
            "normals      {} estimated: {}",
            self.points,
            self.output.display()
        )?;
        writeln!(
            text,
            "outside      clear at {:.1} % of the points, contradicted by the cloud as a whole at {:.1} %",
            percent(self.clear),
            percent(self.contradicted)
        )?;
        if let Some(own) = &self.own {
            writeln!(
                text,
                "own normals  {:.2} % on the same side, lines {:.1} degrees apart in the median",
                percent(own.same_side),
                own.median_angle
            )?;
        }
        writeln!(text, "time         {:.1} s", self.seconds)?;
        Ok(text)
    }
}
