//! What a run by `sdirk` consists of: plain records of what belongs together.

use super::dense_output::interpolation::Between;
use super::dense_output::limits::PointRows;
use super::dense_output::rows::Origin;
use super::dense_output::stored_outputs::StoredRows;
use super::events::across_kinks::Patience;
use super::events::fallback::Fallback;
use super::samples::Samples;
use super::{Accuracy, Tableau};
use crate::integrate::implicit::failure::Failure;
use crate::row_clock::RowClock;
use crate::sampling::Sampling;

/// What is asked of a run.
pub struct Settings {
    /// coefficients of steps that continue others
    pub(super) method: &'static Tableau,
    /// errors of a step
    pub(super) accuracy: Accuracy,
    /// begin of the run [s]
    pub(super) start: f64,
    /// end of the run [s]
    pub(super) stop: f64,
}

/// Rows and records of the steps.
pub struct Shown {
    /// when they are due
    pub(super) rows: RowClock,
    /// at the ends of steps
    pub(super) points: PointRows,
    /// of the certificate
    pub(super) samples: Samples,
    /// where the rows of the present step come from, once that has been found out
    pub(super) origin: Option<Origin>,
    /// of stored quantities
    pub(super) stored: StoredRows,
    /// by polynomials
    pub(super) between: Between,
}

/// What decides about lengths of steps.
pub struct Control {
    /// of the next step: so many halves of the longest
    pub(super) level: usize,
    /// length and error of the last step that was free to grow
    pub(super) last_error: (f64, f64),
    /// the unknown that errs most in the trial step
    pub(super) erring: usize,
    /// unknowns whose error is that of their rates, in the step estimated last
    pub(super) tied: Vec<bool>,
    /// the first that no step could follow, and when
    pub unbounded: Option<(usize, f64)>,
    /// whether steps over ends of modes are worth a trial
    pub(super) patience: Patience,
}

/// What keeps a run from going on as usual: events that accumulate, switches that find no state.
pub struct Trouble {
    /// the last event did not end the mode
    pub(super) futile: bool,
    /// when the last guard was violated [s]
    pub(super) troubled: f64,
    /// when gates have last turned because their controls rest [s], and how often at that instant
    pub(super) rests: (f64, usize),
    /// a switch has found no state after the last event
    pub(super) restless: Option<Box<Failure>>,
    /// what keeps the time from moving
    pub(super) fallback: Fallback,
    /// switches that chatter
    pub(super) sampling: Sampling,
}
