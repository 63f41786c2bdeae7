//! State jumps: which charges and fluxes they lead to, and the values and rates at t+.
//!
//! Read `reinitialise` first (closed form from the structure of the network, or the derivative array where nothing jumps;
//! most instants and starts end there).  Where neither serves: `jumps` and `short_steps` (a step of length going to
//! zero), `jump_test` (jump or motion), `values` (the state at t+).  Imports: [`crate::instant`] and the parts of the
//! implicit step.

pub(in crate::integrate) mod algebraic;
pub(in crate::integrate) mod jump_test;
pub(in crate::integrate) mod jumps;
pub(in crate::integrate) mod reinitialise;
pub(in crate::integrate) mod short_steps;
pub(in crate::integrate) mod state_jumps;
pub(in crate::integrate) mod storage;
pub(in crate::integrate) mod time_constants;
pub(in crate::integrate) mod values;
