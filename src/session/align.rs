//! Shapes laid onto each other before anything is learned: `data.align`.
//!
//! Each shape is laid onto the one before it, which stays. What was done is undone in every result
//! ([`Coordinates`](crate::shape::Coordinates)).

use std::borrow::Cow;

use crate::error::Result;
use crate::event::significant;
use crate::geometry::Extent;
use crate::geometry::linear::{difference, length, mean, scaled};
use crate::geometry::similarity::{Similarity, angle_of};
use crate::matching::{RigidMotion, rigid_motion};
use crate::recipe::{self, Align, Recipe};
use crate::shape::{Correspondences, Shape, columns};

/// Sizes that differ by less than this factor may be one shape grown or shrunk: "auto" leaves them.
const SIZES: f64 = 3.0;

/// Factors between units in use: metres and centimetres or millimetres, inches and others.
const UNITS: [f64; 5] = [10.0, 25.4, 39.37, 100.0, 1000.0];

/// How near a factor must be to one of these, as a factor, to be taken for it.
const NEAR: f64 = 1.1;

/// Fewer pairs do not decide a motion.
const FEWEST_PAIRS: usize = 4;

/// A turn by less than so many degrees is left to the motion that is learned, by "auto".
const TURN: f64 = 20.0;

/// And so is a shift by less than this share of the shape's diagonal.
const SHIFT: f64 = 0.5;

/// And so is what leaves more than this share of the distances.
const CLEARLY: f64 = 0.6;

/// Shapes that lie on each other.
pub(super) struct Aligned<'a> {
    /// In the coordinates of the first.
    pub shapes: Cow<'a, [Shape]>,
    /// From these to those of each file; none where all lie as their files say.
    pub to_files: Vec<Similarity>,
    /// What was done, one sentence each.
    pub notes: Vec<String>,
}

/// Lays shapes onto each other as a recipe says.
///
/// # Errors
/// Pairs that cannot be read; shapes without a surface.
pub(super) fn aligned<'a>(recipe: &Recipe, shapes: &'a [Shape]) -> Result<Aligned<'a>> {
    let mut aligned = Aligned {
        shapes: Cow::Borrowed(shapes),
        to_files: Vec::new(),
        notes: Vec::new(),
    };
    if recipe.data.align == Align::None {
        return Ok(aligned);
    }
    let mut to_common = vec![Similarity::IDENTITY];
    for (k, two) in shapes.windows(2).enumerate() {
        let (source, target) = (&two[0], &two[1]);
        let pairs = places(recipe, k, source, target)?;
        let onto = onto(source, target, &pairs, recipe)?;
        let is_said = recipe.data.align != Align::Auto || onto != Similarity::IDENTITY;
        if is_said {
            aligned.notes.push(said([source, target], &onto, recipe));
        }
        let before = to_common[to_common.len() - 1];
        to_common.push(onto.then(&before));
    }
    if to_common.iter().any(|way| *way != Similarity::IDENTITY) {
        let moved = shapes.iter().zip(&to_common);
        aligned.shapes = moved.map(|(shape, way)| shape.laid_by(way)).collect();
        aligned.to_files = to_common.iter().map(Similarity::inverse).collect();
    }
    Ok(aligned)
}

/// What was done with the target, in a sentence.
fn said([source, target]: [&Shape; 2], onto: &Similarity, recipe: &Recipe) -> String {
    let (own, other) = (target.path.display(), source.path.display());
    let key = format!("data.align = \"{}\"", recipe.data.align);
    if *onto == Similarity::IDENTITY {
        return format!("{own} lies on {other} as it is ({key})");
    }
    let mut parts = Vec::new();
    if onto.scale != 1.0 {
        parts.push(format!("scaled by {}", significant(onto.scale)));
    }
    let angle = angle_of(&onto.rotation).to_degrees();
    if angle > 0.05 {
        parts.push(format!("turned by {angle:.1} degrees"));
    }
    let centre = mean(target.mesh.vertices.iter().copied());
    let shift = length(difference(onto.apply(centre), scaled(centre, onto.scale)));
    if shift > 0.0 {
        parts.push(format!("its centre shifted by {}", significant(shift)));
    }
    format!(
        "{own} is laid onto {other}: {} ({key}); results lie where the files do",
        parts.join(", ")
    )
}

