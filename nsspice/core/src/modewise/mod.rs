//! The exact engine: between two switchings a network of linear elements and set-valued ones is a
//! linear system, integrated in closed form; only the instants of switching are searched for.
//!
//! A *mode* is a set of active pairs. Its equations are reduced to a minimal linear system in energy
//! coordinates ([`network`], [`staircase`], [`mode`], turned by [`align`] where resistances differ by many
//! digits); a segment is a sum of exponentials
//! ([`trajectory`]); guards (multipliers of active pairs, slacks of the others, controls of switches)
//! are watched by bounds ([`march`]), and the mode that follows is proved before it is entered
//! ([`pick`], [`verify`]). Energies of segments are added up ([`tally`]) by following each once more
//! ([`retrace`]). Where nothing can be proved, implicit steps go on ([`fixed`]).

mod align;
mod block;
pub mod bundle;
mod cluster;
mod course;
mod crowd;
mod exponential;
mod fixed;
mod gramian;
mod guard_rows;
mod handed;
mod impact;
pub mod implicit;
pub mod inputs;
mod inspect;
mod log;
pub mod march;
pub mod mode;
pub mod neighbour;
pub mod network;
mod orthogonal;
pub mod outputs;
pub mod pick;
mod pieces;
mod place;
pub mod prepared;
pub mod registry;
mod rest;
mod retrace;
mod rows;
mod run;
mod scales;
mod share;
mod sharpen;
mod sides;
mod single;
pub mod spectrum;
mod spread;
pub mod staircase;
mod stride;
mod structured;
mod supply;
mod tally;
pub mod terms;
mod trace;
pub mod tracked;
pub mod trajectory;
pub mod verify;
mod witness;

pub use inputs::Inputs;
pub use network::Assembly;
pub use prepared::Prepared;
pub use run::Engine;
pub use trace::{Passage, Passed};
