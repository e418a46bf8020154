//! Where a method in training has no number any more: said beside the term that has none.

use isomorph_training::data::KeyPoints;
use isomorph_training::deformation::Deformation;

use crate::shape::{Coordinates, key_name};

/// The first given point at which `f` or `V` is not finite, in the user's coordinates, and at how many it is not: a
/// part of a sentence. `None` if both are finite at all of them.
pub(super) fn place(
    deformation: &dyn Deformation,
    keys: &[KeyPoints],
    coordinates: &Coordinates,
) -> Option<String> {
    for (k, key) in keys.iter().enumerate() {
        let time = f64::from(key.time);
        let field = deformation.field();
        let of_f = field.map(|f| {
            let values = f.values(&key.points, time).into_iter();
            values.map(f32::is_finite).collect()
        });
        let motion = deformation.motion();
        let of_v = motion.map(|v| {
            let values = v.velocities(&key.points, time).into_iter();
            values
                .map(|v| v.iter().all(|part| part.is_finite()))
                .collect()
        });
        for (name, finite) in [("f", of_f), ("V", of_v)] {
            let finite: Vec<bool> = finite.unwrap_or_default();
            let Some(first) = finite.iter().position(|is| !is) else {
                continue;
            };
            let at = coordinates.at(time).invert(key.points[first]);
            let shape = key_name(k, keys.len());
            return Some(if finite.contains(&true) {
                format!(
                    "{name} is not finite at {} of {} points of the {shape}, first at {at:?}",
                    finite.iter().filter(|is| !**is).count(),
                    finite.len()
                )
            } else {
                format!("{name} is not finite at any point of the {shape}")
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use isomorph_training::data::TrainingData;
    use isomorph_training::deformation::SurfaceField;

    use super::*;
    use crate::shape::Normalisation;
    use crate::surface::learned::Learned;

    /// No number from this x on.
    struct Until(f32);

    impl SurfaceField for Until {
        fn values(&self, points: &[[f32; 3]], _: f64) -> Vec<f32> {
            let value = |x: &[f32; 3]| if x[0] < self.0 { x[0] } else { f32::NAN };
            points.iter().map(value).collect()
        }

        fn gradients(&self, points: &[[f32; 3]], _: f64) -> Vec<[f32; 3]> {
            points.to_vec()
        }
    }

    #[test]
    fn the_first_point_without_a_number_is_said_in_the_users_coordinates() {
        let mut keys = TrainingData::spheres(4, 0).keys;
        for key in &mut keys {
            key.points = (0..4).map(|k| [k as f32 + key.time, 0.0, 0.0]).collect();
        }
        let coordinates = Coordinates::as_given(Normalisation {
            centre: [10.0, 0.0, 0.0],
            scale: 2.0,
        });
        let said = |from: f32| {
            let learned = Learned::of_field(Until(from));
            place(&*learned.deformation, &keys, &coordinates)
        };
        assert_eq!(said(9.0), None);
        let expected = "f is not finite at 1 of 4 points of the target, first at [12.0, 0.0, 0.0]";
        assert_eq!(said(4.0).as_deref(), Some(expected));
        assert_eq!(
            said(0.0).as_deref(),
            Some("f is not finite at any point of the source")
        );
    }
}