/// Corresponding places of two files, of key frame `k` and the next, that are known before any search.
fn places(
    recipe: &Recipe,
    k: usize,
    source: &Shape,
    target: &Shape,
) -> Result<Vec<([f64; 3], [f64; 3])>> {
    let between = &recipe.data.between;
    let known = match &between[k] {
        recipe::Correspondences::File(path) => {
            Correspondences::read_between(path, k, columns(between, k), [source, target])?
        }
        recipe::Correspondences::SameVertices => Correspondences::same_vertices(source, target)?,
        recipe::Correspondences::Match | recipe::Correspondences::None => Correspondences::none(),
    };
    let place = |[from, to]: &[u32; 2]| {
        let to = target.mesh.vertices[*to as usize];
        (to, source.mesh.vertices[*from as usize])
    };
    Ok(known.pairs.iter().map(place).collect())
}

/// What lays the target onto the source; `pairs` are places of the target and of the source.
fn onto(
    source: &Shape,
    target: &Shape,
    pairs: &[([f64; 3], [f64; 3])],
    recipe: &Recipe,
) -> Result<Similarity> {
    let (align, seed) = (recipe.data.align, recipe.training.seed);
    let pairs = if pairs.len() < FEWEST_PAIRS {
        &[]
    } else {
        pairs
    };
    let scale = match align {
        Align::None | Align::Rigid => 1.0,
        Align::Similarity => size_ratio(source, target, pairs)?,
        Align::Auto => unit_ratio(size_ratio(source, target, pairs)?),
    };
    let sized = Similarity {
        scale,
        ..Similarity::IDENTITY
    };
    let is_free = align != Align::Auto;
    let motion = if pairs.is_empty() {
        rigid_motion(&target.laid_by(&sized), source, is_free, seed)?
    } else {
        let sized = pairs.iter().map(|(from, to)| (scaled(*from, scale), *to));
        fitted(&sized.collect::<Vec<_>>(), is_free)
    };
    let motion = Similarity {
        scale: 1.0,
        rotation: motion.rotation,
        translation: motion.translation,
    };
    if is_free || is_large(&motion, &sized, source, target) {
        return Ok(sized.then(&motion));
    }
    Ok(sized)
}

/// The rigid motion of pairs; none where not much is gained, unless it is taken in any case.
fn fitted(pairs: &[([f64; 3], [f64; 3])], is_free: bool) -> RigidMotion {
    let motion = RigidMotion::between(pairs);
    let off = |motion: &RigidMotion| -> f64 {
        let miss = |(from, to): &([f64; 3], [f64; 3])| {
            length(difference(motion.apply(*from), *to)).powi(2)
        };
        pairs.iter().map(miss).sum::<f64>().sqrt()
    };
    if is_free || off(&motion) < CLEARLY * off(&RigidMotion::IDENTITY) {
        return motion;
    }
    RigidMotion::IDENTITY
}

/// How many times as large the source is.
fn size_ratio(source: &Shape, target: &Shape, pairs: &[([f64; 3], [f64; 3])]) -> Result<f64> {
    let spread = |places: &dyn Fn(usize) -> [f64; 3]| {
        let all = (0..pairs.len()).map(places);
        let centre = mean(all.clone());
        all.map(|x| length(difference(x, centre)).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let ratio = spread(&|k| pairs[k].1) / spread(&|k| pairs[k].0);
    if !pairs.is_empty() && ratio.is_finite() && ratio > 0.0 {
        return Ok(ratio);
    }
    Ok((source.area()? / target.area()?).sqrt())
}

/// The factor that "auto" takes for a ratio of sizes: none where the shape may have grown, and that of the units where
/// one is near.
fn unit_ratio(ratio: f64) -> f64 {
    let factor = ratio.max(ratio.recip());
    if factor < SIZES {
        return 1.0;
    }
    let near = |unit: &f64| factor / unit < NEAR && unit / factor < NEAR;
    let factor = UNITS.into_iter().find(near).unwrap_or(factor);
    if ratio > 1.0 { factor } else { factor.recip() }
}

/// Whether a motion is one that "auto" takes out.
fn is_large(motion: &Similarity, sized: &Similarity, source: &Shape, target: &Shape) -> bool {
    let angle = angle_of(&motion.rotation);
    let centre = sized.apply(mean(target.mesh.vertices.iter().copied()));
    let shift = length(difference(motion.apply(centre), centre));
    let size = Extent::of_surface(&source.mesh).diagonal();
    angle.to_degrees() > TURN || shift > SHIFT * size
}

#[cfg(test)]
mod tests;
