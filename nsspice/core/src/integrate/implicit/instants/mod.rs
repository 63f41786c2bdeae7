//! State jumps: which charges and fluxes they lead to, and the values and rates at t+.

pub(in crate::integrate) mod algebraic;
pub(in crate::integrate) mod jump_test;
pub(in crate::integrate) mod jumps;
pub(in crate::integrate) mod reinitialise;
pub(in crate::integrate) mod short_steps;
pub(in crate::integrate) mod state_jumps;
pub(in crate::integrate) mod storage;
pub(in crate::integrate) mod time_constants;
pub(in crate::integrate) mod values;
