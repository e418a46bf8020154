//! Training on burn-flex: CPUs, with the faster matrix products. All methods run here.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

use burn_autodiff::Autodiff;
use isomorph_training::engine::{AllMethods, Engine, On};

/// The backend's engine.
pub fn engine() -> Box<dyn Engine> {
    Box::new(On::<Autodiff<burn_flex::Flex>, AllMethods>::new(
        Default::default(),
    ))
}
