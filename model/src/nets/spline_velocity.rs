//! A velocity field of B-splines as a module: `V(x, t) = sum_n sum_k c[n, k] B_n(x) T_k(t)`.
//!
//! The same field as [`SplineField`] of the package `isomorph-spline`, in operations that autodiff follows to
//! the coefficients, the points and the times. `B_n` are tensor products of quadratic B-splines, `T_k` the
//! Legendre polynomials `1` and `2 t - 1`. At the part `u` of a cell, with `v = 1 - u`, an axis has
//!
//! ```text
//! weights  v^2 / 2    1/2 + u v    u^2 / 2
//! slopes   -v         1 - 2 u      u           by u; by the place, over the spacing
//! bends    1          -2           1           twice by u
//! ```
//!
//! A point outside the box has the velocity of the nearest point in it. There V does not change along the axes on
//! which the point was moved. V has one continuous derivative. The second jumps at the faces of cells.
//!
//! The 27 nodes of each point are selected as rows, `[n, 27, 3 K]`, and a product with `[n, rows, 27]` weights
//! gives the value and all derivatives. The gradient by the coefficients adds rows up where they came from.

use burn::module::{Module, Param, ParamId};
use burn::tensor::backend::Backend;
use burn::tensor::{Bool, Int, Tensor, TensorData};
use isomorph_spline::{SplineError, SplineField, TimeBasis};

use super::spline_grid::{GridOf, SplineGrid};

/// Nodes of a cell along an axis.
const SUPPORT: usize = 3;
/// Nodes of a cell.
const NODES: usize = SUPPORT * SUPPORT * SUPPORT;

/// The field `V(x)` or `V(x, t)`.
#[derive(Module, Debug)]
pub struct SplineVelocity<B: Backend> {
    /// `[nodes, 3 K]`, the node of the third axis fastest; K functions of time.
    coefficients: Param<Tensor<B, 2>>,
    grid: GridOf<B>,
}

/// Which derivatives a sum over nodes has beside the value: so many rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rows {
    /// None: 1 row.
    Value,
    /// Those along the axes: 4 rows.
    Slopes,
    /// These and the sum of the second ones: 5 rows.
    Laplacian,
}

/// The cell of each point, and where in it the point lies.
struct Place<B: Backend> {
    /// The 27 nodes of each point, `[27 n]`.
    nodes: Tensor<B, 1, Int>,
    /// The part of the cell on each axis, `[n, 3]`, 0 to 1.
    part: Tensor<B, 2>,
    /// How the part changes with the place: one over the spacing, 0 on axes that were left; `[n, 3]`.
    scale: Tensor<B, 2>,
}

impl<B: Backend> SplineVelocity<B> {
    /// The same field as a module.
    pub fn from_field(field: &SplineField, device: &B::Device) -> Self {
        let columns = 3 * field.time_basis().functions();
        let values = field.coefficients();
        let shape = [values.len() / columns, columns];
        let tensor = Tensor::from_data(TensorData::new(values, shape), device);
        Self {
            // Numbered like the parameters of networks.
            coefficients: Param::initialized(ParamId::from(1), tensor.require_grad()),
            grid: SplineGrid::from(*field.grid()).into(),
        }
    }

    /// The field that is zero, on a grid.
    ///
    /// # Errors
    /// If the grid is none, or has too many nodes.
    pub fn at_rest(
        grid: SplineGrid,
        basis: TimeBasis,
        device: &B::Device,
    ) -> Result<Self, SplineError> {
        let field = SplineField::at_rest_on(grid.of_field(), basis)?;
        Ok(Self::from_field(&field, device))
    }

    /// The same field as the package `isomorph-spline` has it, with the same numbers.
    ///
    /// # Errors
    /// If coefficients are not finite, or not those of the grid.
    pub fn to_field(&self) -> Result<SplineField, SplineError> {
        let values: Vec<f32> = self.coefficients.val().into_data().iter().collect();
        SplineField::from_parts(self.grid.grid.of_field(), self.time_basis(), &values)
    }

    /// The grid.
    pub fn grid(&self) -> &SplineGrid {
        &self.grid.grid
    }

    /// The functions of time.
    pub fn time_basis(&self) -> TimeBasis {
        match self.coefficients.dims()[1] {
            3 => TimeBasis::Constant,
            _ => TimeBasis::Linear,
        }
    }

    /// `V(x, t)`.
    ///
    /// # Shapes
    /// `x`: `[n, 3]`, normalised; `t`: `[n, 1]`, in `[0, 1]`, unused by a stationary field; result
    /// `[n, 3]`, normalised units per unit of time.
    pub fn forward(&self, x: Tensor<B, 2>, t: Tensor<B, 2>) -> Tensor<B, 2> {
        let [n, _] = x.dims();
        at_time(self.sums(x, Rows::Value), t).reshape([n, 3])
    }

    /// The sums over the nodes: of the value, and of the derivatives that `rows` has; `[n, rows, 3 K]`.
    pub(crate) fn sums(&self, x: Tensor<B, 2>, rows: Rows) -> Tensor<B, 3> {
        let [n, _] = x.dims();
        let place = self.place(x);
        let weights = weights(&place.part, &place.scale, rows);
        let columns = self.coefficients.dims()[1];
        let nodes = self.coefficients.val().select(0, place.nodes);
        weights.matmul(nodes.reshape([n, NODES, columns]))
    }

