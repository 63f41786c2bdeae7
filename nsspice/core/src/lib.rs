//! Compiled core of nsspice: complementarity solvers and time stepping.
#![warn(missing_docs)]

pub mod audit;
pub mod dense;
pub mod descriptor;
pub mod instant;
pub mod linear;
pub mod mlcp;
pub mod modewise;
pub mod moreau;
pub mod newton;
pub mod sparse;
pub mod steady;
pub mod structure;
pub mod switch;
pub mod tape;
pub mod waveform;

mod dominance;
mod format;
mod given;
mod pieces;
mod python;
mod resting;
mod rounding;
mod row_clock;
mod sampling;
mod sides;
mod union_find;
mod windings;
