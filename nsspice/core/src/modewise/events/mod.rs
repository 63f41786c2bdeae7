//! Which mode follows, proved before it is entered, and what is done where nothing can be proved.
//!
//! Read `successor` and `verify`; then `at_threshold`, `accumulation`, `impact` and `implicit_steps`.
//! Imports: `segments` and above, the run that they are a part of.

pub(in crate::modewise) mod accumulation;
pub(in crate::modewise) mod at_threshold;
pub(in crate::modewise) mod impact;
pub(in crate::modewise) mod implicit_steps;
pub(in crate::modewise) mod structured;
pub mod successor;
pub mod verify;
