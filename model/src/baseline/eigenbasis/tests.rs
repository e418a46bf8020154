//! The field against its closed forms, its flow, and a short training.

use super::*;
use crate::testing::learning::{check_gradients, directions, trained};
use crate::testing::{Plain, Train, host, points, shaken};

fn config(modes: usize) -> EigenbasisConfig {
    EigenbasisConfig {
        modes,
        lower: [-0.4, -0.5, -0.3],
        upper: [0.4, 0.3, 0.5],
        padding: 0.2,
        steps: Steps::Even(4),
        integrator: Integrator::Rk4,
    }
}

/// Points of a ball of radius 0.3.
fn cloud(count: usize) -> Vec<[f64; 3]> {
    let radius = |k: usize| 0.3 * (0.755 * k as f64).fract().sqrt();
    let at = |(k, d): (usize, &[f64; 3])| d.map(|c| c * radius(k));
    directions(count).iter().enumerate().map(at).collect()
}

#[test]
fn one_mode_is_the_curl_worked_by_hand() {
    let mut field = config(1).init::<Plain>(&Default::default());
    // The box is [-0.56, -0.66, -0.46] + 1.12 [0, 1]^3; A = (0, 0, a phi), a = lambda^(-1/2).
    field.coefficients = field.coefficients.map(|_| points(&[[0.0, 0.0, 1.0]]));
    let u = [0.25, 1.0 / 3.0, 0.5f64];
    let x = [
        -0.56 + 1.12 * u[0],
        -0.66 + 1.12 * u[1],
        -0.46 + 1.12 * u[2],
    ];
    let wave = PI / 1.12;
    let a = 1.0 / (3.0f64.sqrt() * wave);
    let (s, c) = (u.map(|u| (PI * u).sin()), u.map(|u| (PI * u).cos()));
    let wanted = [
        a * wave * s[0] * c[1] * s[2],
        -a * wave * c[0] * s[1] * s[2],
        0.0,
    ];
    for (got, wanted) in host(field.velocity(points(&[x]))).into_iter().zip(wanted) {
        // f32 rounding of numbers below 1, the angle's included.
        assert!((got - wanted).abs() < 1e-6, "{got}, wanted {wanted}");
    }
}

#[test]
fn a_modes_curl_is_the_smaller_the_more_it_varies_along_its_potential() {
    let mut field = config(3).init::<Plain>(&Default::default());
    // Over eight nodes to a side the means of sin^2 and cos^2 of up to three half waves are exact.
    let at = |k: usize| 1.12 * (k as f64 + 0.5) / 8.0;
    let node = |n: usize| [at(n / 64) - 0.56, at(n / 8 % 8) - 0.66, at(n % 8) - 0.46];
    let x: Vec<[f64; 3]> = (0..512).map(node).collect();
    // Mode k = (3, 1, 1) is row 18 of 27; lambda is 11 (pi / 1.12)^2.
    for (axis, squared) in [(0, 1.0 - 9.0 / 11.0), (1, 1.0 - 1.0 / 11.0)] {
        let mut z = [[0.0; 3]; 27];
        z[18][axis] = 1.0;
        field.coefficients = field.coefficients.map(|_| points(&z));
        let velocity = host(field.velocity(points(&x)));
        let mean = velocity.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        // phi^2 has the mean 1/8, and the mode's deviation is (11/3)^(-3/4).
        let wanted = squared / 8.0 * (11f64 / 3.0).powf(-1.5);
        // f32 rounding of angles up to 10, relative.
        assert!(
            (mean / wanted - 1.0).abs() < 1e-5,
            "{axis}: {mean}, {wanted}"
        );
    }
}

#[test]
fn the_divergence_is_zero_to_rounding() {
    let field: Eigenbasis<Train> = shaken(config(6).init(&Default::default()), 1.0);
    let x = cloud(50);
    let rows: Vec<Vec<f64>> = (0..3)
        .map(|i| {
            let x = points::<Train>(&x).require_grad();
            let component = field.velocity(x.clone()).slice([0..50, i..i + 1]);
            host(x.grad(&component.sum().backward()).expect("V depends on x"))
        })
        .collect();
    let largest = rows
        .iter()
        .flatten()
        .fold(0.0f64, |most, d| most.max(d.abs()));
    assert!(largest > 1.0, "the field hardly varies: {largest}");
    for n in 0..50 {
        let divergence: f64 = (0..3).map(|i| rows[i][3 * n + i]).sum();
        // Three f32 sums of 648 numbers below 1 each, beside derivatives of size 10.
        assert!(
            divergence.abs() < 3e-6 * largest,
            "{divergence} beside {largest}"
        );
    }
}

