//! Consistent reinitialisation: charges, fluxes, currents and voltages just after an instant at which something may
//! jump.
//!
//! A sequence of problems, each a mixed complementarity problem in the coordinates of its own forest:
//!
//! 1. *charges*: capacitors and closed branches alone, `C (v+ - v-)` against the impulses of one-way branches;
//! 2. *fluxes*, the dual: inductors and open branches, `(1/L) (flux+ - flux-)` against the impulses of potentials;
//! 3. *values*: capacitors are voltage sources, inductors current sources, resistors and one-way branches the rest;
//! 4. *rates of fluxes*: potentials of parts that only inductors and blocking branches join, where the rates
//!    `v / L` balance, with the one-way branches that carry nothing yet;
//! 5. *rates of charges*, the dual: `C v'` against the currents, with the one-way branches that block nothing;
//! 6. *shares*: the smallest currents where ideal pairs lie side by side.
//!
//! The first two are independent: by Minty's theorem (Monotone networks, Proc. R. Soc. A 257, 1960) a network of
//! monotone branches has a solution if voltages and currents are feasible separately.  They are the projections of
//! Moreau's law of impacts, in the norm of the energy.  No step length enters anywhere.
//!
//! Coupled inductors are ideal transformers between windings and cores.  Those without leakage take part in 1, 3
//! and 5 as well, since their fluxes do not determine their currents.
//!
//! Read `reinitialise` (the sequence), `network_builder` and `active_set` (one problem), then `stored`, `values` and
//! `rates`; `continuous` is the case in which nothing can jump, `derivative_array` the same with functions and with
//! an index of 2.  Imports: `structure`, `mlcp`, `newton` and below; it knows neither engine.

mod active_set;
mod continuous;
mod derivative_array;
mod eigenbasis;
mod network_builder;
mod rates;
mod reinitialise;
mod shared;
mod stored;
mod successors;
#[cfg(test)]
mod tests;
mod values;

pub use active_set::{solve, Mixed, OneWay};
pub use continuous::{At, Continuous};
pub use derivative_array::{DerivativeArray, Moment};
pub use reinitialise::{Before, Consistent, Reinitialiser};
