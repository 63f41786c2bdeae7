//! Compiled core of nsspice: complementarity problems, exact segments and implicit steps of circuits given as arrays.
//!
//! Read in this order: [`descriptor`] and [`switch`] (what is solved), [`mlcp`] (one complementarity problem),
//! [`modewise`] (the exact engine), [`integrate`] (steps), [`audit`] (the check of both).  Imports point one way:
//! [`dense`] and [`sparse`], [`tape`] and [`waveform`] know nothing of circuits; [`structure`] and [`mlcp`] come next,
//! then [`newton`] and [`instant`], then the engines; [`steady`] uses the exact engine, `python` uses everything.
#![warn(missing_docs)]

#[macro_use]
mod faults;

pub mod audit;
pub mod dense;
pub mod descriptor;
pub mod instant;
pub mod integrate;
pub mod linear;
pub mod mlcp;
pub mod modewise;
pub mod newton;
pub mod sparse;
pub mod steady;
pub mod structure;
pub mod switch;
pub mod tape;
pub mod waveform;

mod at_threshold;
mod dominance;
mod format;
mod limits;
mod perfect_coupling;
mod pieces;
mod pivots;
mod python;
mod rounding;
mod row_clock;
mod row_sums;
mod sampling;
mod source_determined;
mod tolerances;
mod union_find;
