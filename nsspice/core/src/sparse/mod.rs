//! Sparse matrices and their LU factorisation, with updates for a few changed columns and refactorisation on old
//! pivots.
//!
//! Read `csc` (the matrix), `order` and `dissection` (fill-reducing orderings), `lu` and `factor` (left-looking,
//! partial pivoting), then `refactor`.  No circuits here: imports are bounds of rounding, tolerances and pivot rules.

mod csc;
mod dissection;
mod factor;
mod graph;
mod lu;
mod order;
mod packed;
mod placement;
mod refactor;

#[cfg(test)]
pub(crate) mod examples;
#[cfg(test)]
mod tests;

pub use csc::Csc;
pub use lu::SparseLu;
pub use order::Ordering;
pub use packed::Packed;
pub use refactor::Extent;
