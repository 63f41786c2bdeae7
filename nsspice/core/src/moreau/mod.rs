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

mod clock;
mod controls;
mod failure;
mod gates;
mod impacts;
mod instant;
mod jumps;
mod map;
mod matrices;
mod motion;
mod record;
mod records;
mod refine;
mod reinitialise;
mod sdirk;
mod search;
mod smooth;
mod stage;
mod start;
mod step;
mod stepper;
mod storage;
mod times;
mod turns;
mod values;
mod witness;

pub use clock::{Clock, Target};
pub use controls::by_sources;
pub use failure::Failure;
pub use jumps::Jump;
pub use record::{Outputs, Part};
pub use sdirk::{Accuracy, Sdirk, Tableau};
pub use stage::System;
pub use stepper::{Plan, Progress, Statistics, Stepper};
pub use values::to_zero;
pub use witness::{Records, Witness};
