//! What a run leaves for those who check it: points of segments, and the energies of all of them.
//!
//! Read `samples` and `segment_points`, then `energy_balance` and `segment_energies`. Nothing is judged
//! here: see `audit`. Imports: `segments` and above, the run.

pub(in crate::modewise) mod energy_balance;
pub(in crate::modewise) mod gramian;
pub(in crate::modewise) mod modal_energies;
pub(in crate::modewise) mod samples;
pub(in crate::modewise) mod segment_energies;
pub(in crate::modewise) mod segment_points;
