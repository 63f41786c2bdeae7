//! How a run depends on its beginning, exactly: periodic orbits, their response to small signals, and the
//! Fourier coefficients of what moves on them.
//!
//! A run of the mode-wise engine leaves its *passages*: segments in closed form with the events between
//! them. [`orbit`] derives the variation across each event (saltation matrix) and along each segment
//! ([`modal`]); [`response`] solves for the perturbation of a periodic orbit at one frequency; [`sensitivity`] for that by a parameter;
//! [`margins`] tells how far its modes reach; [`fourier`] integrates outputs along it, and [`commutation`] tells their values on both sides of each event. All integrals are divided differences of the exponential
//! ([`exponentials`]), in which neither a slow mode nor a resonance cancels digits.
//!
//! References: R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
//! (Springer, 2004), section 7; T. J. Aprille, T. N. Trick, "Steady-state analysis of nonlinear circuits
//! with periodic inputs", Proc. IEEE 60 (1972), doi:10.1109/PROC.1972.8563.

pub mod commutation;
pub mod exponentials;
pub mod fourier;
pub mod linear;
pub mod margins;
pub mod modal;
pub mod orbit;
pub mod response;
pub mod sensitivity;

pub use orbit::Orbit;
