//! Mixed linear complementarity problems: `K z + A l = b`, `w = q - B z + D l`, and per pair
//! `0 <= l` perpendicular to `w >= 0` (diode), `w = 0` (closed switch) or `l = 0` (open switch).
//!
//! [`Driver::solve`] tries, in this order, a warm active-set iteration, the proximal point method, an interior
//! point method and, for problems that are not monotone, Lemke's method or enumeration; every solution is judged by
//! the same scale-free [`Residual`].  Infeasibility is proved outside, by a linear program.
//!
//! Read `problem` (what is solved), `driver` (the order of the methods), `active_set` (what solves nearly all
//! problems), then `contraction` (underdetermined modes).  Imports: dense and sparse algebra, tolerances; nothing of
//! circuits or time.

mod active_set;
mod cache;
mod contraction;
mod driver;
mod equilibrate;
mod exhaustive;
mod interior;
mod lemke;
mod model;
mod modes;
mod pivoting;
mod polish;
mod problem;
mod proximal;
mod residual;
mod scratch;
#[cfg(test)]
mod tests;

pub use driver::{Driver, Solved, Unsolved};
pub(crate) use equilibrate::equilibrate;
pub(crate) use model::Model;
pub use modes::{work_len, ModeFactor};
pub use problem::{Problem, Role, Start};
pub use residual::Residual;
