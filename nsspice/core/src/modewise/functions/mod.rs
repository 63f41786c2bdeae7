//! The functions of time of which inputs and segments are made.
//!
//! Read `inputs`, then `terms`. Imports: `dense`, `waveform`.

pub(in crate::modewise) mod exponential;
pub mod inputs;
pub mod terms;
