//! The terms against closed forms, their gradients against differences, and an optimisation with them.

use std::f64::consts::PI;

use burn::module::{AutodiffModule, Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::{AdamConfig, GradientsParams, Optimizer};
use burn::tensor::Tensor;

use super::super::*;
use super::{SMALL, farthest, scattered};
use crate::autodiff::ModelBackend;
use crate::objective::Objective;
use crate::operators::length;
use crate::testing::{Plain, Train, host, points, shaken};

#[test]
fn the_tangents_are_a_frame_of_the_normal() {
    let (third, half) = (1.0 / 3f64.sqrt(), 0.5f64.sqrt());
    let normals = [
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [third, -third, third],
        [0.0, half, -half],
        [1.0, 0.0, 0.0],
    ];
    let [t, s] = tangents(points::<Plain>(&normals));
    let [n, t, s] = [points(&normals), t, s].map(host);
    for ((n, t), s) in n.chunks(3).zip(t.chunks(3)).zip(s.chunks(3)) {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (a, b, wanted) in [
            (t, t, 1.0),
            (s, s, 1.0),
            (t, s, 0.0),
            (t, n, 0.0),
            (s, n, 0.0),
        ] {
            // A few f32 roundings of numbers of size 1.
            assert!((product(a, b) - wanted).abs() < 1e-6, "{n:?}: {a:?} {b:?}");
        }
        let volume = t[0] * (s[1] * n[2] - s[2] * n[1])
            + t[1] * (s[2] * n[0] - s[0] * n[2])
            + t[2] * (s[0] * n[1] - s[1] * n[0]);
        assert!((volume - 1.0).abs() < 1e-6, "{n:?}: orientation {volume}");
    }
}

/// A turn by `angle` about the axis `(2, 1, 2) / 3` (Rodrigues).
fn turned(x: [f64; 3], angle: f64) -> [f64; 3] {
    let axis = [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0];
    let along: f64 = (0..3).map(|k| axis[k] * x[k]).sum();
    let across = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        axis[i] * x[j] - axis[j] * x[i]
    };
    std::array::from_fn(|k| {
        x[k] * angle.cos() + across(k) * angle.sin() + axis[k] * along * (1.0 - angle.cos())
    })
}

/// Pairs of neighbours on a sphere of radius 1/2, and what a linear map makes of positions and tangents.
fn on_a_sphere(map: impl Fn([f64; 3]) -> [f64; 3]) -> [SurfacePoint<Plain>; 4] {
    let unit = |x: [f64; 3]| x.map(|c| c / x.iter().map(|c| c * c).sum::<f64>().sqrt());
    let here: Vec<[f64; 3]> = scattered(30, 1.0).into_iter().map(unit).collect();
    let near: Vec<[f64; 3]> = here
        .iter()
        .map(|n| unit([n[0] + 0.05, n[1] - 0.08, n[2] + 0.03]))
        .collect();
    let before =
        [here, near].map(|normals| SurfacePoint::at_rest(points(&normals) * 0.5, points(&normals)));
    let mapped = |rows: Tensor<Plain, 2>| {
        let rows: Vec<[f64; 3]> = host(rows)
            .chunks(3)
            .map(|row| map([row[0], row[1], row[2]]))
            .collect();
        points(&rows)
    };
    let after = before
        .clone()
        .map(|point| SurfacePoint::spanned(mapped(point.position), point.tangents.map(&mapped)));
    let ([p, q], [p1, q1]) = (before, after);
    [p, q, p1, q1]
}

#[test]
fn a_rigid_motion_neither_stretches_nor_bends() {
    for angle in [0.0, 0.7, PI] {
        let [p, q, p1, q1] = on_a_sphere(|x| turned(x, angle));
        let stretched = host(stretch(&p1.tangents).mean())[0];
        // f32 rounding of numbers of size 1, squared; in the bend divided by a distance of 0.05.
        assert!(stretched < 1e-11, "{angle}: {stretched}");
        let bent = host(bend((&p, &q), (&p1, &q1)).mean())[0];
        assert!(bent < 1e-9, "{angle}: {bent}");
    }
}

