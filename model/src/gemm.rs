//! The matrix product over plain memory, by the `gemm` crate: the one file of this workspace with `unsafe`.
//!
//! The crate has an interface of pointers only. What makes the calls here sound: each operand is a slice
//! whose length is checked against its shape, the strides are those of that shape, and the result is a new
//! vector of exactly `m n` elements, all of which the crate writes (`read_dst = false`).
#![allow(unsafe_code)]

/// Products of fewer operations than this are not divided between cores; that of burn-flex.
const DIVIDED: usize = 192 * 192 * 192;

/// A matrix in memory.
#[derive(Clone, Copy, Debug)]
pub struct Matrix<'a> {
    elements: &'a [f32],
    rows: usize,
    columns: usize,
    by_columns: bool,
}

impl<'a> Matrix<'a> {
    /// A matrix whose elements follow each other row by row.
    ///
    /// # Panics
    /// If there are not `rows columns` of them.
    pub fn by_rows(elements: &'a [f32], rows: usize, columns: usize) -> Self {
        assert_eq!(
            elements.len(),
            rows * columns,
            "elements of {rows} x {columns}"
        );
        Self {
            elements,
            rows,
            columns,
            by_columns: false,
        }
    }

    /// A matrix whose elements follow each other column by column: the transpose of one by rows.
    ///
    /// # Panics
    /// If there are not `rows columns` of them.
    pub fn by_columns(elements: &'a [f32], rows: usize, columns: usize) -> Self {
        Self {
            by_columns: true,
            ..Self::by_rows(elements, rows, columns)
        }
    }

    /// From one column to the next, and from one row to the next.
    fn strides(&self) -> (isize, isize) {
        if self.by_columns {
            (self.rows as isize, 1)
        } else {
            (1, self.columns as isize)
        }
    }
}

/// `a b`, row by row.
///
/// # Panics
/// If `a` has not as many columns as `b` has rows.
pub fn product(a: Matrix<'_>, b: Matrix<'_>) -> Vec<f32> {
    assert_eq!(
        a.columns, b.rows,
        "columns of the left matrix and rows of the right one"
    );
    let (m, k, n) = (a.rows, a.columns, b.columns);
    if m * n == 0 || k == 0 {
        return vec![0.0; m * n];
    }
    let parallelism = if m * k * n < DIVIDED || rayon::current_num_threads() == 1 {
        gemm::Parallelism::None
    } else {
        gemm::Parallelism::Rayon(0)
    };
    let mut out: Vec<f32> = Vec::with_capacity(m * n);
    let ((a_columns, a_rows), (b_columns, b_rows)) = (a.strides(), b.strides());
    // SAFETY: the operands have `m k` and `k n` elements, as their constructors checked, and the strides
    // reach no other; `out` has room for `m n`, all of which are written and none read, so they are
    // initialised when the length is set.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            out.as_mut_ptr(),
            1,
            n as isize,
            false,
            a.elements.as_ptr(),
            a_columns,
            a_rows,
            b.elements.as_ptr(),
            b_columns,
            b_rows,
            0.0,
            1.0,
            false,
            false,
            false,
            parallelism,
        );
        out.set_len(m * n);
    }
    out
}
