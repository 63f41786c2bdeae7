//! The end of a mode inside a step: detected, located, and followed by the next mode.
//!
//! Read `guards` (what ends a mode), `locate` (when), `restart` (the next mode); `across_kinks` steps across changes
//! that are smooth enough, `fallback` and `at_threshold` handle the exceptions.  Imports: the implicit step, and the
//! stages of `sdirk`.

pub(in crate::integrate::sdirk) mod across_kinks;
pub(in crate::integrate::sdirk) mod at_threshold;
pub(in crate::integrate::sdirk) mod fallback;
pub(in crate::integrate::sdirk) mod guards;
pub(in crate::integrate::sdirk) mod locate;
pub(in crate::integrate::sdirk) mod restart;
