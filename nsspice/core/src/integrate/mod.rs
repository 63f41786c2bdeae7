//! Integration in time, step by step.
//!
//! [`theta`] holds the implicit step (Moreau's time stepping) and what happens at instants at which something
//! jumps or switches react; [`sdirk`] adds stages of higher order, error control and located events.

mod sdirk;
mod theta;

pub use sdirk::{Accuracy, Sdirk, Tableau};
pub use theta::events::source_controlled::by_sources;
pub use theta::failure::Failure;
pub use theta::instants::jumps::Jump;
pub use theta::instants::values::to_zero;
pub use theta::outputs::{Outputs, Part};
pub use theta::samples::{Records, Samples};
pub use theta::statistics::Statistics;
pub use theta::step_length::System;
pub use theta::stepper::{Plan, Progress, Stepper};
pub use theta::time_grid::{Clock, Target};
