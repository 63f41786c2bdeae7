//! What all solvers of the core accept, and what is none beside the rest of a network.

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
