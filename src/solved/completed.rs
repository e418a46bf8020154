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

/// For each of two key frames its points and those that complete it, or `None` where it is known: by a field that is
/// solved for already.
///
/// # Errors
/// If the surface cannot be found: the reason, as a part of a sentence.
pub(super) fn completed(
    field: &SplineField,
    recipe: &Recipe,
    keyframes: &Keyframes,
) -> Result<[Option<PointCloud>; 2], String> {
    let keys = &keyframes.keys;
    if keys.iter().all(encloses) {
        return Ok([None, None]);
    }
    let solid = |k: usize| SolidParts::of(&keys[k]).and_then(Solid::new);
    let (Some(source), Some(target)) = (solid(0), solid(1)) else {
        return Ok([None, None]);
    };
    let shapes = [Arc::new(source), Arc::new(target)];
    let seed = recipe.training.seed;
    let mut found = [0, 1].map(|k| thicken(&keys[k], k, &shapes[k], seed));
    let carried = CarriedShapes::new(field.clone(), shapes, false);
    let is_missing = |k: usize| {
        let [own, other] = [k, 1 - k].map(|k| &keys[k]);
        if own.sheet.is_some() {
            return false;
        }
        let some = some_of(&other.cloud.points, LOOKED_AT);
        let arrived = carried.carry(&some, other.time, own.time);
        share_beyond(&own.cloud.points, &own.border, &arrived) > LEAST_MISSING
    };
    let missing = [0, 1].map(is_missing);
    let learned = Learned {
        deformation: Box::new(carried),
        template: None,
        coordinates: keyframes.coordinates(),
        bounds: keyframes.bounds.padded(recipe.training.box_margin as f32),
    };
    let (low, high) = (learned.bounds.min, learned.bounds.max);
    let grid = Grid::new(low, high, CELLS).map_err(|error| error.to_string())?;
    for k in [0, 1].into_iter().filter(|k| missing[*k]) {
        let time = keys[k].time;
        let surface = learned.surface_at(&grid, time, PIECE, &mut |_| ());
        let surface = surface.map_err(|error| error.to_string())?;
        let normals = |points: &[[f32; 3]]| {
            let field = learned.deformation.field();
            let gradients = field.map(|field| field.gradients(points, time));
            gradients.into_iter().flatten().map(unit).collect()
        };
        found[k] = complete(&keys[k], k, &surface.mesh, normals, seed);
    }
    Ok(found)
}
