//! A factorisation copied for many solves: only the entries that count, in the order of their use,
//! with the scaling of the equations folded in.
//!
//! A third of the stored entries of a mode are zeros that wait for other modes; what multiplies the
//! current of a blocking pair does not count either.

use super::lu::Entry;
use super::SparseLu;

/// Indices of systems up to this size cannot leave a window of this length: then no bounds have to be
/// checked in the innermost loop, and an entry takes 12 bytes instead of 16.
const WINDOW: usize = 1 << 16;

/// What one permuted, scaled copy reads from or writes to.
#[derive(Clone, Copy, Debug)]
struct Place {
    index: u32,
    factor: f64,
}

/// The entries of both triangular factors in the order of their use.
#[derive(Clone, Debug)]
enum Entries {
    /// row and column, values
    Narrow(Vec<[u16; 2]>, Vec<f64>),
    Wide(Vec<Entry>),
}

/// `diag(columns) A^-1 diag(rows)` of a regular factorised matrix A.
#[derive(Clone, Debug)]
pub struct Packed {
    gather: Vec<Place>,
    entries: Entries,
    scatter: Vec<Place>,
}

impl Packed {
    /// Copies the factors of a regular matrix with the scale factors of its rows and columns.
    /// A row of the identity matrix whose right-hand side is always zero has the factor `None`.
    pub fn new(
        lu: &SparseLu,
        row: impl Fn(usize) -> Option<f64>,
        column: impl Fn(usize) -> f64,
    ) -> Packed {
        let factors: Vec<_> = lu.row.iter().map(|&r| row(r as usize)).collect();
        let counts = |e: &&Entry| e.value != 0.0 && factors[e.column as usize].is_some();
        let all = || lu.lower.entries.iter().chain(lu.upper.entries.iter().rev()).filter(counts);
        let entries = if lu.size() <= WINDOW {
            let places = all().map(|e| [e.row as u16, e.column as u16]).collect();
            Entries::Narrow(places, all().map(|e| e.value).collect())
        } else {
            Entries::Wide(all().copied().collect())
        };
        let places = lu.ordering.order.iter().zip(&lu.inverse);
        Packed {
            gather: (lu.row.iter().zip(&factors))
                .map(|(&index, f)| Place { index, factor: f.unwrap_or(0.0) })
                .collect(),
            entries,
            scatter: places
                .map(|(&c, inverse)| Place { index: c, factor: inverse * column(c as usize) })
                .collect(),
        }
    }

    /// Length of the work space that `solve` needs for so many unknowns.
    pub fn work_len(size: usize) -> usize {
        size.max(WINDOW)
    }

    /// `x := diag(columns) A^-1 diag(rows) x`; `work` holds at least `work_len` numbers.
    pub fn solve(&self, x: &mut [f64], work: &mut [f64]) {
        for (y, p) in work.iter_mut().zip(&self.gather) {
            *y = x[p.index as usize] * p.factor;
        }
        match &self.entries {
            Entries::Narrow(places, values) => {
                let y = work.first_chunk_mut::<WINDOW>().expect("work space of work_len");
                for (&[row, column], value) in places.iter().zip(values) {
                    y[row as usize] -= value * y[column as usize];
                }
            }
            Entries::Wide(entries) => {
                for e in entries {
                    work[e.row as usize] -= e.value * work[e.column as usize];
                }
            }
        }
        for (y, p) in work.iter().zip(&self.scatter) {
            x[p.index as usize] = y * p.factor;
        }
    }
}
