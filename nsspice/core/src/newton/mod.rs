//! Josephy-Newton for complementarity systems with smooth nonlinear terms:
//!
//! ```text
//! (rate E + G) z + (F + rate Q) f(z, u, t) + A l = rhs
//! w = q - B z + D l,   0 <= l  perp  w >= 0
//! ```
//!
//! with `rate = 0` for static problems, `1/h` for an implicit Euler step, `1/(gamma h)` for a stage of
//! a diagonally implicit method.  Every iteration linearises f and solves a mixed linear
//! complementarity problem (N. H. Josephy, *Newton's method for generalized equations*, MRC 1965,
//! 1979; A. L. Dontchev, R. T. Rockafellar, *Implicit Functions and Solution Mappings*, Springer
//! 2014, ch. 6): first in the present mode with one factorisation, which is all that a system
//! without pairs needs; where its signs disagree by an active-set iteration; where that cycles or
//! the mode is singular by the complementarity driver.
//!
//! # For another integrator
//!
//! [`Newton::set_rate`] chooses `rate` (matrices of the last few rates are kept), [`Newton::solve`]
//! solves one stage; the caller forms `rhs`, with [`Newton::stored`] for the charges
//! `E z0 + Q f(z0)` of the old state.  [`Newton::values`] are the functions at the solution.
//!
//! Read `solve` (the iteration), `equations` and `residuals` (what it solves), `convergence`; `homotopy` and `driver`
//! help where it fails, `path` and `euler_newton` follow solutions.  Imports: `tape`, `mlcp`, `structure` and below;
//! no engine.

mod advance;
mod combined;
mod contradiction;
mod convergence;
mod cycling;
mod direct;
mod divergence;
mod driver;
mod equations;
mod euler_newton;
mod homotopy;
mod linear;
mod path;
mod rates;
mod residuals;
mod slopes;
mod solve;
mod state;
mod stored;
#[cfg(test)]
mod tests;

pub use equations::Equations;
pub use euler_newton::{Data, Tracking};
pub use path::{Path, Points, Problem};
pub use solve::{Newton, Solved, Unsolved};
pub use stored::StoredFunction;
