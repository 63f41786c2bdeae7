//! Smooth functions as straight-line programs, evaluated with their sparse derivatives.
//!
//! [`Program`] is the checked, immutable list of instructions together with the sparsity of all
//! derivatives, found once; [`Tape`] holds the numbers.  Derivatives run forward along with the values
//! (Griewank and Walther, *Evaluating Derivatives*, SIAM 2008, ch. 3 and 7), each register with
//! one slot for every variable it depends on, so that an evaluation allocates nothing.
//!
//! Read `program`, `evaluate` and `ops`; `group`, `lanes` and `block` evaluate several elements of one kind together.
//! Imports: nothing of circuits.

mod block;
mod curves;
mod evaluate;
mod functions;
mod group;
mod lanes;
mod limit;
mod ops;
mod parts;
mod program;
#[cfg(test)]
mod tests;

pub use evaluate::{Linearisation, Tape};
pub use ops::NAMES;
pub use program::Program;
