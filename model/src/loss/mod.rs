//! The terms of the objective, one file each.
//!
//! Each file has the per-sample form `[n, 1]` first and the mean that enters the objective second.
//! Weights live in the recipe; where a term is not the paper's, its file says so.
//!
//! | file | term | paper |
//! |---|---|---|
//! | [`data`] | `|f|` on the given points at t = 0, 1 | `L_m`, first two parts |
//! | [`matching`] | `|phi(x_0, 1) - x_1|` over correspondences | `L_m`, last part |
//! | [`level_set`] | the (modified) level-set equation | `L_f`, MLSE and OLSE |
//! | [`eikonal`] | `(|grad f| - 1)^2` | implied, not printed |
//! | [`normals`] | `1 - <n, n_given>`, given or transported | optional |
//! | [`smoothness`] | `|(-alpha Laplacian + gamma) V|` | `L_v` |
//! | [`divergence`] | `|div V|` | `L_v` |
//! | [`strain`] | `|D|^2`, `D = (J + J^T) / 2` | ours |
//! | [`screw`] | `|dV/dt + D V|^2` | ours |
//! | [`distance`] | `|f - d|`, `d` the signed distance, away from the surface | ours |
//! | [`off_surface`] | `exp(-100 |f|)` | ours, after SIREN |

pub mod data;
pub mod distance;
pub mod divergence;
pub mod eikonal;
pub mod level_set;
pub mod matching;
pub mod normals;
pub mod off_surface;
pub mod screw;
pub mod smoothness;
pub mod strain;

#[cfg(test)]
mod tests;
