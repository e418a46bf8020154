//! Through many key frames, pairs that were found lead and given ones bind.

use super::*;

/// How far points of the first key frame arrive beside their true places at the second, along x.
fn beside(correspondences: &str, change: &str) -> f32 {
    let mut keyframes = falling();
    // As found pairs are off, all to one side.
    for (_, target) in keyframes.between.iter_mut().flatten() {
        target[0] += 0.02;
    }
    let recipe = of_many(&[
        &format!("data.correspondences={correspondences}"),
        "training.steps=10",
        change,
    ]);
    let deformation = trained(&recipe, &keyframes).deformation();
    let motion = deformation.motion().expect("one");
    let [first, second] = [0, 1].map(|k| &keyframes.keys[k].cloud.points);
    let arrived = motion.carry(first, 0.0, keyframes.keys[1].time);
    let off = arrived.iter().zip(second).map(|(a, b)| a[0] - b[0]);
    off.sum::<f32>() / first.len() as f32
}

#[test]
fn found_pairs_lead_and_given_ones_bind() {
    let plain = "training.seed=0";
    let (given, found) = (beside("same-vertices", plain), beside("match", plain));
    assert!(given > 0.012, "given pairs: {given}");
    assert!(found.abs() < 0.5 * given, "{found} instead of {given}");
    // Where the surfaces say nothing, found pairs are all there is.
    let led = beside("match", "loss.on-surface=0");
    assert!(led > 0.012, "nothing but found pairs: {led}");
}
