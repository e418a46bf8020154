//! The part of a checkpoint that a solved field has: `velocity.mpk`, the field, and `ends.mpk`, the shapes that
//! it carries. Both in MessagePack, like the records of networks.

use std::io;

use isomorph_spline::{Grid, SequenceField, SplineError, SplineField, TimeBasis};
use isomorph_training::records::{RecordError, Records};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::motion::Field;
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
    /// Of the key frames, where there are more than two.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    times: Vec<f64>,
}

/// The field, the steps that it took, and the shapes as files.
pub(super) fn records(field: &Field, step: usize, shapes: &[Solid]) -> io::Result<Records> {
    let Grid {
        lower,
        spacing,
        cells,
    } = match field {
        Field::Pair(field) => *field.grid(),
        Field::Sequence(field) => *field.grid(),
    };
    let stored = StoredField {
        step,
        lower,
        spacing,
        cells,
        coefficients: field.coefficients(),
        times: match field {
            Field::Pair(_) => Vec::new(),
            Field::Sequence(field) => field.times().to_vec(),
        },
    };
    let ends: Vec<&SolidParts> = shapes.iter().map(Solid::parts).collect();
    let packed = |file: &str, bytes: Result<Vec<u8>, rmp_serde::encode::Error>| {
        Ok::<_, io::Error>((file.to_owned(), bytes.map_err(io::Error::other)?))
    };
    Ok(Records(vec![
        packed(FIELD, rmp_serde::to_vec_named(&stored))?,
        packed(ENDS, rmp_serde::to_vec_named(&ends))?,
    ]))
}

/// The field, the steps that it took, and the parts of the shapes.
pub(super) fn read(records: &Records) -> Result<(Field, usize, Vec<SolidParts>), RecordError> {
    let stored: StoredField = one(records, FIELD)?;
    let grid = Grid {
        lower: stored.lower,
        spacing: stored.spacing,
        cells: stored.cells,
    };
    let parts: Vec<SolidParts> = one(records, ENDS)?;
    let keys = if stored.times.is_empty() {
        2
    } else {
        stored.times.len()
    };
    if parts.len() != keys {
        let found = parts.len();
        return Err(damaged(
            ENDS,
            format!("{found} shapes for {keys} key frames"),
        ));
    }
    let field = if stored.times.is_empty() {
        let nodes = grid.cells.iter().map(|count| *count as usize + 2);
        let time = match stored.coefficients.len() == 3 * nodes.product::<usize>() {
            true => TimeBasis::Constant,
            false => TimeBasis::Linear,
        };
        SplineField::from_parts(grid, time, &stored.coefficients).map(Field::Pair)
    } else {
        let field = SequenceField::from_parts(grid, stored.times, &stored.coefficients);
        field.map(Field::Sequence)
    };
    let field = field.map_err(|error| damaged(FIELD, error.to_string()))?;
    Ok((field, stored.step, parts))
}

/// A field that is not what the solver would have there.
pub(super) fn misfit(error: &SplineError) -> RecordError {
    damaged(FIELD, error.to_string())
}

/// A field of another number of key frames than the run has.
pub(super) fn other_kind() -> RecordError {
    damaged(FIELD, "it is of another number of key frames".to_owned())
}

/// The shapes of their parts.
pub(super) fn shapes(parts: Vec<SolidParts>) -> Result<Vec<Solid>, RecordError> {
    let whole = |parts| {
        Solid::new(parts).ok_or_else(|| damaged(ENDS, "a shape does not fit together".to_owned()))
    };
    parts.into_iter().map(whole).collect()
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
