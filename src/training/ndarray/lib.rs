//! Training on burn-ndarray: any CPU. The methods that isomorph is compared with run on burn-flex alone.

// The thrice lifted autodiff types nest deeper than the default limit allows.
#![recursion_limit = "256"]

use burn_autodiff::Autodiff;
use isomorph_training::engine::{Engine, On, OwnMethods};

/// The backend's engine.
pub fn engine() -> Box<dyn Engine> {
    Box::new(On::<Autodiff<burn_ndarray::NdArray>, OwnMethods>::new(
        Default::default(),
    ))
}
