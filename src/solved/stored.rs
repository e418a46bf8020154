//! The part of a checkpoint that a solved field has: `velocity.mpk`, the field, and `ends.mpk`, the shapes that
//! it carries. Both in MessagePack, like the records of networks.

use std::io;

use isomorph_spline::{Grid, SequenceField, SplineError, SplineField, TimeBasis};
use isomorph_training::records::{RecordError, Records};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::motion::Field;
use super::shapes::Shapes;
use crate::shape::SolidParts;

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
    /// The fields of further intervals, where each has its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    further: Vec<StoredField>,
}

impl StoredField {
    fn new(grid: &Grid, coefficients: Vec<f32>, step: usize) -> Self {
        let Grid {
            lower,
            spacing,
            cells,
        } = *grid;
        Self {
            step,
            lower,
            spacing,
            cells,
            coefficients,
            times: Vec::new(),
            further: Vec::new(),
        }
    }

    fn of(field: &Field, step: usize) -> Self {
        let pair = |field: &SplineField| Self::new(field.grid(), field.coefficients(), step);
        match field {
            Field::Pair(field) => pair(field),
            Field::Sequence(field) => Self {
                times: field.times().to_vec(),
                ..Self::new(field.grid(), field.coefficients(), step)
            },
            Field::Pairs(fields, times) => Self {
                times: times.clone(),
                further: fields[1..].iter().map(pair).collect(),
                ..pair(&fields[0])
            },
        }
    }

    fn grid(&self) -> Grid {
        Grid {
            lower: self.lower,
            spacing: self.spacing,
            cells: self.cells,
        }
    }

    /// Its own field, between two shapes.
    fn pair(&self) -> Result<SplineField, SplineError> {
        let nodes = self.cells.iter().map(|count| *count as usize + 2);
        let time = match self.coefficients.len() == 3 * nodes.product::<usize>() {
            true => TimeBasis::Constant,
            false => TimeBasis::Linear,
        };
        SplineField::from_parts(self.grid(), time, &self.coefficients)
    }

    fn field(&self) -> Result<Field, SplineError> {
        if self.times.is_empty() {
            return self.pair().map(Field::Pair);
        }
        let times = self.times.clone();
        if self.further.is_empty() {
            let field = SequenceField::from_parts(self.grid(), times, &self.coefficients);
            return field.map(Field::Sequence);
        }
        let all = [self].into_iter().chain(&self.further);
        let fields: Result<Vec<_>, _> = all.map(Self::pair).collect();
        Ok(Field::Pairs(fields?, times))
    }
}

/// The field, the steps that it took, and the shapes as files.
pub(super) fn records(field: &Field, step: usize, shapes: &Shapes) -> io::Result<Records> {
    let stored = StoredField::of(field, step);
    let ends = shapes.parts();
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
    let parts: Vec<SolidParts> = one(records, ENDS)?;
    let keys = if stored.times.is_empty() {
        2
    } else {
        stored.times.len()
    };
    if parts.len() != keys {
        let found = parts.len();
        return Err(RecordError::new(
            ENDS,
            format!("{found} shapes for {keys} key frames"),
        ));
    }
    let intervals = stored.further.len() + 1;
    let ascend = stored.times.windows(2).all(|two| two[0] < two[1]);
    if !ascend || (intervals > 1 && intervals + 1 != keys) {
        let problem =
            format!("{intervals} fields for {keys} key frames, or times that do not ascend");
        return Err(RecordError::new(FIELD, problem));
    }
    let field = stored.field();
    let field = field.map_err(|error| RecordError::new(FIELD, error.to_string()))?;
    Ok((field, stored.step, parts))
}

/// A field that is not what the solver would have there.
pub(super) fn misfit(error: &SplineError) -> RecordError {
    RecordError::new(FIELD, error.to_string())
}

/// A field of another number of key frames than the run has.
pub(super) fn other_kind() -> RecordError {
    RecordError::new(FIELD, "it is of another number of key frames".to_owned())
}

/// The shapes of their parts.
pub(super) fn shapes(parts: Vec<SolidParts>) -> Result<Shapes, RecordError> {
    let whole = Shapes::of(parts);
    whole.map_err(|k| RecordError::new(ENDS, format!("shape {k} does not fit together")))
}

fn one<T: DeserializeOwned>(records: &Records, file: &str) -> Result<T, RecordError> {
    let found = records.bytes(file);
    let bytes = found.ok_or_else(|| RecordError::new(file, "it is missing"))?;
    rmp_serde::from_slice(bytes).map_err(|error| RecordError::new(file, error.to_string()))
}
