//! Sparse matrices and their factorisation.

mod csc;

pub use csc::Csc;
