//! `isomorph morph`: two files or more to an animation, without a recipe.

use std::path::{Path, PathBuf};

use clap::Args;
use isomorph::morph::{Doubt, MorphOptions, MorphWatch, plan_morph};
use isomorph::{OutputFormat, Precision, is_run};
use serde_json::{Value, json};

use super::new_run::NewRunArgs;
use super::{Failure, ProgressArgs, Result, print};

/// Turn one shape into another, or through several: an animation and a page to look at, from the files alone
///
/// No recipe is needed. Pairs of points are found, or taken from vertices of equal number where both files have
/// the same faces. What is assumed is printed first, and what speaks against the result last. The folder
/// receives report.html, meshes/carried.glb, meshes/surface.glb and recipe.toml, which repeats it all.
#[derive(Debug, Args)]
pub(super) struct MorphArgs {
    /// Shape at time 0, a mesh or point cloud: PLY, OBJ, STL, OFF, glTF, NPY or text
    source: PathBuf,

    /// Shape at time 1
    target: PathBuf,

    /// Further shapes, at the times 2, 3 and so on: the motion is smooth through all of them
    more: Vec<PathBuf>,

    /// Times of the shapes instead of 0, 1, 2: in any unit, ascending, such as 0,10,18
    #[arg(
        long,
        value_name = "A,B,C",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    times: Option<Vec<f64>>,

    /// Folder of the result [default: runs/FIRST-LAST]
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Pairs of points: a file with source_index,target_index on each line, same-vertices, match or none
    #[arg(long, value_name = "FILE")]
    pairs: Option<String>,

    /// Lay the shapes onto each other first, so that only the rest of the motion is learned: none, rigid, similarity
    /// or auto, which does what is clearly needed; the results lie where the files do
    #[arg(long, value_name = "HOW", default_value = "auto")]
    align: String,

    /// Values of all other keys: instant, quick, default, quality or paper [default: instant, and quick where
    /// instant fails]
    #[arg(long)]
    preset: Option<String>,

    /// Number of times in the animation, evenly from the first shape to the last
    #[arg(long, value_name = "N", default_value_t = 13, value_parser = clap::value_parser!(u32).range(2..=1000))]
    frames: u32,

    #[command(flatten)]
    new: NewRunArgs,
}

pub(super) fn run(args: MorphArgs) -> Result {
    let files: Vec<PathBuf> = [args.source, args.target]
        .into_iter()
        .chain(args.more)
        .collect();
    let last = &files[files.len() - 1];
    let folder = args.output.clone();
    let folder = folder.unwrap_or_else(|| default_folder(&files[0], last));
    if !args.new.force && is_run(&folder) {
        let folder = folder.display();
        return Err(Failure::Usage(format!(
            "{folder}: exists already; choose another with -o, or replace it with --force"
        )));
    }
    let plan_with = |preset: &str| {
        let options = MorphOptions {
            pairs: args.pairs.clone(),
            align: args.align.clone(),
            preset: preset.to_owned(),
            frames: args.frames as usize,
            times: args.times.clone(),
            changes: args.new.set.overrides.clone(),
        };
        plan_morph(&files, &options)
    };
    let plan = plan_with(args.preset.as_deref().unwrap_or("instant"))?;
    let progress = args.new.progress;
    if progress.is_for_people() {
        plan.assumed.iter().for_each(|text| eprintln!("{text}"));
    }
    if progress.json {
        print(&lines(plan.assumed.iter().map(assumed)))?;
    }
    if progress.json || progress.is_for_people() {
        warn(&plan.doubts, progress)?;
    }
    let mut watch = MorphWatch::default();
    let animated = OutputFormat::Animation(Precision::Full);
    let first = args.new.train(
        plan.recipe,
        &folder,
        |session| session.writing(animated, true),
        |event| watch.observe(event),
    );
    let page = match first {
        Err(Failure::Library(error)) if args.preset.is_none() && error.calls_for_networks() => {
            let finding = format!("the preset instant failed ({error})");
            let note = Doubt {
                finding,
                cure: "going on with the preset quick, which takes longer".to_owned(),
            };
            warn(&[note], progress)?;
            watch = MorphWatch::default();
            args.new.train(
                plan_with("quick")?.recipe,
                &folder,
                // What is there is what the first attempt left.
                |session| session.writing(animated, true).replacing(),
                |event| watch.observe(event),
            )?
        }
        other => other?,
    };
    let contradicted = watch.is_contradicted();
    let doubts = watch.doubts();
    warn(&doubts, progress)?;
    if !progress.json {
        let is_fine = doubts.is_empty() && plan.doubts.is_empty() && !contradicted;
        if is_fine && progress.is_for_people() {
            eprintln!("nothing speaks against the result: one look at the page is still worth it");
        }
        print(&written(&folder, page.as_deref()))?;
    }
    args.new.open(page.as_deref());
    Ok(())
}

/// Says doubts, and what to do about them.
fn warn(doubts: &[Doubt], progress: ProgressArgs) -> Result {
    if progress.json {
        return print(&lines(doubts.iter().map(doubtful)));
    }
    for Doubt { finding, cure } in doubts {
        eprintln!("doubtful: {finding}; {cure}");
    }
    Ok(())
}

/// An assumption as an event.
fn assumed(text: &String) -> Value {
    json!({"event": "assumed", "text": text})
}

/// A doubt as an event.
fn doubtful(doubt: &Doubt) -> Value {
    json!({"event": "doubtful", "finding": doubt.finding, "cure": doubt.cure})
}

/// Each value on a line.
fn lines(values: impl Iterator<Item = Value>) -> String {
    values.map(|value| format!("{value}\n")).collect()
}

/// The files that matter, each with what it is for.
fn written(folder: &Path, page: Option<&Path>) -> String {
    let meshes = folder.join("meshes");
    let named = [
        (page.map(Path::to_path_buf), "look at it in a browser"),
        (
            Some(meshes.join("carried.glb")),
            "your own vertices moving, for Blender and the web",
        ),
        (Some(meshes.join("surface.glb")), "the surfaces in turn"),
        (
            Some(folder.join("recipe.toml")),
            "repeats the training, with `isomorph train`",
        ),
    ];
    let lines = named
        .into_iter()
        .filter_map(|(path, what)| Some((path?, what)));
    let there = lines.filter(|(path, _)| path.is_file());
    there
        .map(|(path, what)| format!("{}  {what}\n", path.display()))
        .collect()
}

/// `runs/` and the names of both files: `scans/a.ply` and `b.ply` go to `runs/a-b`.
fn default_folder(source: &Path, target: &Path) -> PathBuf {
    let name = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    Path::new("runs").join(format!("{}-{}", name(source), name(target)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_named_after_both_files() {
        let folder = default_folder(Path::new("scans/a.ply"), Path::new("b.obj"));
        assert_eq!(folder, Path::new("runs/a-b"));
    }
}
