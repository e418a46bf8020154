//! What needs the machine itself: the one file of this workspace with `unsafe`.
//!
//! | what | why | what it saves |
//! |---|---|---|
//! | [`product`] | the `gemm` crate has an interface of pointers only | burn-ndarray's own products run at a quarter of its rate |
//! | [`without_denormals`] | a register of the processor decides what becomes of numbers below 1e-38 | a fifth of a step at 8 layers, four fifths at 12 |
//!
//! `model/benches/README.md` has the measurements.
#![allow(
    unsafe_code,
    reason = "the one place that talks to the processor and to gemm: see above"
)]

/// Runs `job` with numbers too small for a normal `f32`, below 1.2e-38, taken for 0 on this thread.
///
/// Processors work on such numbers a hundred times more slowly than on others, and the slopes of a softplus
/// far to the left, multiplied from layer to layer, are full of them. XLA and PyTorch do the same.
pub fn without_denormals<T>(job: impl FnOnce() -> T) -> T {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    // SAFETY: the compiler takes the register for unchanged, so what it works out beforehand may keep a number
    // that the processor would take for 0, or the reverse; a job may not depend on numbers below 1e-38, and
    // none here does. The register is put back at the end, also when `job` panics.
    return unsafe { no_denormals::no_denormals(job) };
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    job()
}

#[cfg(any(feature = "ndarray", feature = "flex"))]
/// Products of fewer operations than this are not divided between cores; that of burn-flex.
const DIVIDED: usize = 192 * 192 * 192;

#[cfg(any(feature = "ndarray", feature = "flex"))]
/// A matrix in memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matrix<'a> {
    elements: &'a [f32],
    rows: usize,
    columns: usize,
    by_columns: bool,
}

#[cfg(any(feature = "ndarray", feature = "flex"))]
impl<'a> Matrix<'a> {
    /// A matrix whose elements follow each other row by row.
    ///
    /// # Panics
    /// If there are not `rows columns` of them.
    pub(super) fn by_rows(elements: &'a [f32], rows: usize, columns: usize) -> Self {
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
    pub(super) fn by_columns(elements: &'a [f32], rows: usize, columns: usize) -> Self {
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

#[cfg(any(feature = "ndarray", feature = "flex"))]
/// `a b`, row by row.
///
/// # Panics
/// If `a` has not as many columns as `b` has rows.
pub(super) fn product(a: Matrix<'_>, b: Matrix<'_>) -> Vec<f32> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn denormals_are_zero_inside_and_only_there() {
        let half = || std::hint::black_box(f32::MIN_POSITIVE) * std::hint::black_box(0.5);
        assert!(half() > 0.0);
        assert_eq!(without_denormals(half), 0.0);
        assert!(half() > 0.0, "the register is put back");
        let _ = std::panic::catch_unwind(|| without_denormals(|| panic!("a job that fails")));
        assert!(half() > 0.0, "after a panic too");
    }

    #[cfg(any(feature = "ndarray", feature = "flex"))]
    #[test]
    #[should_panic(expected = "elements of 2 x 3")]
    fn a_matrix_of_another_size_than_it_says_is_refused() {
        Matrix::by_rows(&[0.0; 5], 2, 3);
    }
}
