//! Consistent reinitialisation: what charges, fluxes, currents and voltages are right after an instant at which
//! something may jump.
//!
//! Four problems in a row, each one mixed complementarity problem in the coordinates of its own forest:
//!
//! 1. *charges*: capacitors and closed branches alone, `C (v+ - v-)` against the impulses of one-way branches;
//! 2. *fluxes*: the dual, inductors and open branches;
//! 3. *values*: capacitors are voltage sources, inductors current sources, resistors and one-way branches the rest;
//! 4. *rates*: `C v'` against the currents, with the one-way branches that neither carry nor block anything yet.
//!
//! The first two are apart: by Minty's theorem (Monotone networks, Proc. R. Soc. A 257, 1960) a network of
//! monotone branches has a solution if voltages and currents are feasible each by themselves.  They are the
//! projections of Moreau's law of impacts, in the norm of the energy.  No length of a step enters anywhere.

mod mixed;
mod reinitialise;

pub use mixed::{solve, Mixed, OneWay};
pub use reinitialise::{Before, Consistent, Reinitialiser};
