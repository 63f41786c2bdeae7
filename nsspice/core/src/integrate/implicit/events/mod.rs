//! Switches and impacts during implicit steps.
//!
//! Read `gates` (which switches change at the present state), then `gate_search` (other switch states if these have no
//! solution) and `impacts` (a gap closes at speed).  Imports: the other parts of the implicit step.

pub(in crate::integrate) mod gate_search;
pub(in crate::integrate) mod gates;
pub(in crate::integrate) mod impacts;
pub(in crate::integrate) mod source_controlled;
pub(in crate::integrate) mod switching;
