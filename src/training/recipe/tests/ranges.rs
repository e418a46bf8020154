//! What every key admits, written down a second time and apart from the table of keys.

use super::*;
use crate::method::METHODS;
use crate::recipe::VelocityKind;
use crate::recipe::rule::Kind;

/// Per key: what is admitted at the low end, refused below it, admitted at the high end, refused
/// above it; "" where there is no such end.
const ENDS: &str = r#"
data.keys                      [0,1]   [-1,1]   [9,10000000] [9,10000001]
data.points                    64      63       10000000 10000001
data.correspondence-fraction   1e-9    0        1        1.001
data.clean-strays              1.5     1.4      1000000  1000001
data.clean-part                0       -1e-9    1        1.001
spline.spacing                 0.01     0.009    1        1.001
spline.coarse-shares           [0]      [-1e-9]  [0.9]    [0.901]
spline.sheet-thickness         0        -1e-9    0.5      0.501
spline.band                    100      99       10000000 10000001
spline.surface-samples         1        0        1000000  1000001
spline.robust                  1e-9     0        1        1.001
spline.iterations              1        0        10000    10001
spline.tolerance               1e-9     0        1        1.001
lipmlp.lipschitz               0        -1e-9    3e38     inf
lipmlp.space-scale             1e-9     0        1000000  1000001
nise.ends-until                1e-9     0        0.9      0.91
nise.omega                     1e-9     0        1000     1000.1
nise.ends                      0        -1e-9    3e38     inf
nise.residual                  0        -1e-9    3e38     inf
eigenbasis.modes               1        0        16       17
eigenbasis.prior               0        -1e-9    3e38     inf
nfgp.deformations              1        0        1000     1001
nfgp.blocks                    1        0        32       33
nfgp.handles                   0        -1e-9    3e38     inf
nfgp.stretch                   0        -1e-9    3e38     inf
nfgp.bend                      0        -1e-9    3e38     inf
efis.ends-until                1e-9     0        0.9      0.91
efis.omega                     1e-9     0        1000     1000.1
efis.width                     4        3        4096     4097
efis.data                      0        -1e-9    3e38     inf
efis.normals                   0        -1e-9    3e38     inf
efis.signs                     0        -1e-9    3e38     inf
efis.speed                     0        -1e-9    3e38     inf
efis.isometry                  0        -1e-9    3e38     inf
efis.volume                    0        -1e-9    3e38     inf
efis.landmarks                 0        -1e-9    3e38     inf
implicit.depth                 1       0        32       33
implicit.width                 4       3        4096     4097
implicit.beta                  1e-9    0        1000     1000.1
implicit.frequencies           0       -1       16       17
implicit.sphere-radius         1e-9    0        10       10.1
implicit.skip                  0       -1       31       32
velocity.depth                 1       0        32       33
velocity.width                 4       3        4096     4097
velocity.beta                  1e-9    0        1000     1000.1
velocity.frequencies           0       -1       16       17
velocity.skip                  0       -1       31       32
loss.level-set                 0       -1e-9    3e38     inf
loss.lambda-l                  0       -1e-9    3e38     inf
loss.smoothness                0       -1e-9    3e38     inf
loss.smoothness-alpha          0       -1e-9    3e38     inf
loss.smoothness-gamma          0       -1e-9    3e38     inf
loss.divergence                0       -1e-9    3e38     nan
loss.strain                    0       -1e-9    3e38     inf
loss.strain-scale              0       -1e-9    3e38     inf
loss.matching                  0       -1e-9    3e38     inf
loss.matching-warm-up          0       -1e-9    3e38     inf
loss.matching-scale            0       -1e-9    3e38     inf
loss.data                      0       -1e-9    3e38     inf
loss.normals                   0       -1e-9    3e38     inf
loss.eikonal                   0       -1e-9    3e38     inf
loss.on-surface                0       -1e-9    3e38     inf
loss.transported-normals       0       -1e-9    3e38     inf
loss.off-surface               0       -1e-9    3e38     inf
loss.distance                  0       -1e-9    3e38     inf
loss.screw                     0       -1e-9    3e38     inf
training.steps                 1       0        10000000 10000001
training.batch                 64      63       1000000  1000001
training.correspondence-batch  1       0        1000000  1000001
training.learning-rate         1e-9    0        1        1.001
training.velocity-learning-rate 1e-9   0        1        1.001
training.muon-rate             1e-9    0        1        1.001
training.velocity-muon-rate    1e-9    0        1        1.001
training.decay                 1e-9    0        1        1.001
training.decay-every           1e-9    0        1        1.001
training.final-learning-rate   0       -1e-9    1        1.001
training.guided-until 0       -1e-9    1        1.001
training.warm-up               0       -1e-9    1        1.001
training.ramp-until            0       -1e-9    1        1.001
training.velocity-until        0       -1e-9    1        1.001
training.time-steps            1       0        1000     1001
training.band-share            0       -1e-9    1        1.001
training.band-widths           [1e-9]  [0]      [10,10]  [10,10.1]
training.box-margin            1e-9    0        1        1.001
training.clip                  0       -1e-9    3e38     inf
training.seed                  0       -1       9223372036854775807 9223372036854775808
training.log-every             1       0        10000000 10000001
checkpoint.every               1       0        10000000 10000001
checkpoint.keep                1       0        10000000 10000001
checkpoint.step-backs          0       -1       100      101
result.frames                  0       -1       1000     1001
result.resolution              8       7        2048     2049
result.preview-every           0       -1       10000000 10000001
result.smallest-component      0       -1e-9    1        1.001
"#;

