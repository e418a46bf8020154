//! Phases and terms, as they are reported to whoever watches the training.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A stretch of training in which the same networks and terms take part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Only the Velocity-Net trains.
    WarmUp,
    /// Both train, the Velocity-Net towards a velocity field that is there already.
    Guided,
    /// Both train; the weight of the coupled terms of f grows.
    Ramp,
    /// Both train with full weights.
    Joint,
    /// The Velocity-Net is done; only the Implicit-Net trains.
    ImplicitOnly,
    /// A method it is compared with: what is fitted at t = 0 and t = 1.
    Ends,
    /// A method it is compared with: what lies between, the ends being done.
    Between,
    /// A method it is compared with: what moves points.
    Motion,
}

impl fmt::Display for Phase {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::WarmUp => "velocity warm-up",
            Self::Guided => "guided",
            Self::Ramp => "ramp",
            Self::Joint => "joint",
            Self::ImplicitOnly => "implicit only",
            Self::Ends => "ends",
            Self::Between => "between",
            Self::Motion => "motion",
        })
    }
}

/// One term of the objective at one step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermReport {
    /// Its name, as in the recipe's `[loss]`.
    pub name: &'static str,
    /// Its value before the weight.
    pub raw: f64,
    /// What it adds to the total.
    pub weighted: f64,
}

/// The learning rates of a step; 0 for what the method does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Of what gives the surface.
    pub implicit: f64,
    /// Of what moves points.
    pub velocity: f64,
}