#[test]
fn nothing_crosses_the_walls_of_the_padded_box() {
    let field: Eigenbasis<Plain> = shaken(config(6).init(&Default::default()), 1.0);
    let inside = cloud(50);
    for axis in 0..3 {
        for wall in [field.lower[axis], field.lower[axis] + field.size[axis]] {
            let on_wall = inside.iter().map(|x| {
                let mut x = *x;
                x[axis] = wall;
                x
            });
            let velocity = host(field.velocity(points(&on_wall.collect::<Vec<_>>())));
            let along = |d: usize| velocity.iter().skip(d).step_by(3).map(|v| v.abs());
            let normal = along(axis).fold(0.0, f64::max);
            let tangential = along((axis + 1) % 3).fold(0.0, f64::max);
            // The wall's f32 coordinate is off by 1e-7, times derivatives of size 10.
            assert!(normal < 1e-5 && tangential > 0.1, "{normal}, {tangential}");
        }
    }
}

#[test]
fn carrying_there_and_back_returns() {
    let field: Eigenbasis<Plain> = shaken(config(4).init(&Default::default()), 0.1);
    let x = cloud(50);
    let there = field.carry(points(&x), 0.2, 0.9);
    let back = host(field.carry(there.clone(), 0.9, 0.2));
    let ways = host(there).into_iter().zip(x.iter().flatten());
    let moved = ways.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
    assert!(moved > 0.05, "moved by {moved} only");
    for (got, wanted) in back.into_iter().zip(x.iter().flatten()) {
        // RK4 in 23 steps of ways of 0.1, where the field's scale is 0.3: f32 rounding.
        assert!((got - wanted).abs() < 1e-5, "{got}, wanted {wanted}");
    }
}

/// Turned by `angle` about the first axis.
fn turned(x: &[[f64; 3]], angle: f64) -> Vec<[f64; 3]> {
    let (s, c) = angle.sin_cos();
    let turn = |x: &[f64; 3]| [x[0], c * x[1] - s * x[2], s * x[1] + c * x[2]];
    x.iter().map(turn).collect()
}

#[test]
fn it_fits_a_rotation_and_turns_evenly() {
    let start = cloud(200);
    let field = config(6).init::<Train>(&Default::default());
    let weights = |robust_scale| EigenbasisWeights {
        matching: 1.0,
        robust_scale,
        prior: 1e-5,
    };
    let end = turned(&start, 0.7);
    for robust_scale in [0.0, 0.2] {
        let error = |field: &Eigenbasis<Train>| {
            field
                .objective(points(&start), points(&end), &weights(0.0))
                .read()[0]
        };
        let before = error(&field);
        let fitted = trained(field.clone(), 150, 5e-3, |field| {
            field.objective(points(&start), points(&end), &weights(robust_scale))
        });
        let after = error(&fitted);
        assert!(before > 0.1 && after < 0.1 * before, "{before} to {after}");
        // Half way in time is half way round: the field is stationary.
        let half = host(fitted.carry(points::<Train>(&start), 0.0, 0.5));
        let wanted = turned(&start, 0.35).concat();
        let off = half
            .iter()
            .zip(&wanted)
            .map(|(a, b)| (a - b).abs())
            .sum::<f64>();
        // The mean error of a coordinate, against ways of 0.1.
        assert!(off / 600.0 < 0.01, "{}", off / 600.0);
    }
}

#[test]
fn the_gradient_of_every_term_reaches_the_coefficients() {
    let (start, end) = (cloud(20), turned(&cloud(20), 0.4));
    let field: Eigenbasis<Train> = shaken(config(3).init(&Default::default()), 0.2);
    for robust_scale in [0.0, 0.2] {
        check_gradients(&field, |field: &Eigenbasis<Train>| {
            let weights = EigenbasisWeights {
                matching: 1.0,
                robust_scale,
                prior: 1.0,
            };
            field.objective(points(&start), points(&end), &weights)
        });
    }
}
