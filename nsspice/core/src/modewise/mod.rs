//! The exact engine: between two switching instants a network of linear and set-valued elements is a linear system,
//! integrated in closed form; only the switching instants are searched for.
//!
//! A *mode* is a set of active pairs. Its equations are reduced to a minimal linear system in energy coordinates
//! ([`network`], [`staircase`], [`mode`], rotated by [`align`] where resistances differ by many digits); a segment
//! is a sum of exponentials ([`trajectory`]); guards (multipliers of active pairs, slacks of the others, controls
//! of switches) are bounded ([`root_bracketing`]), and the next mode is proved before it is entered ([`successor`],
//! [`verify`]). The energies of all segments are summed ([`energy_balance`]) by following each once more
//! ([`segment_energies`]). Where nothing can be proved, implicit steps continue ([`implicit_steps`]).
//! Segments of large networks whose modes are hardly ever met again are polynomials instead ([`series`]).
//!
//! Read `run` first, the loop over segments, then the files above in their order.  Imports: `dense`, `mlcp`, `instant`
//! and below; from `integrate` only failures and jumps, from `audit` only the records and energy sums that it fills.

mod accumulation;
mod align;
mod at_threshold;
mod block;
mod block_outputs;
pub mod bundle;
mod cluster;
mod energy_balance;
pub mod error_carrying;
mod expected_rows;
mod exponential;
mod gramian;
mod guard_rows;
mod impact;
pub mod implicit_step;
mod implicit_steps;
mod input_power;
pub mod inputs;
mod inspect;
mod least_norm;
mod limits;
mod log;
mod modal_energies;
pub mod mode;
pub mod neighbour;
pub mod network;
mod orthogonal;
pub mod outputs;
mod passages;
mod pieces;
pub mod prepared;
pub mod registry;
pub mod root_bracketing;
mod rows;
mod run;
mod run_state;
mod samples;
mod scales;
mod segment_energies;
mod segment_points;
pub mod series;
mod sharpen;
mod single;
pub mod spectrum;
mod spread;
pub mod staircase;
mod stride;
mod structured;
pub mod successor;
pub mod terms;
pub mod trajectory;
pub mod verify;

pub use inputs::Inputs;
pub use network::Assembly;
pub use passages::{Passage, Passed};
pub use prepared::Prepared;
pub use run::Engine;
