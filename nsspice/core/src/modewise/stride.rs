//! Rows at equal distances inside a segment: exponentials for the first of some rows, additions and
//! multiplications for the others.
//!
//! With `E(t) = e^(own t)`, `F(t) = e^(forced t)` and the divided differences of exponentials that
//! modes have which are driven near their own rate,
//!
//! ```text
//! N(t) = (F(t) - E(t)) / (forced - own),      N(t + d) = F(d) N(t) + N(d) E(t),
//! R(t) = (E(t) - 1 - own t) / own^2,          R(t + d) = R(t) + d R'(t) + R(d) E(t),
//! ```
//!
//! all of which is exact, and stable as long as such modes are slow.

use super::terms::{Point, Term};
use super::trajectory::Trajectory;
use crate::dense::{complex, Complex};
use std::collections::HashMap;

/// Rows from one evaluation to the next.
pub const RUN: usize = 16;
/// Fewer rows are not worth the preparations.
pub const FEW: f64 = 4.0;
/// Terms whose factors are kept.
const KEPT: usize = 4096;

/// What one term needs `k` rows after an anchor, k = 0 ... RUN - 1: `e^(rate d)`; or `F(d)` and
/// `N(d)`; or `R'(d)` and `R(d)`.
type Table = [[Complex; 2]; RUN];

/// A term by kind and bits of its rates.
type Key = (u8, [u64; 4]);

/// How terms grow from row to row.
#[derive(Default)]
pub struct Strides {
    step: f64,
    tables: Vec<Table>,
    known: HashMap<Key, usize>,
    /// of each term of the present segment: its table, and `E` at the anchor
    present: Vec<(usize, Complex)>,
}

fn key(term: &Term) -> Option<Key> {
    let bits = |a: Complex, b: Complex| [a.re, a.im, b.re, b.im].map(f64::to_bits);
    match *term {
        Term::One | Term::Time | Term::Numerical { .. } => None,
        Term::Exp { rate } => Some((0, bits(rate, rate))),
        Term::Near { own, apart, .. } => Some((1, bits(own, apart))),
        Term::Ramp { own } => Some((2, bits(own, own))),
    }
}

fn entry(term: &Term, d: f64) -> [Complex; 2] {
    let (value, slope, _) = term.at(d);
    match *term {
        Term::Near { own, apart, .. } => [(own + apart).scale(d).exp(), value],
        Term::Ramp { .. } => [slope, value],
        _ => [value, slope],
    }
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
            let Strides { tables, known, present, .. } = self;
            let at = key(&placed.term).map_or(0, |key| {
                *known.entry(key).or_insert_with(|| {
                    tables.push(std::array::from_fn(|k| entry(&placed.term, k as f64 * step)));
                    tables.len() - 1
                })
            });
            present.push((at, complex(0.0, 0.0)));
        }
    }

    /// Takes a point that all terms have been evaluated at.
    pub fn anchor(&mut self, path: &Trajectory, anchor: &Point) {
        for (placed, (_, e)) in path.terms.iter().zip(&mut self.present) {
            match placed.term {
                Term::Near { own, .. } => *e = own.scale(anchor.t).exp(),
                Term::Ramp { own } => {
                    let [_, slope] = read(anchor, placed.slot, placed.width);
                    *e = complex(1.0, 0.0) + own * slope;
                }
                _ => {}
            }
        }
    }

    /// All terms `k` rows after the anchor, at the time `t` since the start of the segment.
    pub fn at(&self, path: &Trajectory, anchor: &Point, k: usize, t: f64, out: &mut Point) {
        out.t = t;
        out.value.resize(path.slots, 0.0);
        out.slope.resize(path.slots, 0.0);
        let d = k as f64 * self.step;
        for (placed, &(table, e)) in path.terms.iter().zip(&self.present) {
            let (s, width) = (placed.slot, placed.width);
            let (f, slope) = match placed.term {
                Term::One => (complex(1.0, 0.0), complex(0.0, 0.0)),
                // not a closed form: such segments have no strides
                Term::Numerical { .. } => continue,
                Term::Time => (complex(t, 0.0), complex(1.0, 0.0)),
                Term::Exp { rate } => {
                    let [f, _] = read(anchor, s, width);
                    let f = f * self.tables[table][k][0];
                    (f, rate * f)
                }
                Term::Near { own, apart, .. } => {
                    let ([old, _], [grown, near]) = (read(anchor, s, width), self.tables[table][k]);
                    let f = grown * old + near * e;
                    (f, grown * (e + apart * old) + own * f)
                }
                Term::Ramp { .. } => {
                    let ([old, rise], [risen, ramp]) =
                        (read(anchor, s, width), self.tables[table][k]);
                    (old + rise.scale(d) + ramp * e, rise + risen * e)
                }
            };
            (out.value[s], out.slope[s]) = (f.re, slope.re);
            if width == 2 {
                (out.value[s + 1], out.slope[s + 1]) = (f.im, slope.im);
            }
        }
    }
}

/// Value and derivative of a term.
#[inline]
fn read(point: &Point, slot: usize, width: usize) -> [Complex; 2] {
    [&point.value, &point.slope].map(|list| {
        let im = if width == 2 { list[slot + 1] } else { 0.0 };
        complex(list[slot], im)
    })
}

#[cfg(test)]
mod tests {
    use super::super::terms::Placed;
    use super::*;

    #[test]
    fn rows_after_an_anchor_are_those_evaluated_there() {
        let own = complex(-3.0, 5.0);
        let near = |own: Complex, apart: Complex| Term::Near { own, apart, size: 1.0 };
        let real = |x: f64| complex(x, 0.0);
        let terms = [
            (Term::One, 1),
            (Term::Time, 1),
            (Term::Exp { rate: own }, 2),
            (Term::Exp { rate: real(-7.0) }, 1),
            (near(own, -own), 2),
            (near(own, complex(0.3, -0.2)), 2),
            (near(real(-0.5), complex(0.5, 2.0)), 2),
            (near(real(-0.5), real(0.0)), 1),
            (Term::Ramp { own }, 2),
            (Term::Ramp { own: real(-0.1) }, 1),
        ];
        let mut path = Trajectory::default();
        for (term, width) in terms {
            path.terms.push(Placed { term, slot: path.slots, width });
            path.slots += width;
        }
        let mut strides = Strides::default();
        let (mut anchor, mut near, mut exact) =
            (Point::default(), Point::default(), Point::default());
        for step in [1e-4, 0.02] {
            strides.begin(&path, step);
            for start in [0.0, 0.37] {
                path.at(start, &mut anchor);
                strides.anchor(&path, &anchor);
                for k in 1..RUN {
                    let t = start + k as f64 * step;
                    strides.at(&path, &anchor, k, t, &mut near);
                    path.at(t, &mut exact);
                    let pairs = near.value.iter().zip(&exact.value);
                    let slopes = near.slope.iter().zip(&exact.slope);
                    // a few roundings of numbers of size 1
                    assert!(pairs.chain(slopes).all(|(a, b)| (a - b).abs() < 4e-15), "{k} {t}");
                }
            }
        }
    }
}
