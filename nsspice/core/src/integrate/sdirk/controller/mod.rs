//! Errors of steps and the lengths that follow from them; the stage equations of each length.

pub(in crate::integrate::sdirk) mod energies;
pub(in crate::integrate::sdirk) mod errors;
pub(in crate::integrate::sdirk) mod estimate;
pub(in crate::integrate::sdirk) mod guard_encoding;
pub(in crate::integrate::sdirk) mod node_errors;
pub(in crate::integrate::sdirk) mod stage_equations;
pub(in crate::integrate::sdirk) mod step_matrices;
pub(in crate::integrate::sdirk) mod winding_ratios;
