//! Large switched networks followed from one state to the next without spectra.
//!
//! Candidates for the next mode are judged by the signs of one sparse solution ([`scout`], with one matrix for all modes:
//! [`tableau`]).  Where all pairs have resistances, what is stored is known and the rest are potentials of a network of
//! conductances ([`nodal`], [`layout`], [`stars`]; [`normal_tree`] says which states follow from others): order by order, that gives
//! the Taylor coefficients of a segment ([`expansion`], [`supply`]).  What is watched ([`motion`], [`watch`]), written
//! and integrated are polynomials ([`polynomial`], [`quadrature`]).  [`run`] and [`points`] are their part of the engine.

pub mod expansion;
mod layout;
pub mod motion;
pub mod nodal;
pub mod normal_tree;
mod points;
pub mod polynomial;
pub mod quadrature;
pub(super) mod run;
pub mod scout;
pub mod stars;
pub mod supply;
pub mod tableau;
pub mod watch;
