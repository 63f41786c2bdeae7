//! Sparse matrices and their factorisation.

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
