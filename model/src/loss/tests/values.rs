//! Each term on hand-worked points and fields.

use burn::tensor::Tensor;

use crate::loss::*;
use crate::operators::{ImplicitJet, VelocityJet};
use crate::testing::{Plain, column, host, points};

fn jet(value: &[f64], gradient: &[[f64; 3]], rate: &[f64]) -> ImplicitJet<Plain> {
    ImplicitJet {
        value: column(value),
        gradient: points(gradient),
        rate: column(rate),
    }
}

/// `V = x`.
fn expansion(x: &[[f64; 3]]) -> VelocityJet<Plain> {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].repeat(x.len());
    VelocityJet {
        value: points(x),
        jacobian: points::<Plain>(&identity).reshape([x.len(), 3, 3]),
        laplacian: Some(points(&vec![[0.0, 3.0, 0.0]; x.len()])),
        rate: Some(points(&vec![[0.0, 0.0, 2.0]; x.len()])),
    }
}

fn scalar(term: Tensor<Plain, 1>) -> f64 {
    host(term)[0]
}

#[track_caller]
fn assert_near(got: f64, wanted: f64) {
    // Means of at most three f32 numbers of size 1 to 10.
    assert!((got - wanted).abs() < 2e-5, "{got}, wanted {wanted}");
}

#[test]
fn the_terms_on_hand_worked_points() {
    assert_near(scalar(data::data(column(&[0.5, -1.5]))), 1.0);
    assert_near(scalar(eikonal::eikonal(column(&[1.0, 4.0]))), 4.5);
    let f = jet(
        &[0.0, 0.0],
        &[[2.0, 0.0, 0.0], [0.0, 3.0, 0.0]],
        &[0.0, 0.0],
    );
    let given = points(&[[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]);
    assert_near(scalar(normals::normals(&f, given)), 0.2);
    let (a, b) = (points(&[[2.0, 5.0, -1.0]]), points(&[[-1.0, 1.0, -1.0]]));
    assert_near(scalar(matching::matching(a.clone(), b.clone(), 0.0)), 5.0);
    for (scale, ratio) in [(2.5, 2.0f64), (5.0, 1.0), (20.0, 0.25)] {
        let robust = scale * ratio.powi(2) / (ratio.powi(2) + 1.0);
        assert_near(
            scalar(matching::matching(a.clone(), b.clone(), scale)),
            robust,
        );
    }
    let v = expansion(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    assert_near(scalar(divergence::divergence(&v)), 3.0);
    assert_near(scalar(strain::strain(&v, 0.0)), 3.0);
    assert_near(scalar(strain::strain(&v, 1.0)), 2.0);
    // D = I: V_t + D V = (0, 0, 2) + x.
    assert_near(scalar(screw::screw(&v)), (5.0 + 8.0) / 2.0);
    let along = expansion(&[[0.0, 0.0, 3.0]]);
    assert_near(scalar(screw::screw(&along)), 25.0);
    // V - 0.5 * (0, 3, 0): (1, -1.5, 0) and (0, 0.5, 0).
    assert_near(
        scalar(smoothness::smoothness(&v, 0.5, 1.0)),
        (3.25f64.sqrt() + 0.5) / 2.0,
    );
    // 2 V - 0.5 * (0, 3, 0): (2, -1.5, 0) and (0, 2.5, 0).
    assert_near(scalar(smoothness::smoothness(&v, 0.5, 2.0)), 2.5);
    // Two far away, off by 0.3 and 0.1, and one so near that the term says nothing.
    let (f, d) = (column(&[0.2, -0.3, 0.9]), column(&[-0.1, -0.4, 0.01]));
    assert_near(scalar(distance::distance(f, d)), 0.4 / 3.0);
    assert_near(
        scalar(off_surface::off_surface(column(&[0.0, -0.01]))),
        (1.0 + (-1.0f64).exp()) / 2.0,
    );
}

/// `V = (a y, 0, 0) + b (-y, x, 0)`: a shear along x and a turn about z.
fn shear_and_turn(a: f64, b: f64) -> VelocityJet<Plain> {
    let jacobian = [[0.0, a - b, 0.0], [b, 0.0, 0.0], [0.0; 3]];
    VelocityJet {
        value: points(&[[0.0; 3]]),
        jacobian: points::<Plain>(&jacobian).reshape([1, 3, 3]),
        laplacian: None,
        rate: None,
    }
}

#[test]
fn the_strain_of_a_shear_is_that_of_its_closed_form_and_a_turn_adds_nothing() {
    for turn in [0.0, 3.0] {
        let v = shear_and_turn(2.0, turn);
        // D has the entries 1 at (x, y) and (y, x).
        assert_near(scalar(strain::strain(&v, 0.0)), 2.0);
        assert_near(scalar(strain::strain(&v, 0.5)), 0.5 * (9f64.sqrt() - 1.0));
    }
}

#[test]
fn a_screw_costs_nothing_wherever_its_axis_is_and_a_change_of_its_pace_does() {
    // V = omega (e_3 x (x - c)) + s e_3 at a pace of 1 + a t, seen at t = 0.
    let (omega, slide, pace) = (1.5, 0.4, 0.6);
    let (x, c) = ([0.7, -0.2, 0.3], [0.1, 0.5, -0.2]);
    let value = [-omega * (x[1] - c[1]), omega * (x[0] - c[0]), slide];
    let jacobian = [[0.0, -omega, 0.0], [omega, 0.0, 0.0], [0.0; 3]];
    let jet = |pace: f64| VelocityJet::<Plain> {
        value: points(&[value]),
        jacobian: points::<Plain>(&jacobian).reshape([1, 3, 3]),
        laplacian: None,
        rate: Some(points(&[value.map(|v| v * pace)])),
    };
    assert_near(scalar(screw::screw(&jet(0.0))), 0.0);
    let speed: f64 = value.iter().map(|v| v * v).sum();
    assert_near(scalar(screw::screw(&jet(pace))), pace * pace * speed);
}

#[test]
fn an_expanding_sphere_solves_the_level_set_equation_with_lambda_one_and_no_other() {
    // f = |x| - exp(t), carried by V = x: an exact distance at every time.
    let (t, x) = (0.4f64, [[0.5, 0.0, 0.0], [0.0, 1.2, 0.9], [-2.0, 1.0, 2.0]]);
    let norm = |x: &[f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
    let value: Vec<f64> = x.iter().map(|x| norm(x) - t.exp()).collect();
    let gradient: Vec<[f64; 3]> = x.iter().map(|x| x.map(|c| c / norm(x))).collect();
    let f = jet(&value, &gradient, &[-t.exp(); 3]);
    let v = expansion(&x);
    let off: f64 = value.iter().map(|f| f.abs()).sum::<f64>() / 3.0;
    for (lambda, wanted) in [(1.0, 0.0), (0.0, off), (10.0, 9.0 * off)] {
        assert_near(scalar(level_set::level_set(&f, &v, lambda)), wanted);
    }
}

#[test]
fn the_level_set_equation_takes_the_stretch_along_the_normal_times_the_value() {
    // f = 0.5 with the normal e_x, V = (0.2, 0, 0) with dV_x / dx = 3: 0.2 - 0.5 * 3.
    let f = jet(&[0.5], &[[1.0, 0.0, 0.0]], &[0.0]);
    let v = VelocityJet::<Plain> {
        value: points(&[[0.2, 0.0, 0.0]]),
        jacobian: points::<Plain>(&[[3.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]).reshape([1, 3, 3]),
        laplacian: None,
        rate: None,
    };
    assert_near(scalar(level_set::level_set(&f, &v, 1.0)), 1.3);
}
