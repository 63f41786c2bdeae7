//! The end of a mode inside a step: detected, located, and what follows it.

pub(in crate::integrate::sdirk) mod across_kinks;
pub(in crate::integrate::sdirk) mod at_threshold;
pub(in crate::integrate::sdirk) mod fallback;
pub(in crate::integrate::sdirk) mod guards;
pub(in crate::integrate::sdirk) mod locate;
pub(in crate::integrate::sdirk) mod restart;
