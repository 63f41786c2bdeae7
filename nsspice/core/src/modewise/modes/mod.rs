//! From a network and a set of active pairs to a minimal linear system with its guards and outputs.
//!
//! Read `network` (what no mode changes), `staircase` (what algebra determines), `mode`, then
//! `neighbour` and `registry`. Imports: `spectra` and `functions`; `mlcp` for `implicit_step`.

pub(in crate::modewise) mod align;
pub mod error_carrying;
pub(in crate::modewise) mod guard_rows;
pub mod implicit_step;
pub(in crate::modewise) mod input_power;
pub(in crate::modewise) mod least_norm;
pub mod mode;
pub mod neighbour;
pub mod network;
pub mod outputs;
pub mod prepared;
pub mod registry;
pub mod staircase;