#[test]
fn a_scaling_stretches_and_bends_by_what_is_known() {
    let size = 1.3;
    let [p, q, p1, q1] = on_a_sphere(|x| x.map(|c| c * size));
    // <u_a, u_b> = s^2 [a = b], so 2 (s^2 - 1)^2.
    let wanted = 2.0 * (size * size - 1.0f64).powi(2);
    for stretched in host(stretch(&p1.tangents)) {
        assert!(
            (stretched - wanted).abs() < 1e-5,
            "{stretched}, wanted {wanted}"
        );
    }
    // The normals turn by (q - p) / r, r = 1/2, before and after, and u_a = s t_a: (s - 1)^2 / r^2 of the
    // squared share of the chord that lies in the tangent plane.
    let bent = host(bend((&p, &q), (&p1, &q1)));
    let (p, q, n) = (host(p.position), host(q.position), host(p.normal));
    for (k, bent) in bent.into_iter().enumerate() {
        let chord: Vec<f64> = (0..3).map(|i| q[3 * k + i] - p[3 * k + i]).collect();
        let squared: f64 = chord.iter().map(|c| c * c).sum();
        let outward: f64 = (0..3).map(|i| chord[i] * n[3 * k + i]).sum();
        let wanted = (size - 1.0f64).powi(2) * 4.0 * (1.0 - outward * outward / squared);
        // f32 rounding over the distance of 0.05.
        assert!((bent - wanted).abs() < 1e-4, "{bent}, wanted {wanted}");
    }
}

#[test]
fn rolling_a_plane_up_bends_it_by_its_curvature_and_stretches_nothing() {
    // (x, y, 0) goes to (r sin(x / r), y, r cos(x / r)).
    let (r, h) = (0.4, 0.02);
    let rolled = |x: f64| {
        let (sine, cosine) = (x / r).sin_cos();
        let tangents = [points(&[[cosine, 0.0, -sine]]), points(&[[0.0, 1.0, 0.0]])];
        SurfacePoint::<Plain>::spanned(points(&[[r * sine, 0.0, r * cosine]]), tangents)
    };
    let flat =
        |x: f64, y: f64| SurfacePoint::at_rest(points(&[[x, y, 0.0]]), points(&[[0.0, 0.0, 1.0]]));
    assert!(host(stretch(&rolled(0.3).tangents))[0] < 1e-11);
    let across = host(bend(
        (&flat(0.3, 0.0), &flat(0.3 + h, 0.0)),
        (&rolled(0.3), &rolled(0.3 + h)),
    ))[0];
    // The difference of the normals along u_1 is sin(h / r); f32 rounding over h, 1e-5 of 2.5, squared.
    let wanted = ((h / r).sin() / h).powi(2);
    assert!((across - wanted).abs() < 1e-3, "{across}, wanted {wanted}");
    // Along the axis nothing turns.
    let along = host(bend(
        (&flat(0.3, 0.0), &flat(0.3, h)),
        (&rolled(0.3), &rolled(0.3)),
    ))[0];
    assert!(along < 1e-9, "{along}");
}

/// Pairs of neighbours on a sphere of radius 1/2, and six of them to be turned by 20 degrees.
fn samples<B: ModelBackend>(count: usize) -> NfgpSamples<B> {
    let [p, q, ..] = on_a_sphere(|x| x);
    let constant = |rows: &Tensor<Plain, 2>| {
        let rows = host(rows.clone());
        let rows: Vec<[f64; 3]> = rows.chunks(3).map(|row| [row[0], row[1], row[2]]).collect();
        rows
    };
    let handles = &constant(&p.position)[..count];
    let marks: Vec<[f64; 3]> = handles.iter().map(|x| turned(*x, PI / 9.0)).collect();
    let [a, b, c, d] =
        [&p.position, &p.normal, &q.position, &q.normal].map(|rows| points(&constant(rows)));
    NfgpSamples {
        handles: points(handles),
        marks: points(&marks),
        points: a,
        normals: b,
        neighbours: c,
        neighbour_normals: d,
    }
}

const NONE: NfgpWeights = NfgpWeights {
    handles: 0.0,
    stretch: 0.0,
    bend: 0.0,
};

#[test]
fn a_term_is_there_where_its_weight_is_and_the_identity_pays_for_its_handles_only() {
    let still = shaken_to_zero();
    let objective = |weights: NfgpWeights| still.objective(&samples(6), &weights);
    let names = |objective: Objective<Plain>| -> Vec<&str> {
        objective.terms().iter().map(|term| term.name).collect()
    };
    assert_eq!(
        names(objective(NfgpWeights::default())),
        ["handles", "stretch", "bend"]
    );
    assert_eq!(
        names(objective(NfgpWeights {
            stretch: 1.0,
            ..NONE
        })),
        ["stretch"]
    );
    assert_eq!(
        names(objective(NfgpWeights { bend: 1.0, ..NONE })),
        ["bend"]
    );
    assert!(names(objective(NONE)).is_empty());
    let [handles, stretch, bend] = objective(NfgpWeights::default()).read()[..] else {
        panic!("three terms");
    };
    let given = samples::<Plain>(6);
    let apart = length(given.handles - given.marks);
    let wanted = host((apart.clone() * apart).mean())[0];
    // One mean of six f32 numbers below 0.1; the others are rounding as in the rigid motions above.
    assert!((handles - wanted).abs() < 1e-7, "{handles} {wanted}");
    assert!(stretch < 1e-11 && bend < 1e-9, "{stretch} {bend}");
}

