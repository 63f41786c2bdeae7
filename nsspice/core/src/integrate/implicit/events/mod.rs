//! Gates of switches, and impacts inside a step.

pub(in crate::integrate) mod gate_search;
pub(in crate::integrate) mod gates;
pub(in crate::integrate) mod impacts;
pub(in crate::integrate) mod source_controlled;
pub(in crate::integrate) mod switching;
