//! The exact engine: between two switching instants a network of linear and set-valued elements is a linear system,
//! integrated in closed form; only the switching instants are searched for.
//!
//! A *mode* is a set of active pairs. Its equations are reduced to a minimal linear system in energy coordinates
//! ([`modes`]), of which [`spectra`] has eigenvalues and eigenvectors; a segment is a sum of exponentials ([`segments`],
//! of the terms in [`functions`]); guards (multipliers of active pairs, slacks of the others, controls of switches) are
//! bounded, and the next mode is proved before it is entered ([`events`]). Where nothing can be proved, implicit steps
//! continue. [`output`] writes rows, [`checks`] keeps points and the energies of all segments for the certificate.
//! Segments of large networks whose modes are hardly ever met again are polynomials instead ([`series`]).
//!
//! Read `run` first, the loop over segments, then the folders above in their order.  Imports: `dense`, `mlcp`, `instant`
//! and below; from `integrate` only failures and jumps, from `audit` only the records and energy sums that it fills.

pub mod checks;
pub mod events;
pub mod functions;
mod log;
pub mod modes;
pub mod output;
mod run;
mod run_state;
pub mod segments;
pub mod series;
pub mod spectra;

pub use functions::inputs::Inputs;
pub use modes::network::Assembly;
pub use modes::prepared::Prepared;
pub use output::passages::{Passage, Passed};
pub use run::Engine;
