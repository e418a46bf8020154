//! What the splines that guide networks give to their data, and what is said of it.

use isomorph_training::data::TrainingData;

use crate::shape::{Keyframes, key_name, trained};
use crate::solved::Guidance;

/// Gives the data what splines have found: a motion to learn where there are guided steps, and shapes that are whole.
/// What is said of it.
pub(super) fn guided(
    data: &mut TrainingData,
    found: Guidance,
    keyframes: &Keyframes,
    is_guided: bool,
) -> Vec<String> {
    let mut notes = Vec::new();
    for (k, completed) in found.completed.into_iter().enumerate() {
        let Some(cloud) = completed else { continue };
        let (name, key) = (key_name(k, keyframes.keys.len()), &keyframes.keys[k]);
        // Of a sheet it is said when it is read.
        if key.sheet.is_none() {
            notes.push(format!(
                "the {name} is known in part: where it is not, its end field learns what the motion brings there ({} points)",
                cloud.points.len() - key.cloud.points.len()
            ));
        }
        data.keys[k] = trained(key.time, &cloud);
    }
    data.guide = is_guided.then_some(found.guide);
    notes
}

/// What is said where no splines are found.
pub(super) fn unguided(reason: &str, is_guided: bool, is_partial: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if is_guided {
        notes.push(format!(
            "V learns without splines, which takes twice as long: {reason} (training.guided-until)"
        ));
    }
    if is_partial {
        notes.push(format!(
            "a shape that encloses nothing is closed by a bulge or a cushion, without splines: {reason}"
        ));
    }
    notes
}
