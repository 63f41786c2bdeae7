//! Integration in time, step by step.
//!
//! Read [`implicit`] first: one implicit step (Moreau's time stepping), and what happens at instants at which
//! something jumps or switches react.  [`sdirk`] builds on it: stages of higher order, error control and located
//! events.  Imports: `mlcp`, `newton`, `instant`, `structure` and below; from `audit` only the records and energy
//! sums that it fills.

mod implicit;
mod sdirk;

pub use implicit::events::source_controlled::by_sources;
pub use implicit::failure::Failure;
pub use implicit::instants::jumps::Jump;
pub use implicit::instants::values::to_zero;
pub use implicit::outputs::{Outputs, Part};
pub use implicit::samples::{Records, Samples};
pub use implicit::statistics::Statistics;
pub use implicit::step_length::System;
pub use implicit::stepper::{Plan, Progress, Stepper};
pub use implicit::time_grid::{Clock, Target};
pub use sdirk::{Accuracy, Sdirk, Tableau};
