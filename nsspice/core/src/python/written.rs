//! Rows are handed out, and summed up: what reaches a table or a file must have the same sums.

use super::invalid;
use crate::integrate::Progress;
use crate::row_sums::weight;
use crate::switch::Turns;
use numpy::{PyReadonlyArray2, PyReadwriteArray2};
use pyo3::prelude::*;
use std::ops::Range;
use std::time::Duration;

/// time, switch, the gate before, its control, what the pair carried, whether the instant was searched for
pub(super) type TurnSpec = (f64, usize, bool, f64, f64, bool);

/// Gates that have turned.
pub(super) fn turn_specs(turns: &Turns) -> Vec<TurnSpec> {
    let kept = turns.kept.iter();
    kept.map(|t| (t.time, t.switch, t.gate, t.control, t.carried, t.located)).collect()
}

/// Number of rows, sums of their values and of the sizes of these, and what the values must add up to.
pub(super) type RowSumSpec = (u64, Vec<f64>, Vec<f64>, Vec<f64>);

/// What has been handed out.
#[derive(Default)]
pub(super) struct Written {
    /// somebody compares the sums
    wanted: bool,
    count: u64,
    signed: Vec<f64>,
    sizes: Vec<f64>,
}

impl Written {
    /// Sums up the rows that come.
    pub fn begin(&mut self) {
        self.wanted = true;
    }

    /// Takes the next rows.
    pub fn add(&mut self, table: &[f64], columns: usize) {
        self.add_part(table, columns, 1..columns);
    }

    /// Takes the times and some other columns of the next rows.
    fn add_part(&mut self, table: &[f64], columns: usize, part: Range<usize>) {
        if !self.wanted {
            return;
        }
        self.signed.resize(1 + part.len(), 0.0);
        self.sizes.resize(1 + part.len(), 0.0);
        for row in table.chunks_exact(columns) {
            let weight = weight(self.count);
            self.count += 1;
            self.signed[0] += weight * row[0];
            self.sizes[0] += weight * row[0].abs();
            let sums = self.signed[1..].iter_mut().zip(&mut self.sizes[1..]);
            for ((signed, size), value) in sums.zip(&row[part.clone()]) {
                let term = weight * value;
                *signed += term;
                *size += term.abs();
            }
        }
    }

    /// Number of rows, and sums of their values and of the sizes of these.
    pub fn sums(&self) -> (u64, Vec<f64>, Vec<f64>) {
        (self.count, self.signed.clone(), self.sizes.clone())
    }

    /// The same next to what they must be.
    pub fn sums_beside(&self, expected: Vec<f64>) -> RowSumSpec {
        let (count, signed, sizes) = self.sums();
        (count, signed, sizes, expected)
    }
}

/// Sums of some columns of a table.
#[pyclass(name = "ColumnSums", module = "nsspice._core")]
pub(super) struct PyColumnSums {
    inner: Written,
    part: Range<usize>,
}

#[pymethods]
impl PyColumnSums {
    /// Of the times and columns from one on.
    #[new]
    fn new(first: usize, count: usize) -> Self {
        let mut inner = Written::default();
        inner.begin();
        PyColumnSums { inner, part: first..first + count }
    }

    /// Takes the next rows of the table.
    fn add(&mut self, rows: PyReadonlyArray2<f64>) -> PyResult<()> {
        let view = rows.as_array();
        if view.ncols() < self.part.end.max(1) {
            return Err(invalid("the rows do not have these columns"));
        }
        let slice = view.as_slice().ok_or_else(|| invalid("the array must be contiguous"))?;
        self.inner.add_part(slice, view.ncols(), self.part.clone());
        Ok(())
    }

    /// Number of rows, and sums of their values and of the sizes of these.
    fn sums(&self) -> (u64, Vec<f64>, Vec<f64>) {
        self.inner.sums()
    }
}

/// Lets `advance` fill rows of `out` without the interpreter's lock; returns the number of rows and
/// 0 more, 1 done, 2 failed, 3 waiting for a source.
pub(super) fn fill(
    py: Python<'_>,
    mut out: PyReadwriteArray2<f64>,
    columns: usize,
    budget: f64,
    written: &mut Written,
    advance: impl FnOnce(&mut [f64], Duration) -> (usize, Progress) + Send,
) -> PyResult<(usize, u8)> {
    let mut view = out.as_array_mut();
    if view.ncols() != columns {
        return Err(invalid("the array needs one column for the time and one per output"));
    }
    let slice = view.as_slice_mut().ok_or_else(|| invalid("the array must be contiguous"))?;
    let budget = Duration::from_secs_f64(budget.clamp(1e-3, 60.0));
    let (rows, progress) = py.detach(move || {
        let (rows, progress) = advance(slice, budget);
        #[cfg(feature = "faults")]
        crate::faults::damage::written(&mut slice[..rows * columns], columns);
        written.add(&slice[..rows * columns], columns);
        #[cfg(feature = "faults")]
        crate::faults::damage::handed(&mut slice[..rows * columns], columns);
        (rows, progress)
    });
    let state = match progress {
        Progress::More => 0,
        Progress::Done => 1,
        Progress::Failed => 2,
        Progress::Waiting => 3,
    };
    Ok((rows, state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_in_another_order_have_another_sum() {
        let sums = |table: &[f64]| {
            let mut written = Written::default();
            written.begin();
            written.add(table, 2);
            written.sums()
        };
        let (count, signed, sizes) = sums(&[0.0, 8.0, 1.0, -16.0]);
        assert_eq!((count, signed, sizes), (2, vec![1.125, -10.0], vec![1.125, 26.0]));
        assert_ne!(sums(&[0.0, -16.0, 1.0, 8.0]).1, sums(&[0.0, 8.0, 1.0, -16.0]).1);
    }
}
