//! What the end fields of networks are fitted to where a shape encloses nothing. Of one that is known in part it is its
//! points, and beyond their border what the motion brings there of the other shape. Of an open sheet it is the surface
//! that its thickness gives it.
//!
//! Fitted to the points alone, an end field would close the shape flat along its border, and the surface would lose
//! what is missing on its way there.

use std::sync::Arc;

use isomorph_spline::SplineField;
use isomorph_training::deformation::PointMotion;

use super::carried::CarriedShapes;
use crate::cubes::Grid;
use crate::geometry::linear::unit;
use crate::recipe::Recipe;
use crate::shape::{
    Keyframe, Keyframes, LEAST_MISSING, PointCloud, Solid, SolidParts, complete, share_beyond,
    thicken,
};
use crate::surface::learned::{Learned, some_of};

/// Cells to a side of the grid on which the surface is found. What lies between its points is as far off as between
/// those of a cloud of 20,000.
const CELLS: usize = 128;

/// Pieces with less than this share of the area are none.
const PIECE: f64 = 0.01;

/// Points of the other shape that decide whether one is known in part.
const LOOKED_AT: usize = 2000;

/// Whether networks can be fitted to a key frame as it is.
pub(crate) fn encloses(key: &Keyframe) -> bool {
    key.border.is_empty() && key.sheet.is_none()
}

/// For each key frame its points and those that complete it, or `None` where it is known: by a field that is solved for
/// already, of which `field` gives the part from each key frame to the next. `parts` gives what the shapes are made of;
/// only key frames that are wanted are completed.
///
/// A shape that is known in part is completed once, from one of its neighbours, so that its surface is the same from
/// either side.
///
/// # Errors
/// If the surface cannot be found: the reason, as a part of a sentence.
pub(super) fn completed<const H: usize>(
    is_wanted: impl Fn(usize) -> bool,
    parts: impl Fn(usize) -> Option<SolidParts>,
    field: impl Fn(usize) -> SplineField<f32, H>,
    recipe: &Recipe,
    keyframes: &Keyframes,
) -> Result<Vec<Option<PointCloud>>, String> {
    let (keys, seed) = (&keyframes.keys, recipe.training.seed);
    let mut found = vec![None; keys.len()];
    // Arranging a shape takes long and much memory: those of the interval before are kept, if they are there.
    let mut last: [(usize, Option<Arc<Solid>>); 2] = Default::default();
    for k in (0..keys.len()).filter(|k| !encloses(&keys[*k]) && is_wanted(*k)) {
        let s = neighbour(keys, k).min(k);
        let solid = |k: usize| {
            let known = last
                .iter()
                .find(|(own, solid)| *own == k && solid.is_some());
            let made = || parts(k).and_then(Solid::new).map(Arc::new);
            known.map_or_else(made, |(_, solid)| solid.clone())
        };
        last = [s, s + 1].map(|k| (k, solid(k)));
        let [(_, Some(first)), (_, Some(second))] = &last else {
            continue;
        };
        let shapes = [first.clone(), second.clone()];
        found[k] = if keys[k].sheet.is_some() {
            thicken(&keys[k], k, &shapes[k - s], seed)
        } else {
            let carried = CarriedShapes::new(field(s), shapes, false);
            of_part(carried, [s, k], recipe, keyframes)?
        };
    }
    Ok(found)
}

/// Whether a key frame is known in part, and a neighbour is whole.
pub(super) fn has_whole_neighbour(keys: &[Keyframe], k: usize) -> bool {
    !keys[k].border.is_empty() && keys[k].sheet.is_none() && encloses(&keys[neighbour(keys, k)])
}

/// The neighbour that completes key frame `k`: one that is known itself, the next one if both are.
fn neighbour(keys: &[Keyframe], k: usize) -> usize {
    let beside = [Some(k + 1), k.checked_sub(1)].into_iter().flatten();
    let beside: Vec<usize> = beside.filter(|k| *k < keys.len()).collect();
    let known = beside.iter().find(|k| encloses(&keys[**k]));
    *known.unwrap_or(&beside[0])
}

/// The points of key frame `k` with those that complete it, by what is carried from key frame `s` to the next; `None`
/// if so little is missing that it counts as known.
fn of_part<const H: usize>(
    carried: CarriedShapes<H>,
    [s, k]: [usize; 2],
    recipe: &Recipe,
    keyframes: &Keyframes,
) -> Result<Option<PointCloud>, String> {
    let [own, other] = [k, 2 * s + 1 - k].map(|k| &keyframes.keys[k]);
    // Within the interval.
    let time = (k - s) as f64;
    let some = some_of(&other.cloud.points, LOOKED_AT);
    let arrived = carried.carry(&some, 1.0 - time, time);
    if share_beyond(&own.cloud.points, &own.border, &arrived) <= LEAST_MISSING {
        return Ok(None);
    }
    let learned = Learned {
        deformation: Box::new(carried),
        template: None,
        coordinates: keyframes.coordinates(),
        bounds: keyframes.bounds.padded(recipe.training.box_margin as f32),
    };
    let (low, high) = (learned.bounds.min, learned.bounds.max);
    let grid = Grid::new(low, high, CELLS).map_err(|error| error.to_string())?;
    let surface = learned.surface_at(&grid, time, PIECE, &mut |_| ());
    let surface = surface.map_err(|error| error.to_string())?;
    let normals = |points: &[[f32; 3]]| {
        let field = learned.deformation.field();
        let gradients = field.map(|field| field.gradients(points, time));
        gradients.into_iter().flatten().map(unit).collect()
    };
    Ok(complete(
        own,
        k,
        &surface.mesh,
        normals,
        recipe.training.seed,
    ))
}
