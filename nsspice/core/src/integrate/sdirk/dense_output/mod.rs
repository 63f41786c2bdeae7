//! Output points inside steps and at their ends.

pub(in crate::integrate::sdirk) mod interpolation;
pub(in crate::integrate::sdirk) mod limits;
pub(in crate::integrate::sdirk) mod polynomial;
pub(in crate::integrate::sdirk) mod rows;
pub(in crate::integrate::sdirk) mod source_outputs;
pub(in crate::integrate::sdirk) mod stored_outputs;
