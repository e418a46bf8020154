//! From the recipe's words to the model's types: in one place.

use isomorph_model::autodiff::activation::Activation;
use isomorph_model::flow::end_terms::EndWeights;
use isomorph_model::operators::Derivatives;
use isomorph_model::trajectory::{Integrator, Steps};
use isomorph_model::{ImplicitNetConfig, VelocityNetConfig};

use crate::recipe::{self, GeometryKind, LossRecipe, Recipe, TrainingRecipe};

/// Everything that shapes a step, in the model's types.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Where f comes from.
    pub geometry: GeometryKind,
    /// The Implicit-Net, or each of the two end fields.
    pub implicit: ImplicitNetConfig,
    /// The Velocity-Net.
    pub velocity: VelocityNetConfig,
    /// The weights of the objective.
    pub loss: LossRecipe,
    /// Steps, sampling and learning rates.
    pub training: TrainingRecipe,
    /// How derivatives are taken.
    pub derivatives: Derivatives,
    /// How trajectories are divided.
    pub steps: Steps,
    /// How trajectories are integrated.
    pub integrator: Integrator,
}

impl Settings {
    /// The settings that a recipe asks for.
    pub fn new(recipe: &Recipe) -> Self {
        let training = recipe.training.clone();
        Self {
            geometry: recipe.implicit.geometry,
            implicit: implicit(recipe),
            velocity: velocity(recipe),
            loss: recipe.loss.clone(),
            derivatives: training.derivatives,
            steps: match training.times {
                recipe::TimeSampling::Random => Steps::Even(training.time_steps),
                recipe::TimeSampling::Grid => Steps::Grid(training.time_steps),
            },
            integrator: training.integrator,
            training,
        }
    }

    /// Whether signed distances take part in a step.
    pub fn measures_distances(&self) -> bool {
        self.loss.distance > 0.0
    }
}

/// The weights of the terms at the ends.
pub fn end_weights(loss: &LossRecipe) -> EndWeights {
    EndWeights {
        // As where f is one network: the paper adds the means over the two shapes, and this is their mean.
        data: 2.0 * loss.data,
        normals: loss.normals,
        eikonal: loss.eikonal,
        off_surface: loss.off_surface,
        distance: loss.distance,
    }
}

/// The Implicit-Net of a recipe.
pub fn implicit(recipe: &Recipe) -> ImplicitNetConfig {
    let section = &recipe.implicit;
    ImplicitNetConfig {
        depth: section.depth,
        width: section.width,
        activation: activation(section.activation, section.beta),
        frequencies: section.frequencies,
        skip: section.skip,
        sphere_radius: section.sphere_radius,
    }
}

/// The Velocity-Net of a recipe.
pub fn velocity(recipe: &Recipe) -> VelocityNetConfig {
    let section = &recipe.velocity;
    VelocityNetConfig {
        depth: section.depth,
        width: section.width,
        activation: activation(section.activation, section.beta),
        frequencies: section.frequencies,
        skip: section.skip,
        time_dependent: section.time_dependent,
    }
}

fn activation(kind: recipe::Activation, beta: f64) -> Activation {
    match kind {
        recipe::Activation::Softplus => Activation::Softplus { beta },
        recipe::Activation::Sine => Activation::Sine { omega: beta },
    }
}
