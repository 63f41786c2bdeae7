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
        let mut all = Vec::with_capacity(lu.lower.entries.len() + lu.upper.entries.len());
        by_level(lu.size(), lu.lower.entries.iter().filter(counts), &mut all);
        by_level(lu.size(), lu.upper.entries.iter().rev().filter(counts), &mut all);
        let entries = if lu.size() <= WINDOW {
            let places = all.iter().map(|e| [e.row as u16, e.column as u16]).collect();
            Entries::Narrow(places, all.iter().map(|e| e.value).collect())
        } else {
            Entries::Wide(all)
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

/// Appends the entries of a triangular factor, given in the order of elimination, so that those
/// whose columns are ready after the same number of eliminations follow each other: the processor
/// works on several at a time, while neighbours in a chain of eliminations wait for each other.
fn by_level<'a>(
    size: usize,
    entries: impl Iterator<Item = &'a Entry> + Clone,
    out: &mut Vec<Entry>,
) {
    let mut level = vec![0u32; size];
    let mut count = vec![0usize];
    for e in entries.clone() {
        let next = level[e.column as usize] + 1;
        level[e.row as usize] = level[e.row as usize].max(next);
        count.resize(count.len().max(next as usize + 1), 0);
        count[next as usize] += 1;
    }
    for k in 1..count.len() {
        count[k] += count[k - 1];
    }
    let begin = out.len();
    out.resize(begin + count[count.len() - 1], Entry::default());
    for e in entries {
        let place = &mut count[level[e.column as usize] as usize];
        out[begin + *place] = *e;
        *place += 1;
    }
}