    fn place(&self, x: Tensor<B, 2>) -> Place<B> {
        let ([n, _], device) = (x.dims(), x.device());
        let inverse = 1.0 / self.grid().spacing;
        let cells = self.grid().cells.map(|count| count as f32);
        let lower = Tensor::<B, 1>::from_floats(self.grid().lower, &device).unsqueeze::<2>();
        let end = Tensor::<B, 1>::from_floats(cells, &device).unsqueeze::<2>();
        let s = (x - lower) * inverse;
        // Not a number counts as below, as in the field itself.
        let below: Tensor<B, 2, Bool> = s.clone().greater_equal_elem(0.0).bool_not();
        let above = s.clone().greater(end.clone());
        let outside = below.clone().bool_or(above.clone());
        let scale = outside.bool_not().float() * inverse;
        let zeros = Tensor::zeros([n, 3], &device);
        let inside = s
            .mask_where(below, zeros)
            .mask_where(above, end.clone().expand([n, 3]));
        // The last place belongs to the last cell. Whole numbers have no gradient.
        let cell = inside.clone().int();
        let cell = cell.clone() - cell.greater_equal(end.int()).int();
        let part = inside - cell.clone().float();
        Place {
            nodes: self.nodes(cell),
            part,
            scale,
        }
    }

    /// The numbers of the 27 nodes of each cell, `[27 n]`.
    fn nodes(&self, cell: Tensor<B, 2, Int>) -> Tensor<B, 1, Int> {
        let ([n, _], device) = (cell.dims(), cell.device());
        let [_, ny, nz] = self.grid().nodes().map(|count| count as i32);
        let strides = [ny * nz, nz, 1];
        let along = |offset: usize| (offset / 9) as i32 * strides[0] + (offset / 3 % 3) as i32 * nz;
        let offsets: Vec<i32> = (0..NODES)
            .map(|offset| along(offset) + (offset % 3) as i32)
            .collect();
        let offsets = Tensor::<B, 1, Int>::from_ints(&offsets[..], &device).unsqueeze::<2>();
        let strides = Tensor::<B, 1, Int>::from_ints(strides, &device).unsqueeze::<2>();
        let first = (cell * strides).sum_dim(1);
        (first + offsets).reshape([NODES * n])
    }
}

/// The sum over the functions of time, `[n, rows, 3 K]` to `[n, rows, 3]`.
pub(crate) fn at_time<B: Backend>(sums: Tensor<B, 3>, t: Tensor<B, 2>) -> Tensor<B, 3> {
    let [n, rows, columns] = sums.dims();
    if columns == 3 {
        return sums;
    }
    let of = |k: usize| sums.clone().slice([0..n, 0..rows, 3 * k..3 * k + 3]);
    of(0) + of(1) * (t * 2.0 - 1.0).reshape([n, 1, 1])
}

/// The weights of the 27 nodes, and of the rows that `rows` has, `[n, rows, 27]`; `part` and `scale` `[n, 3]`.
fn weights<B: Backend>(part: &Tensor<B, 2>, scale: &Tensor<B, 2>, rows: Rows) -> Tensor<B, 3> {
    let [n, _] = part.dims();
    let u = || part.clone();
    let v = -u() + 1.0;
    let by_node = |of: [Tensor<B, 2>; SUPPORT]| Tensor::stack::<3>(of.to_vec(), 2);
    // [n, axis, node of the axis]
    let plain = by_node([v.clone() * v.clone() * 0.5, u() * v + 0.5, u() * u() * 0.5]);
    let axis = |of: &Tensor<B, 3>, k: usize| of.clone().slice([0..n, k..k + 1, 0..SUPPORT]);
    let plane = |x: Tensor<B, 3>, y: Tensor<B, 3>| {
        let x = x.reshape([n, SUPPORT, 1]);
        (x * y).reshape([n, SUPPORT * SUPPORT, 1])
    };
    let row = |plane: Tensor<B, 3>, z: Tensor<B, 3>| (plane * z).reshape([n, 1, NODES]);
    let [x, y, z] = [0, 1, 2].map(|k| axis(&plain, k));
    let xy = plane(x.clone(), y.clone());
    let mut out = vec![row(xy.clone(), z.clone())];
    if rows == Rows::Value {
        return out.remove(0);
    }
    let scale = scale.clone().reshape([n, 3, 1]);
    let slopes = by_node([u() - 1.0, -(u() * 2.0) + 1.0, u()]) * scale.clone();
    let along = |of: &Tensor<B, 3>| {
        [
            row(plane(axis(of, 0), y.clone()), z.clone()),
            row(plane(x.clone(), axis(of, 1)), z.clone()),
            row(xy.clone(), axis(of, 2)),
        ]
    };
    out.extend(along(&slopes));
    if rows == Rows::Laplacian {
        let bends = Tensor::<B, 1>::from_floats([1.0, -2.0, 1.0], &part.device());
        let bends = bends.reshape([1, 1, SUPPORT]) * (scale.clone() * scale);
        let [by_x, by_y, by_z] = along(&bends);
        out.push(by_x + by_y + by_z);
    }
    Tensor::cat(out, 1)
}
