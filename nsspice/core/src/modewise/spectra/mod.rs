//! Eigenvalues and eigenvectors of a mode to the last digit, also where they meet or lie far apart.
//!
//! Read `spectrum`, then `cluster` and `block` (double rates), `scales` and `sharpen` (stiff ones).
//! Imports: `functions`, `dense`.

pub(in crate::modewise) mod block;
pub(in crate::modewise) mod cluster;
pub(in crate::modewise) mod orthogonal;
pub(in crate::modewise) mod scales;
pub(in crate::modewise) mod sharpen;
pub mod spectrum;
