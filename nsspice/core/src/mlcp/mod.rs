//! Mixed linear complementarity problems: `K z + A l = b`, `w = q - B z + D l`, and per pair
//! `0 <= l` perpendicular to `w >= 0` (diode), `w = 0` (closed switch) or `l = 0` (open switch).
//!
//! [`Driver::solve`] tries, in this order, a warm active-set iteration, the proximal point method,
//! an interior point method and, for problems that are not monotone, Lemke's method or enumeration;
//! every solution is judged by the same scale-free [`Residual`].  Infeasibility is certified
//! outside, by a linear program.

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
