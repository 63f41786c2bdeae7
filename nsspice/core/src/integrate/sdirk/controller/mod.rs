//! Error estimates and the step sizes that follow from them; the stage equations of each size.
//!
//! Read `estimate` (the embedded formula), `errors` (norms and tolerances; `energies` for `accuracy=energy`), then
//! `step_matrices` and `stage_equations` (matrices kept for each size and mode).  Imports: the implicit step and its
//! matrices.

pub(in crate::integrate::sdirk) mod energies;
pub(in crate::integrate::sdirk) mod errors;
pub(in crate::integrate::sdirk) mod estimate;
pub(in crate::integrate::sdirk) mod guard_encoding;
pub(in crate::integrate::sdirk) mod node_errors;
pub(in crate::integrate::sdirk) mod stage_equations;
pub(in crate::integrate::sdirk) mod step_matrices;
pub(in crate::integrate::sdirk) mod winding_ratios;
