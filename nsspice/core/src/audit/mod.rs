//! The laws of a circuit, checked at points of a run by code that shares nothing with its solvers.
//!
//! Every engine passes numbers: unknowns, multipliers, sources and the rates of its scheme.  The checks are
//!
//! ```text
//! rate of E z (and of stored functions) + G z + A lambda + F f = S u,   w = q - B z + D lambda,
//! 0 <= lambda  perp  w >= 0,   and the balance of the energy
//! ```
//!
//! element by element ([`flows`], [`form`]), each relative to the currents and voltages in it, or to those whose
//! rounding it carries ([`rounding`]).  No factor, map, scaling or residual of a solver is used.
//!
//! Read `form` (the equations as sums over elements), `laws` and `judge` (residuals and bounds), `sums` (energies),
//! then `gates` and `jumps`.  Imports: `descriptor`, `structure`, waveforms and tapes; no engine.

mod arrays;
mod branches;
mod flows;
mod form;
mod forward;
mod gates;
mod inductor_cut_sets;
mod intervals;
mod judge;
mod jumps;
mod laws;
mod matrix;
mod powers;
mod probe;
mod recorded;
mod rounding;
pub mod rows;
mod segment_points;
mod sources;
mod step_errors;
mod steps;
mod sums;

pub use gates::Gates;
pub use laws::Auditor;
pub use recorded::Taken;
pub use segment_points::{Segment, SegmentPoints};
pub use sources::{Described, Sources};
pub use step_errors::{Asked, ErringStep, Node, NODES, PLACES};
pub use steps::Steps;
pub use sums::{Balance, Points, Sums};

use crate::structure::{Coordinates, Edge};
pub use crate::tolerances::TOLERANCE;

/// The elements between nodes that matrices are sums of, and what the unknowns are.
#[derive(Clone, Copy)]
pub struct Between<'a> {
    /// terms of `E`
    pub capacitors: &'a [Edge],
    /// terms of `G`
    pub conductors: &'a [Edge],
    /// the voltages that are unknowns
    pub coordinates: &'a Coordinates,
}

/// Relative residual at which Newton's method ends in a step of fixed length: a hundredth of what a
/// step is accepted with, so that it is far below the error of a method of first order and above the
/// rounding of the functions (some units of 2e-16, times the slopes that they meet).  The stepper
/// iterates to it, and the checks count on it: a step with smooth laws is known no better.
pub const ITERATED: f64 = 1e-12;

/// Whether an error is worse than the worst so far; NaN is the worst of all.
pub(crate) fn worse(new: f64, old: f64) -> bool {
    !old.is_nan() && (new.is_nan() || new > old)
}

/// `error / scale`, 0 where the scale vanishes, NaN where either is no finite number.
pub(crate) fn ratio(error: f64, scale: f64) -> f64 {
    if !error.is_finite() || !scale.is_finite() {
        f64::NAN
    } else if scale > 0.0 {
        error / scale
    } else {
        0.0
    }
}
