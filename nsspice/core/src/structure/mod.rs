//! The network as a graph: what follows from how elements are connected, and coordinates that suit any element values.
//!
//! Read `elements` (branches read back from the matrices), `basis` (spanning forest, loops and cut-sets as integers),
//! `hybrid` (equations in tree voltages and link currents); `coordinates` converts between tree and node voltages.
//! Imports: `descriptor`, dense and sparse algebra; nothing that steps in time.

mod basis;
mod breakpoints;
mod coordinates;
mod coupled;
mod elements;
mod hybrid;
mod parts;
#[cfg(test)]
mod tests;

pub use basis::Basis;
pub use breakpoints::kinks_that_reach_storage;
pub use coordinates::{Coordinates, Edge};
pub use coupled::Coupled;
pub use elements::{Branch, Elements};
pub use hybrid::{Flow, Hybrid, Law, Network, Turns, SUMS};
pub use parts::Parts;
