//! One segment in closed form: its trajectory, functionals along it, and the first guard that fails.
//!
//! Read `trajectory`, `bundle`, `root_bracketing`; `spread`, `stride` and `single` evaluate many rows
//! fast. Imports: `modes` and above.

pub mod bundle;
pub mod root_bracketing;
pub(in crate::modewise) mod single;
pub(in crate::modewise) mod spread;
pub(in crate::modewise) mod stride;
pub mod trajectory;
