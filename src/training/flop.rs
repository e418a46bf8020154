//! The floating point operations of a step's matrix products, counted from the shapes: what a step costs
//! on a machine that does nothing else.
//!
//! One *unit* is one evaluation of a network at its points. Each tracked product costs twice its own
//! operations again in the backward pass, one product for each operand.
//!
//! | part | units |
//! |---|---|
//! | jet of `f` | 2 (value, input gradient), tracked: 6 |
//! | jet of `V`, one forward sweep | 1 per lane (value, 3 tangents, Laplacian, rate), tracked: 3 per lane |
//! | jet of `V`, nested | 3 copies, forward and backward, tracked: 18 |
//! | the same with the Laplacian | 9 copies, forward, backward and backward of both, tracked: 108 |
//! | trajectory | 1 per evaluation, tracked: 3 |
//! | trajectory with normals, constant | 2 per evaluation |

use isomorph_model::operators::Derivatives;
use isomorph_model::trajectory::Integrator;

use crate::motion::{has_priors, needs_rate};
use crate::recipe::GeometryKind;
use crate::report::Phase;
use crate::samples::BatchSizes;
use crate::settings::Settings;

/// The operations of one step in a phase.
///
/// `keys`: how many key frames the data has.
pub fn per_step(settings: &Settings, sizes: BatchSizes, keys: usize, phase: Phase) -> f64 {
    let unit_f = settings.implicit.mlp().flop_per_point();
    let unit_v = settings.velocity.mlp().flop_per_point();
    let loss = &settings.loss;
    let trains_v = phase != Phase::ImplicitOnly;
    let trains_f = phase != Phase::WarmUp;
    let stages = match settings.integrator {
        Integrator::Euler => 1,
        Integrator::Midpoint => 2,
        Integrator::Rk4 => 4,
    };
    let evaluations = (settings.steps.count() * stages) as f64;
    let carried = (keys * sizes.carried) as f64;
    let matched = 2.0 * sizes.matched as f64;
    let collocation = (sizes.band + sizes.uniform) as f64;

    let flow = settings.geometry == GeometryKind::Flow;
    let tracked = match (trains_v, flow) {
        (false, _) => 0.0,
        (true, true) if loss.on_surface > 0.0 => matched + carried,
        (true, false) if trains_f => matched + carried,
        (true, _) => matched,
    };
    let with_normals = trains_f && loss.transported_normals > 0.0;
    let constants = match flow {
        true if trains_v && has_priors(loss) => carried * evaluations,
        true => 0.0,
        false if with_normals => 2.0 * carried * evaluations,
        // The tracked trajectories serve as constants as well.
        false if trains_v && trains_f => 0.0,
        false => carried * evaluations,
    };
    let coupled = trains_f && loss.level_set > 0.0 && !flow;
    let jet = match (trains_v, coupled) {
        (true, wanted) if wanted || has_priors(loss) => jet_units(settings, true),
        (false, true) => jet_units(settings, false),
        _ => 0.0,
    };
    let of_v = constants + 3.0 * tracked * evaluations + jet * collocation;
    let of_f = match (flow, trains_f) {
        // The value where points arrive, derived by their places alone.
        (true, _) => 6.0 * settings.training.batch as f64 + 2.0 * (tracked - matched).max(0.0),
        (false, true) => 6.0 * ((keys * sizes.ends) as f64 + carried + collocation),
        (false, false) => 0.0,
    };
    unit_v * of_v + unit_f * of_f
}

/// Evaluations of `V` that its jet at one point costs.
fn jet_units(settings: &Settings, tracked: bool) -> f64 {
    let loss = &settings.loss;
    let laplacian = tracked && loss.smoothness > 0.0 && loss.smoothness_alpha > 0.0;
    let rate = tracked && needs_rate(loss) && settings.velocity.time_dependent;
    match (settings.derivatives, laplacian) {
        (Derivatives::Forward, _) => {
            let lanes = 4.0 + f64::from(u8::from(laplacian)) + f64::from(u8::from(rate));
            if tracked { 3.0 * lanes } else { lanes }
        }
        (Derivatives::Nested, true) => 108.0,
        (Derivatives::Nested, false) => {
            if tracked {
                18.0
            } else {
                6.0
            }
        }
    }
}
