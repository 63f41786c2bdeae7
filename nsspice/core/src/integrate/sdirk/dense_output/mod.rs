//! Output points inside steps and at their ends.

pub(in crate::integrate::sdirk) mod interpolation;
pub(in crate::integrate::sdirk) mod limits;
pub(in crate::integrate::sdirk) mod polynomial;
pub(in crate::integrate::sdirk) mod rows;
pub(in crate::integrate::sdirk) mod source_outputs;
pub(in crate::integrate::sdirk) mod stored_outputs;

/// The part of the tolerance that a polynomial between the points of steps may add to the error of an output: beside
/// what the steps err by themselves, a tenth does not show.
const NEAR: f64 = 0.1;