/// Values under which every single key may take either end of its range.
const ROOM: [&str; 5] = [
    "training.ramp-until=1",
    "training.velocity-until=1",
    "training.warm-up=0",
    "implicit.depth=32",
    "velocity.depth=32",
];

/// Whether the key may have this value, in the first method in which it acts.
fn admitted(key: &'static Key, given: &str) -> Result<(), RecipeError> {
    let spec = METHODS
        .iter()
        .find(|spec| spec.acts_on(key))
        .expect("a method");
    let mut overrides = vec![KNOWN.to_owned(), format!("method.name={}", spec.name)];
    overrides.extend(
        spec.geometry
            .map(|kind| format!("implicit.geometry={kind}")),
    );
    overrides.extend(spec.velocity.map(|kind| format!("velocity.kind={kind}")));
    if spec.velocity == Some(VelocityKind::Spline) {
        overrides.push("training.steps=18".to_owned());
    }
    let acts = |change: &&&str| {
        let id = change.split('=').next().unwrap_or_default();
        spec.acts_on(catalogue::by_id(id).expect(id))
    };
    overrides.extend(ROOM.iter().filter(acts).map(|change| (*change).to_owned()));
    overrides.push(given.to_owned());
    if key.field == "name" {
        // Which method that is, it says itself.
        overrides.truncate(1);
        overrides.push(given.to_owned());
    }
    let sequence = "[data]\nsequence = \"/s.anime\"\n";
    let (shapes, stored) = match key.field {
        "keys" => (
            format!("{sequence}keys = {}\n", &given["data.keys=".len()..]),
            true,
        ),
        _ => (SHAPES.to_owned(), false),
    };
    if stored {
        // Sequences are read, and not yet trained on.
        return Recipe::parse_stored(&shapes, Path::new("recipe.toml")).map(|_| ());
    }
    let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
    parsed(&shapes, &overrides).map(|_| ())
}

#[test]
fn every_number_is_admitted_to_both_ends_of_its_range_and_refused_beyond() {
    let mut tested = Vec::new();
    for row in ENDS.trim().lines() {
        let [key, low, below, high, above] = row.split_whitespace().collect::<Vec<_>>()[..] else {
            panic!("a key and four values: {row}");
        };
        let found = catalogue::by_id(key).expect(key);
        for (value, fits) in [(low, true), (below, false), (high, true), (above, false)] {
            match admitted(found, &format!("{key}={value}")) {
                Ok(()) => assert!(fits, "{key}={value} is out of range"),
                Err(error) => {
                    let message = error.to_string();
                    assert!(!fits, "{message}");
                    assert!(message.contains(": must be "), "{message}");
                    assert!(message.contains(key), "{message}");
                }
            }
        }
        tested.push(key.to_owned());
    }
    let has_ends = |kind| {
        matches!(
            kind,
            Kind::Whole { .. } | Kind::Number(_) | Kind::Numbers(_)
        )
    };
    let numbers: Vec<String> = catalogue::keys()
        .filter(|key| has_ends(key.rule.kind))
        .map(Key::id)
        .collect();
    assert_eq!(tested, numbers);
}

const KNOWN: &str = "data.correspondences=same-vertices";

#[test]
fn every_word_is_admitted_and_no_other() {
    let words = [
        ("data.normals", "auto given estimate none"),
        ("data.correspondences", "none same-vertices match pairs.csv"),
        (
            "method.name",
            "velocity-field mlp sdf-blend lipmlp nise nise-velocity eigenbasis nfgp efis",
        ),
        ("implicit.geometry", "network flow"),
        ("implicit.activation", "softplus sine"),
        ("velocity.activation", "softplus sine"),
        ("velocity.time-dependent", "true false"),
        ("loss.level-set-form", "mlse olse"),
        ("training.schedule", "cosine step"),
        ("training.integrator", "euler midpoint rk4"),
        ("training.times", "random grid"),
        ("training.derivatives", "nested forward"),
    ];
    for (key, words) in words {
        let found = catalogue::by_id(key).expect(key);
        for word in words.split(' ') {
            assert!(
                // Some methods need correspondences; the later override wins.
                admitted(found, &format!("{key}={word}")).is_ok(),
                "{key}={word}"
            );
        }
        assert!(admitted(found, &format!("{key}=Nested")).is_err(), "{key}");
    }
}