/// The identity: every weight zero, which must not give NaN.
fn shaken_to_zero() -> Nfgp<Plain> {
    struct Zero;
    impl ModuleMapper<Plain> for Zero {
        fn map_float<const D: usize>(
            &mut self,
            param: Param<Tensor<Plain, D>>,
        ) -> Param<Tensor<Plain, D>> {
            param.map(|weights| weights.zeros_like())
        }
    }
    SMALL.init(5, &Default::default()).map(&mut Zero)
}

/// Moves the weights along their gradient, times a length.
struct Along<'a>(&'a GradientsParams, f64);

impl ModuleMapper<Train> for Along<'_> {
    fn map_float<const D: usize>(
        &mut self,
        param: Param<Tensor<Train, D>>,
    ) -> Param<Tensor<Train, D>> {
        match self.0.get::<Plain, D>(param.id) {
            None => param,
            Some(gradient) => param.map(|weights| {
                Tensor::from_inner(weights.inner() + gradient * self.1).require_grad()
            }),
        }
    }
}

/// How many parameters have a gradient other than zero, and its squared length over all of them.
struct Length<'a>(&'a GradientsParams, usize, f64);

impl ModuleVisitor<Train> for Length<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<Train, D>>) {
        let gradient = self
            .0
            .get::<Plain, D>(param.id)
            .map(host)
            .unwrap_or_default();
        let squared: f64 = gradient.iter().map(|g| g * g).sum();
        self.1 += usize::from(squared > 0.0);
        self.2 += squared;
    }
}

#[test]
fn the_gradient_of_every_term_reaches_the_weights_and_is_that_of_differences() {
    // Of the 18 parameters, the last bias is a translation, which neither stretches nor bends.
    let terms = [
        (
            "handles",
            18,
            NfgpWeights {
                handles: 1.0,
                ..NONE
            },
        ),
        (
            "stretch",
            17,
            NfgpWeights {
                stretch: 1.0,
                ..NONE
            },
        ),
        ("bend", 17, NfgpWeights { bend: 1.0, ..NONE }),
    ];
    let net = shaken(SMALL.init::<Train>(5, &Default::default()), 0.3);
    for (name, reached, weights) in terms {
        let total = |net: &Nfgp<Train>| {
            let objective = net.objective(&samples(6), &weights);
            objective.total().expect("one term")
        };
        let gradients = GradientsParams::from_grads(total(&net).backward(), &net);
        let mut visitor = Length(&gradients, 0, 0.0);
        net.visit(&mut visitor);
        assert_eq!(visitor.1, reached, "{name}: parameters that it moves");
        let slope = visitor.2.sqrt();
        assert!(slope > 1e-3, "{name}: the gradient is {slope}");
        let step = 4e-3;
        let at = |far: f64| {
            let moved = net.clone().map(&mut Along(&gradients, far / slope));
            host(total(&moved))[0]
        };
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Truncation, step^2 times a third derivative, below a thousandth of the slope, and f32 rounding of
        // values of size 1 over the step.
        assert!(
            (difference - slope).abs() < 1e-3 * slope + 5e-5,
            "{name}: {difference}, gradient {slope}"
        );
    }
}

/// A deformation after some steps of Adam, and its handle term before and after them.
fn trained(
    mut net: Nfgp<Train>,
    samples: &NfgpSamples<Train>,
    steps: usize,
) -> (Nfgp<Train>, f64, f64) {
    let weights = NfgpWeights::default();
    let handles = |net: &Nfgp<Train>| net.objective(samples, &weights).read()[0];
    let before = handles(&net);
    let mut optimiser = AdamConfig::new().init();
    for _ in 0..steps {
        let total = net
            .objective(samples, &weights)
            .total()
            .expect("three terms");
        let gradients = GradientsParams::from_grads(total.backward(), &net);
        net = optimiser.step(3e-3, net, gradients);
    }
    let after = handles(&net);
    (net, before, after)
}

#[test]
fn handles_turn_a_sphere_by_twenty_degrees_and_the_result_can_be_inverted() {
    let start = SMALL.init::<Train>(2, &Default::default());
    let given = samples(30);
    let (net, before, after) = trained(start, &given, 300);
    assert!(after < 0.1 * before, "{before} to {after}");
    let (net, x) = (net.valid(), points(&scattered(300, 0.6)));
    let y = net.forward(x.clone());
    let back = farthest(net.inverse(y, FixedPoint::default()), x);
    // As above: each block within 1e-5, and what an earlier one makes of it.
    assert!(back < 1e-4, "{back}");
}
