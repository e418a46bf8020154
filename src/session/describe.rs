//! What a shape, a sequence, a recipe or a run is, as text.

use std::fmt::Write;
use std::path::Path;

use isomorph_training::method::spline::{self, is_solved};
use isomorph_training::method::{self, spec_of};

use super::checkpoint::{self, Checkpoint, State};
use super::folder::RunFolder;
use crate::error::{Error, Result};
use crate::formats::{self, Sequence, Shape};
use crate::geometry::{EdgeSharing, Extent};
use crate::recipe::Recipe;
use crate::shape::{CleanOptions, NormalSource, wound_outwards};

/// Says what is at a path: a shape, a sequence (`.anime`), a recipe (`.toml`) or a run.
///
/// # Errors
/// What cannot be read, and why.
pub fn describe(path: &Path) -> Result<String> {
    std::fs::metadata(path)
        .map_err(|error| Error::failure(error).within(&path.display().to_string()))?;
    let extension = path.extension().and_then(|text| text.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        _ if path.is_dir() => run_info(path),
        "anime" => Ok(sequence_info(&Sequence::read(path)?)),
        "toml" => Ok(Recipe::read(path, &[])?.to_toml()),
        _ => shape_info(&formats::read(path)?),
    }
}

fn shape_info(shape: &Shape) -> Result<String> {
    let mut text = String::new();
    let kind = if shape.is_mesh() {
        "mesh"
    } else {
        "point cloud"
    };
    writeln!(text, "{}: {kind}", shape.path.display())?;
    writeln!(text, "vertices     {}", shape.mesh.vertices.len())?;
    writeln!(text, "triangles    {}", shape.mesh.triangles.len())?;
    let normals = if shape.mesh.normals.is_some() {
        "given"
    } else {
        "none"
    };
    writeln!(text, "normals      {normals}")?;
    let Extent { low, high } = Extent::of(shape.mesh.vertices.iter().copied());
    writeln!(text, "box          {low:?} to {high:?}")?;
    let cleaned = shape.clone().cleaned(&CleanOptions::default());
    let left_out = cleaned.mesh.vertices.len() != shape.mesh.vertices.len();
    let estimated = match (shape.is_mesh(), left_out) {
        (true, _) => "",
        (false, false) => " (estimated from the density)",
        (false, true) => " (estimated from the density of what is not left out)",
    };
    let area = digits(cleaned.area()?);
    writeln!(text, "area         {area}{estimated}")?;
    let mut notes = cleaned.notes.clone();
    if shape.is_mesh() {
        let sharing = EdgeSharing::of(&shape.mesh);
        let closed = if sharing.is_closed() { "yes" } else { "no" };
        writeln!(text, "closed       {closed}")?;
        if sharing.is_closed() {
            let volume = digits(shape.mesh.volume());
            writeln!(text, "volume       {volume}")?;
        }
        wound_outwards(shape, NormalSource::Auto, &mut notes);
    }
    for note in &notes {
        writeln!(text, "note         {note}")?;
    }
    Ok(text)
}

/// A number with six significant digits, whatever its size.
fn digits(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 || (1e-3..1e9).contains(&size) {
        let places = (5.0 - size.max(1e-300).log10().floor()).clamp(0.0, 9.0) as usize;
        return format!("{number:.places$}");
    }
    format!("{number:.5e}")
}

fn sequence_info(sequence: &Sequence) -> String {
    let vertices = sequence.frames.first().map_or(0, Vec::len);
    format!(
        "sequence: {} frames, {vertices} vertices, {} triangles\n",
        sequence.frames.len(),
        sequence.triangles.len()
    )
}

fn run_info(path: &Path) -> Result<String> {
    let run = RunFolder::open(path)?;
    let checkpoints = checkpoint::list(&run.checkpoints());
    let mut text = String::new();
    writeln!(text, "{}: run", path.display())?;
    let steps: Vec<String> = checkpoints
        .iter()
        .map(|(step, _)| step.to_string())
        .collect();
    if steps.is_empty() {
        writeln!(text, "checkpoints  none yet")?;
        return Ok(text);
    }
    writeln!(text, "checkpoints  at steps {}", steps.join(", "))?;
    let newest = Checkpoint::newest(&run.checkpoints())?;
    let (state, recipe) = (&newest.state, newest.recipe()?);
    writeln!(
        text,
        "steps        {} of {}",
        state.step, recipe.training.steps
    )?;
    writeln!(text, "seconds      {:.1}", state.seconds)?;
    writeln!(text, "backend      {}", state.backend)?;
    let spec = spec_of(&recipe);
    writeln!(text, "method       {}", spec.described())?;
    writeln!(text, "preset       {}", recipe.preset)?;
    writeln!(text, "source       {}", recipe.data.source().display())?;
    writeln!(text, "target       {}", recipe.data.target().display())?;
    key_frames(&mut text, state, &recipe)?;
    fields(&mut text, &recipe)?;
    let (centre, scale) = (state.normalisation.centre, state.normalisation.scale);
    writeln!(text, "normalised   (x - {centre:?}) * {scale}")?;
    if !state.placements.is_empty() {
        writeln!(
            text,
            "aligned      data.align = \"{}\": x lies in the first file; results lie where the files do",
            recipe.data.align
        )?;
    }
    Ok(text)
}

/// How many key frames there are, where there are more than two, and which were appended.
fn key_frames(text: &mut String, state: &State, recipe: &Recipe) -> std::fmt::Result {
    let times: Vec<f64> = recipe.data.keyframes.iter().map(|key| key.time).collect();
    if let [first, .., last] = times[..]
        && times.len() > 2
    {
        let count = times.len();
        writeln!(text, "key frames   {count}, at {first} to {last}")?;
        if let Some(grown) = state.grown {
            let (appended, step) = (count - grown.known.min(count), grown.step);
            writeln!(text, "appended     {appended} of them after step {step}")?;
        }
    }
    Ok(())
}

/// What `f` and `V` are.
fn fields(text: &mut String, recipe: &Recipe) -> std::fmt::Result {
    if is_solved(recipe) {
        writeln!(text, "f            the shapes themselves")?;
        writeln!(text, "V            {}", splines(recipe))?;
    } else if !spec_of(recipe).is_baseline {
        let (f, v) = (&recipe.implicit, &recipe.velocity);
        writeln!(
            text,
            "f            {} x {}, {}",
            f.depth, f.width, f.activation
        )?;
        let motion = match method::starts_solved(recipe) {
            true => splines(recipe),
            false => format!("{} x {}, {}", v.depth, v.width, v.activation),
        };
        writeln!(text, "V            {motion}")?;
    }
    Ok(())
}

fn splines(recipe: &Recipe) -> String {
    let spacing = spline::keys(recipe).spacing;
    format!("splines, in cells of {spacing}, normalised")
}
