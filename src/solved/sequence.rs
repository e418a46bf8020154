//! Surfaces and motion through many key frames: the field of each interval with the shapes at its ends.

use std::sync::Arc;

use isomorph_spline::{SequenceField, SplineField};
use isomorph_training::in_turns::{InTurns, Kept};

use super::carried::CarriedShapes;
use crate::shape::{Solid, SolidParts};

/// Gives the field from one key frame to the next.
type FieldOf<const H: usize> = dyn Fn(usize) -> SplineField<f32, H> + Send + Sync;

/// Of one field through all key frames.
pub(super) fn through(
    field: SequenceField,
    shapes: Arc<[SolidParts]>,
) -> InTurns<CarriedShapes<2>> {
    let times = field.times().to_vec();
    in_turns(Box::new(move |s| field.part(s)), times, shapes)
}

/// Of a field from each key frame to the next, in a time of its own from 0 to 1.
pub(super) fn in_turns<const H: usize>(
    field: Box<FieldOf<H>>,
    times: Vec<f64>,
    shapes: Arc<[SolidParts]>,
) -> InTurns<CarriedShapes<H>> {
    let arrange = move |s: usize, kept: &Kept<CarriedShapes<H>>| {
        let shape = |k: usize| {
            // A shape that is arranged takes ten times its memory: that of a neighbour, if it is there.
            let near = kept.iter().find_map(|(known, part)| {
                let end = k.checked_sub(*known).filter(|end| *end < 2)?;
                Some(part.shared(end))
            });
            near.unwrap_or_else(|| {
                let solid = Solid::new(shapes[k].clone());
                Arc::new(solid.expect("its parts are sound"))
            })
        };
        CarriedShapes::new(field(s), [shape(s), shape(s + 1)], true)
    };
    InTurns::new(times, Box::new(arrange))
}
