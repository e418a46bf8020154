//! All times in one file: `surface.glb`, the surfaces in turn, and `carried.glb`, the source that moves.

use std::path::Path;

use super::error::FramesError;
use crate::atomic::write_atomically;
use crate::formats::{Appearance, Shape};
use crate::gltf::{self, Morphing, Precision, Still};

/// The file of the surfaces.
pub(super) const SURFACE: &str = "surface.glb";

/// The file of the source that moves.
pub(super) const CARRIED: &str = "carried.glb";

/// Whether a folder has the file of the surfaces, and that of the source.
pub(crate) fn animations_in(folder: &Path) -> [bool; 2] {
    [SURFACE, CARRIED].map(|file| folder.join(file).is_file())
}

/// Writes the surfaces, in the order of their times.
///
/// # Errors
/// What the file system says, or a file that would be too large.
pub(super) fn write_surfaces(
    mut stills: Vec<Still>,
    precision: Precision,
    folder: &Path,
) -> Result<(), FramesError> {
    stills.sort_by(|a, b| a.second.total_cmp(&b.second));
    // A timeline has each moment once.
    stills.dedup_by_key(|still| still.second);
    let file = gltf::in_turn(&stills, precision)?;
    Ok(write_atomically(&folder.join(SURFACE), |out| {
        out.write_all(&file)
    })?)
}

/// Writes a shape whose vertices are at `path` at each of `moments`, times and the seconds of the animation in
/// ascending order, with its colours, texture coordinates, groups and materials.
///
/// # Errors
/// What the file system says, or a file that would be too large.
pub(super) fn write_carried(
    shape: &Shape,
    moments: &[[f64; 2]],
    mut path: Vec<Vec<[f64; 3]>>,
    precision: Precision,
    folder: &Path,
) -> Result<(), FramesError> {
    let mut once = moments.to_vec();
    once.dedup_by_key(|moment| moment[1]);
    let mut repeated = moments.windows(2).map(|pair| pair[0][1] == pair[1][1]);
    let mut is_first = true;
    path.retain(|_| std::mem::take(&mut is_first) || !repeated.next().unwrap_or(false));
    let look = Appearance::read(shape)?;
    let name = shape.path.file_stem().unwrap_or_default().to_string_lossy();
    let file = gltf::morphing(&Morphing {
        name: &name,
        times: &once.iter().map(|moment| moment[0]).collect::<Vec<_>>(),
        seconds: &once.iter().map(|moment| moment[1]).collect::<Vec<_>>(),
        positions: &path,
        origin: &look.origin,
        parts: &look.parts,
        materials: &look.materials,
        colours: look.colours.as_deref(),
        texture: look.texture.as_deref(),
        precision,
    })?;
    Ok(write_atomically(&folder.join(CARRIED), |out| {
        out.write_all(&file)
    })?)
}
