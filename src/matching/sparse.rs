//! Matrices of which most entries are 0, and the exponential that makes their entries.

use std::ops::Range;

use rayon::prelude::*;

/// Rows that one core takes at a time.
pub(super) const ROWS: usize = 32;

/// Entries of a row while they are collected.
#[derive(Default)]
pub(super) struct Row {
    pub columns: Vec<u32>,
    pub values: Vec<f32>,
    pub exponents: Vec<f32>,
}

/// `exp(-x)` for x from 0 to 80, to a few roundings.
///
/// `2^t` of `t = -x / ln 2` is `2^n 2^f` with `n` whole and `|f|` at most 1/2, where the Taylor series of
/// `exp(f ln 2)` to the sixth power is within 2e-7. Every step is one instruction for several numbers at
/// once, which the function of the system's library is not.
#[inline]
fn exp_minus(x: f32) -> f32 {
    // Adding 1.5 * 2^23 leaves no bits behind the point.
    const WHOLE: f32 = 12_582_912.0;
    let t = -x * std::f32::consts::LOG2_E;
    let shifted = t + WHOLE;
    let f = (t - (shifted - WHOLE)) * std::f32::consts::LN_2;
    let series = 1.0
        + f * (1.0
            + f * (0.5
                + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0))))));
    // n is in the lowest bits of the shifted number, and the exponent begins at bit 23.
    f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// The entries of a matrix that are not 0, row by row.
pub(super) struct Sparse {
    /// Where each row begins; one more than rows.
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f32>,
}

impl Sparse {
    /// The matrix with `exp(-e)` of the exponents that `row` appends to what it is given.
    pub(super) fn by_rows(rows: usize, row: impl Fn(usize, &mut Row) + Sync) -> Self {
        let blocks: Vec<(Vec<u32>, Row)> = (0..rows.div_ceil(ROWS))
            .into_par_iter()
            .map(|block| {
                let mut entries = Row::default();
                let rows = block * ROWS..rows.min((block + 1) * ROWS);
                let ends = rows.map(|k| {
                    row(k, &mut entries);
                    entries.columns.len() as u32
                });
                let ends = ends.collect();
                for value in &mut entries.values {
                    *value = exp_minus(*value);
                }
                (ends, entries)
            })
            .collect();
        let count = blocks.iter().map(|block| block.1.columns.len()).sum();
        let mut all = Self {
            starts: vec![0],
            columns: Vec::with_capacity(count),
            values: Vec::with_capacity(count),
        };
        for (ends, block) in blocks {
            let first = all.columns.len() as u32;
            all.starts.extend(ends.into_iter().map(|end| first + end));
            all.columns.extend(block.columns);
            all.values.extend(block.values);
        }
        all
    }

    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn run(&self, row: usize) -> Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    pub(super) fn columns(&self, row: usize) -> &[u32] {
        &self.columns[self.run(row)]
    }

    pub(super) fn values(&self, row: usize) -> &[f32] {
        &self.values[self.run(row)]
    }

    /// The same matrix by columns, of which there are so many.
    pub(super) fn transposed(&self, columns: usize) -> Self {
        let mut starts = vec![0; columns + 1];
        for &column in &self.columns {
            starts[column as usize + 1] += 1;
        }
        for k in 0..columns {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut rows = vec![0; self.columns.len()];
        let mut values = vec![0.0; self.columns.len()];
        for row in 0..self.len() {
            for (&column, &value) in self.columns(row).iter().zip(self.values(row)) {
                let place = &mut next[column as usize];
                rows[*place as usize] = row as u32;
                values[*place as usize] = value;
                *place += 1;
            }
        }
        Self {
            starts,
            columns: rows,
            values,
        }
    }

    /// `1 / (K x + slack)`.
    pub(super) fn scalings(&self, x: &[f32], slack: f32) -> Vec<f32> {
        let scaling = |row: usize| {
            let (columns, values) = (self.columns(row), self.values(row));
            // Four sums side by side: one alone waits for each addition.
            let mut sums = [0.0_f32; 4];
            let (columns, last_columns) = columns.as_chunks::<4>();
            let (values, last_values) = values.as_chunks::<4>();
            for (columns, values) in columns.iter().zip(values) {
                for k in 0..4 {
                    sums[k] += values[k] * x[columns[k] as usize];
                }
            }
            for (k, (&column, value)) in last_columns.iter().zip(last_values).enumerate() {
                sums[k] += value * x[column as usize];
            }
            (sums[0] + sums[1] + (sums[2] + sums[3]) + slack).recip()
        };
        let rows = (0..self.len()).into_par_iter();
        rows.with_min_len(ROWS).map(scaling).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_hold_the_same_entries() {
        // Two blocks of rows, with an empty row and an empty column.
        let rows = ROWS + 3;
        let matrix = Sparse::by_rows(rows, |k, row| {
            for column in (0..5).filter(|column| k != 7 && (k + column) % 3 == 0 && *column != 2) {
                row.columns.push(column as u32);
                row.values.push((k + column) as f32 * 0.1);
            }
        });
        let columns = matrix.transposed(5);
        assert_eq!((matrix.len(), columns.len()), (rows, 5));
        let mut count = 0;
        for column in 0..5 {
            for (&k, value) in columns.columns(column).iter().zip(columns.values(column)) {
                let k = k as usize;
                assert_eq!(*value, exp_minus((k + column) as f32 * 0.1));
                assert!(matrix.columns(k).contains(&(column as u32)));
                count += 1;
            }
        }
        assert_eq!(count, matrix.values.len());
        assert!(matrix.columns(7).is_empty() && columns.columns(2).is_empty());
        // 1 / (sum + slack) of the rows, in which the sums run four at a time.
        let scalings = matrix.scalings(&[1.0, 2.0, 3.0, 4.0, 5.0], 0.5);
        for (k, scaling) in scalings.iter().enumerate() {
            let terms = matrix.columns(k).iter().zip(matrix.values(k));
            let sum: f32 = terms
                .map(|(&column, value)| value * (column + 1) as f32)
                .sum();
            // Few terms in another order: roundings of float32.
            assert!((scaling * (sum + 0.5) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_exponential_is_that_of_the_library() {
        for k in 0..=8000_u16 {
            let x = f32::from(k) * 0.01;
            let expected = (-f64::from(x)).exp();
            // The series ends at 2e-7; x / ln 2 is rounded in the sixth digit behind the point at 80.
            let tolerance = 3e-7 * (1.0 + f64::from(x));
            let off = (f64::from(exp_minus(x)) / expected - 1.0).abs();
            assert!(off < tolerance, "{x}: {off}");
        }
    }
}
