//! Moreau time stepping of complementarity descriptor systems.
//!
//! ```text
//! (E/h + G + H) z1 + A l1 = (E/h + H) z0 + (S - Hs) u1 + Hs u0
//! w1 = q - B z1 + D l1,   0 <= l1  perp  w1 >= 0
//! ```
//!
//! H and Hs vanish for theta = 1; for theta < 1 they average the smooth rates of the states only,
//! while constraints and multipliers hold at the new time (Acary & Brogliato, *Numerical Methods
//! for Nonsmooth Dynamical Systems*, 2008, ch. 9).
//!
//! A [`State`](state::State) is plain data.  The [`Solver`](solver::Solver) finds the end of one step from it;
//! [state jumps](instants::state_jumps) and [gates](events::gates) see both; the [`Recorder`](recorder::Recorder)
//! writes rows and records.  The [`Stepper`](stepper::Stepper) combines them and visits the instants of its plan:
//! read it first.  Imports: as [`super`].

pub(super) mod affine_map;
pub(super) mod cached_step;
pub(super) mod events;
pub(super) mod failure;
pub(super) mod initial;
pub(super) mod instants;
pub(super) mod matrices;
pub(super) mod outputs;
pub(super) mod recorder;
pub(super) mod records;
pub(super) mod refine;
pub(super) mod samples;
pub(super) mod smooth;
pub(super) mod solver;
pub(super) mod state;
pub(super) mod statistics;
pub(super) mod step;
pub(super) mod step_length;
pub(super) mod stepper;
pub(super) mod time_grid;
