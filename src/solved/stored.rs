//! The part of a checkpoint that a solved field has: `velocity.mpk`, the field, and `ends.mpk`, the shapes that
//! it carries. Both in MessagePack, like the records of networks.

use std::io;

use isomorph_spline::{Grid, SplineError, SplineField, TimeBasis};
use isomorph_training::records::{RecordError, Records};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::shape::{Solid, SolidParts};

const FIELD: &str = "velocity.mpk";
const ENDS: &str = "ends.mpk";

#[derive(Serialize, Deserialize)]
struct StoredField {
    /// Steps done.
    step: usize,
    lower: [f32; 3],
    spacing: f32,
    cells: [u32; 3],
    coefficients: Vec<f32>,
}

/// The field, the steps that it took, and the shapes as files.
pub(super) fn records(
    field: &SplineField,
    step: usize,
    shapes: &[Solid; 2],
) -> io::Result<Records> {
    let Grid {
        lower,
        spacing,
        cells,
    } = *field.grid();
    let stored = StoredField {
        step,
        lower,
        spacing,
        cells,
        coefficients: field.coefficients(),
    };
    let ends = shapes.each_ref().map(Solid::parts);
    let packed = |file: &str, bytes: Result<Vec<u8>, rmp_serde::encode::Error>| {
        Ok::<_, io::Error>((file.to_owned(), bytes.map_err(io::Error::other)?))
    };
    Ok(Records(vec![
        packed(FIELD, rmp_serde::to_vec_named(&stored))?,
        packed(ENDS, rmp_serde::to_vec_named(&ends))?,
    ]))
}

/// The field, the steps that it took, and the parts of the shapes.
pub(super) fn read(
    records: &Records,
) -> Result<(SplineField, usize, [SolidParts; 2]), RecordError> {
    let stored: StoredField = one(records, FIELD)?;
    let grid = Grid {
        lower: stored.lower,
        spacing: stored.spacing,
        cells: stored.cells,
    };
    let nodes: usize = grid.cells.iter().map(|count| *count as usize + 2).product();
    let time = match stored.coefficients.len() == 3 * nodes {
        true => TimeBasis::Constant,
        false => TimeBasis::Linear,
    };
    let field = SplineField::from_parts(grid, time, &stored.coefficients);
    let field = field.map_err(|error| damaged(FIELD, error.to_string()))?;
    Ok((field, stored.step, one(records, ENDS)?))
}

/// A field that is not what the solver would have there.
pub(super) fn misfit(error: &SplineError) -> RecordError {
    damaged(FIELD, error.to_string())
}

/// The shapes of their parts.
pub(super) fn shapes(parts: [SolidParts; 2]) -> Result<[Solid; 2], RecordError> {
    let [source, target] = parts.map(|parts| {
        Solid::new(parts).ok_or_else(|| damaged(ENDS, "a shape does not fit together".to_owned()))
    });
    Ok([source?, target?])
}

fn one<T: DeserializeOwned>(records: &Records, file: &str) -> Result<T, RecordError> {
    let found = records.0.iter().find(|(name, _)| name == file);
    let (_, bytes) = found.ok_or_else(|| damaged(file, "it is missing".to_owned()))?;
    rmp_serde::from_slice(bytes).map_err(|error| damaged(file, error.to_string()))
}

fn damaged(file: &str, problem: String) -> RecordError {
    RecordError {
        file: file.to_owned(),
        problem,
    }
}
