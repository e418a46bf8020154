//! Layers beside a surface: where the distance field has other values than 0.

use serde::{Deserialize, Serialize};

use super::error::FramesError;
use super::frames::{FrameOptions, OutputFormat};
use super::learned::Learned;
use crate::cubes::Grid;
use crate::formats::write_surface;

/// A layer of an entry of `frames.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LayerEntry {
    /// Its distance from the surface, in the user's unit, negative inside.
    pub offset: f64,
    /// Its file, relative to `frames.json`.
    pub surface: String,
}

/// Writes the layers of the `k`-th time; there are none in an animation.
///
/// # Errors
/// Those of [`Learned::layer_at`], and a file that cannot be written.
pub(super) fn write_layers(
    learned: &Learned,
    options: &FrameOptions,
    grid: &Grid,
    k: usize,
) -> Result<Vec<LayerEntry>, FramesError> {
    let OutputFormat::Frames(format) = options.format else {
        return Ok(Vec::new());
    };
    let time = options.times[k];
    let write = |(number, &offset): (usize, &f64)| {
        let mesh = learned.layer_at(grid, time, offset, options.smallest_component)?;
        let surface = format!("layer-{k:03}-{number}.{}", format.extension());
        let (normals, _) = learned.normals(&mesh, time);
        let place = learned.coordinates.at(time);
        let mut placed = mesh.moved(|x| place.invert(x));
        placed.normals = Some(place.invert_normals(normals));
        write_surface(&placed, &options.folder.join(&surface), format)?;
        Ok(LayerEntry { offset, surface })
    };
    options.layers.iter().enumerate().map(write).collect()
}
