//! What a run hands on: rows of the table, limits at jumps, polynomials, passages.
//!
//! Read `rows` and `limits`; `expected_rows` is what rows must add up to. Imports: `segments` and
//! above, the run.

pub(in crate::modewise) mod block_outputs;
pub(in crate::modewise) mod expected_rows;
pub(in crate::modewise) mod inspect;
pub(in crate::modewise) mod limits;
pub(in crate::modewise) mod passages;
pub(in crate::modewise) mod pieces;
pub(in crate::modewise) mod rows;
