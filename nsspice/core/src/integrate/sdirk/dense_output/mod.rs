//! Output points inside steps and at their ends.
//!
//! Read `interpolation` (stored quantities between the ends), `rows` (all signals at the output points), `polynomial`
//! (long steps with many points); `limits` gives both sides of a jump.  Imports: the stages of `sdirk` and the
//! implicit outputs.

pub(in crate::integrate::sdirk) mod interpolation;
pub(in crate::integrate::sdirk) mod limits;
pub(in crate::integrate::sdirk) mod polynomial;
pub(in crate::integrate::sdirk) mod rows;
pub(in crate::integrate::sdirk) mod source_outputs;
pub(in crate::integrate::sdirk) mod stored_outputs;
