//! Rows at equal distances inside a segment: exponentials for the first of some rows, one
//! multiplication for each of the others.

use super::terms::{Point, Term};
use super::trajectory::Trajectory;
use crate::dense::{complex, Complex};
use std::collections::HashMap;

/// Rows from one evaluation to the next.
pub const RUN: usize = 16;
/// Fewer rows are not worth the preparations.
pub const FEW: f64 = 4.0;
/// Rates whose factors are kept.
const KEPT: usize = 4096;

/// Factors by which exponentials grow from row to row.
#[derive(Default)]
pub struct Strides {
    step: f64,
    /// `e^(rate k step)`, k = 0 ... RUN - 1
    tables: Vec<[Complex; RUN]>,
    /// table of each rate, by its bits
    known: HashMap<[u64; 2], usize>,
    /// table of each term of the present segment; of no use for other terms than exponentials
    present: Vec<usize>,
}

impl Strides {
    /// Prepares rows at the distance `step` [s] for the terms of a segment.
    pub fn begin(&mut self, path: &Trajectory, step: f64) {
        if self.step != step || self.tables.len() + path.terms.len() > KEPT {
            self.step = step;
            self.tables.clear();
            self.known.clear();
        }
        self.present.clear();
        for placed in &path.terms {
            let Term::Exp { rate } = placed.term else {
                self.present.push(0);
                continue;
            };
            let tables = &mut self.tables;
            let at = *self.known.entry([rate.re.to_bits(), rate.im.to_bits()]).or_insert_with(|| {
                tables.push(std::array::from_fn(|k| rate.scale(k as f64 * step).exp()));
                tables.len() - 1
            });
            self.present.push(at);
        }
    }

    /// All terms `k` rows after an anchor, at the time `t` since the start of the segment.
    pub fn at(&self, path: &Trajectory, anchor: &Point, k: usize, t: f64, out: &mut Point) {
        out.t = t;
        out.value.resize(path.slots, 0.0);
        out.slope.resize(path.slots, 0.0);
        for (placed, &table) in path.terms.iter().zip(&self.present) {
            let s = placed.slot;
            let (f, d) = match placed.term {
                Term::Exp { rate } => {
                    let factor = self.tables[table][k];
                    if placed.width == 1 {
                        let f = anchor.value[s] * factor.re;
                        (out.value[s], out.slope[s]) = (f, rate.re * f);
                        continue;
                    }
                    let f = complex(anchor.value[s], anchor.value[s + 1]) * factor;
                    (f, rate * f)
                }
                other => {
                    let (f, d, _) = other.at(t);
                    (f, d)
                }
            };
            (out.value[s], out.slope[s]) = (f.re, d.re);
            if placed.width == 2 {
                (out.value[s + 1], out.slope[s + 1]) = (f.im, d.im);
            }
        }
    }
}
