//! Segments of large switched networks from one sparse factorisation per mode.
//!
//! Node voltages and the currents of all branches with a law of their own are the unknowns of one matrix whose pattern
//! serves all modes ([`tableau`], with what [`normal_tree`] says of dependent states): a mode rewrites the rows of its
//! pairs.  From the states one solve gives everything else: enough to judge a candidate for the next mode by its signs
//! ([`scout`]), and, order by order, the Taylor coefficients of a segment ([`expansion`]).  What is watched, written and
//! integrated is a polynomial ([`polynomial`], [`motion`]).

pub mod expansion;
pub mod motion;
pub mod normal_tree;
pub mod polynomial;
pub mod quadrature;
pub mod scout;
pub mod tableau;
