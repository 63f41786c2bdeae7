//! How a run depends on its initial state, exactly: periodic orbits, their response to small signals, and Fourier
//! coefficients along them.
//!
//! A run of the mode-wise engine leaves its *passages*: segments in closed form with the events between them.
//! [`orbit`] derives the variation across each event (saltation matrix) and along each segment ([`modal`]);
//! [`response`] solves for the perturbation of a periodic orbit at one frequency; [`adjoint`] for the derivatives of
//! a functional ([`goal`]) by all parameters; [`margins`] finds how far the initial state may move before the modes
//! change; [`fourier`] integrates outputs along the orbit, and [`commutation`] gives their values on both sides of
//! each event. All integrals are divided differences of the exponential ([`exponentials`]), in which neither a slow
//! mode nor a resonance cancels digits.
//!
//! References: R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
//! (Springer, 2004), section 7; T. J. Aprille, T. N. Trick, "Steady-state analysis of nonlinear circuits
//! with periodic inputs", Proc. IEEE 60 (1972), doi:10.1109/PROC.1972.8563.
//!
//! Read [`orbit`], [`modal`], [`response`].  Imports: the exact engine ([`crate::modewise`]) and dense algebra.

pub mod adjoint;
mod adjoint_interval;
pub mod commutation;
pub mod exponentials;
pub mod fourier;
pub mod goal;
pub mod linear;
pub mod margins;
pub mod modal;
pub mod orbit;
pub mod response;

pub use adjoint::Driver;
pub use goal::{Goal, Limit};
pub use orbit::Orbit;
