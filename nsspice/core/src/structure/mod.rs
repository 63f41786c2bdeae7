//! The network as a graph: what follows from which elements meet where, and coordinates that serve for any
//! values.

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
