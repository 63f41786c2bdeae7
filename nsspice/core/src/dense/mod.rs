//! Dense factorisations for small systems, and the least-norm solution of singular ones.

mod least_norm;
mod lu;
mod orthogonal;
#[cfg(test)]
mod tests;

pub use least_norm::LeastNorm;
pub use lu::DenseLu;
