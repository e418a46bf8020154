//! A solved field and its shapes as plain arrays, for programs that know nothing of isomorph.

use isomorph_spline::{SplineField, TimeBasis};
use isomorph_training::records::{RecordError, Records};
use serde_json::{Value, json};

use super::carried::steps_of;
use super::motion::Field;
use super::stored;

/// Arrays with their names and sides, the last side running fastest.
#[derive(Default)]
pub(crate) struct SolvedArrays {
    pub floats: Vec<(String, Vec<usize>, Vec<f32>)>,
    pub indices: Vec<(String, Vec<usize>, Vec<u32>)>,
    /// What they are: of each interval its times, its grid, its functions of time and the steps of its integrator.
    pub about: Value,
}

/// What a checkpoint holds.
///
/// # Errors
/// If it is damaged.
pub(crate) fn arrays(records: &Records) -> Result<SolvedArrays, RecordError> {
    let (field, _, parts) = stored::read(records)?;
    let mut out = SolvedArrays::default();
    let (mut is_partial, mut thickness) = (Vec::new(), Vec::new());
    for (k, shape) in parts.iter().enumerate() {
        let points = shape.points.as_flattened().to_vec();
        let corners = shape.triangles.as_flattened().to_vec();
        let sides = |count: usize| vec![count / 3, 3];
        out.floats
            .push((format!("shape.{k}.points"), sides(points.len()), points));
        out.indices.push((
            format!("shape.{k}.triangles"),
            sides(corners.len()),
            corners,
        ));
        is_partial.push(shape.known.is_some());
        thickness.push(shape.thickness);
    }
    let ends = |s: usize| [&parts[s].points[..], &parts[s + 1].points[..]];
    let mut intervals = Vec::new();
    match &field {
        Field::Pair(field) => intervals.push(out.interval(0, field, [0.0, 1.0], ends(0))),
        Field::Sequence(field) => {
            for (s, times) in field.times().windows(2).enumerate() {
                let part = field.part(s);
                intervals.push(out.interval(s, &part, [times[0], times[1]], ends(s)));
            }
        }
        Field::Pairs(fields, times) => {
            for (s, (field, times)) in fields.iter().zip(times.windows(2)).enumerate() {
                intervals.push(out.interval(s, field, [times[0], times[1]], ends(s)));
            }
        }
    }
    out.about = json!({
        "intervals": intervals,
        // Where a shape is known in part, the blend of both distances has weights of its own.
        "partial": is_partial,
        // Of an open sheet: its distance is that of its triangles, without a sign, less half of this.
        "thickness": thickness,
    });
    Ok(out)
}

impl SolvedArrays {
    /// Adds the field of an interval; its description.
    fn interval<const H: usize>(
        &mut self,
        s: usize,
        field: &SplineField<f32, H>,
        times: [f64; 2],
        ends: [&[[f32; 3]]; 2],
    ) -> Value {
        let grid = field.grid();
        let functions = polynomials(field.time_basis());
        let sides = grid.nodes().into_iter().chain([functions.len(), 3]);
        let name = format!("velocity.{s}.coefficients");
        self.floats
            .push((name, sides.collect(), field.coefficients()));
        json!({
            "from": times[0],
            "to": times[1],
            "lower": grid.lower,
            "spacing": grid.spacing,
            "cells": grid.cells,
            "time_functions": functions,
            "steps": steps_of(field, ends),
        })
    }
}

/// The functions of an interval's own time from 0 to 1: the coefficients of 1, `t` and `t^2`.
fn polynomials(basis: TimeBasis) -> Vec<[f64; 3]> {
    match basis {
        TimeBasis::Constant => vec![[1.0, 0.0, 0.0]],
        TimeBasis::Linear => vec![[1.0, 0.0, 0.0], [-1.0, 2.0, 0.0]],
        TimeBasis::Quadratic(functions) => functions.to_vec(),
    }
}
