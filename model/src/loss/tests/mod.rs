//! Each term on hand-worked points, and the gradient of each against differences of its values.

mod gradients;
mod values;
