//! Tests of the driver on circuits and on random problems with known answers.

mod circuits;
mod degenerate;
mod random;
