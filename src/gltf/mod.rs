//! Animated shapes as GLB, the binary form of glTF 2.0: data in, bytes out.
//!
//! | file | what it does |
//! |---|---|
//! | `builder.rs` | accessors over one buffer, and the container around it |
//! | `frame.rs` | where the numbers of a file lie in the coordinates of the input |
//! | `morph.rs` | [`morphing`]: one mesh whose vertices move, as morph targets |
//! | `sequence.rs` | [`in_turn`]: one mesh for each time, shown in turn |
//!
//! Source: the glTF 2.0 specification of the Khronos Group, and its extension KHR_mesh_quantization for
//! [`Precision::Compact`]. Coordinates are those of the input: glTF says that y points up, and nothing is turned
//! here.
//!
//! Time 0 to 1 becomes [`SECONDS`] seconds of animation.

mod builder;
mod frame;
mod morph;
mod sequence;
#[cfg(test)]
mod testing;

pub(crate) use builder::GltfError;
pub use builder::Precision;
pub(crate) use builder::check_size;
pub(crate) use morph::{Material, Morphing, Part, Texture, morphing, shown_colour};
pub(crate) use sequence::{Still, in_turn};
