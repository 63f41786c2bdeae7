//! Dense linear algebra for small systems: LU, least-norm solutions of singular systems, eigenvectors, divided
//! differences.
//!
//! Read `matrix` first, then `lu` and `least_norm`; `eigen`, `symmetric` and `rank_one` serve the exact engine,
//! `echelon` works on small integers.  No circuits here: imports are bounds of rounding, pivot rules and the type of
//! sparse matrices.

mod complete;
mod complex;
mod differences;
mod divided;
mod echelon;
mod eigen;
mod least_norm;
mod lu;
mod matrix;
mod orthogonal;
mod rank_one;
mod symmetric;
#[cfg(test)]
mod tests;
mod wide;

pub use complete::Complete;
pub use complex::{complex, Complex};
pub use differences::Differences;
pub use divided::{divided, pair, NODES};
pub use echelon::Echelon;
pub use eigen::{balance, eigen, Eigen};
pub use least_norm::LeastNorm;
pub use lu::DenseLu;
pub use matrix::{add_scaled, dot, equilibrate, larger, norm, Lu, Matrix};
pub use rank_one::RankOne;
pub use symmetric::eigen_symmetric;
pub use wide::{collapse, largest, largest_of_kinds, looks, polynomials};
pub(crate) use wide::{each, widest};
