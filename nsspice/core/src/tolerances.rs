//! What all solvers of the core accept, and what is negligible next to the rest of a network.

/// Largest relative residual of an accepted solution: a hundredth of what the certificate grants (`audit::TOLERANCE`),
/// and a thousand times what rounding leaves of one (`rounding::OF_SOLUTION`).
pub const ACCEPT: f64 = 1e-10;

/// An equation is judged against its own terms, but not against less than this part of the largest of its kind: what is
/// rounded to [`crate::rounding::UNIT`] of those is then missed by less than [`ACCEPT`], and equations in which nothing
/// flows do not turn rounding into failure.
pub const FLOOR: f64 = 1e-6;

/// Changes below this part of the largest charge (flux, voltage) are no jump: ten times what an equation of an accepted
/// solution may be off by, a tenth of what the certificate grants.
pub const NO_JUMP: f64 = 1e-9;

/// What is to be clearly less than another quantity, or to agree with it, is so to a decade: no such comparison then
/// hangs on the factor of two or three by which norms, estimates of errors and weights are uncertain.
pub const CLEARLY: f64 = 0.1;

/// An iteration makes progress while a round leaves no more than this part of what was there: ten digits then
/// take some thirty rounds, about as many as are granted.
pub const PROGRESS: f64 = 0.5;

/// A run whose relative errors stay below this passes.
pub const TOLERANCE: f64 = 1e-8;

/// Ratio of rates or of sizes whose larger part, rounded as a solution is, leaves the smaller one known no better than
/// the certificate asks.
pub const LOST_BEYOND: f64 = TOLERANCE / crate::rounding::OF_SOLUTION;
