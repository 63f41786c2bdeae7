//! The network as a graph: what follows from which elements meet where, whatever their values are.

mod breakpoints;
mod parts;

pub use breakpoints::kinks_that_reach_storage;
pub use parts::Parts;
