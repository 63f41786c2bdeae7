//! Singly diagonally implicit Runge-Kutta methods with error control and located events.
//!
//! Between two events the mode (which pairs conduct) is fixed, and a step is a few implicit stages with one matrix
//! `E/(gamma h) + G`.  The guards - multipliers of conducting pairs, slacks of the others, distances of switches to
//! their thresholds - are watched at the stages, at the output rows and between them; where one becomes negative,
//! each stage uses the mode that its laws require if the error stays small, otherwise the step is cut at the root
//! on its continuous solution, and the complementarity problem of a short implicit step finds the next mode.  Step
//! sizes are powers of two of the longest one, so that matrices are seldom factorised; a step that would end beyond
//! a breakpoint of a source is cut there.
//!
//! Where modes change so fast that nothing can be located (accumulations), single implicit steps with
//! complementarity step across it; switches that chatter are sampled.
//!
//! References: R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006; E. Hairer, G. Wanner, *Solving
//! Ordinary Differential Equations II* (1996), sections IV.6 and VII; C. A. Kennedy, M. H. Carpenter,
//! Appl. Numer. Math. 146 (2019) 221.
//!
//! Read `run` (the loop), `step` (the stages), `controller`, `events`, `dense_output`.  Imports: [`super::implicit`],
//! whose state, solver and jumps it uses, and what that imports.

mod combine;
mod controller;
mod counters;
mod dense_output;
mod events;
mod predict;
mod quadrature_points;
mod records;
mod residual_checks;
mod run;
mod samples;
mod step;
mod tableau;
mod visited;

pub use run::Sdirk;
pub use tableau::Tableau;

/// What is asked of a run.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// error of a step relative to the size of each unknown; 1 or more: fixed steps
    pub relative: f64,
    /// error of a step that is always allowed [V]
    pub voltage: f64,
    /// the same for currents [A]
    pub current: f64,
    /// errors are measured as energies where something is stored
    pub energy: bool,
}
