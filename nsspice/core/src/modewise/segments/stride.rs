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

use crate::dense::{complex, Complex};
use crate::modewise::functions::terms::{Point, Term};
use crate::modewise::segments::trajectory::Trajectory;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Rows from one evaluation to the next; fewer in all are not worth the preparations.
pub const RUN: usize = 16;
/// Terms whose factors are kept.
const KEPT: usize = 4096;

/// What one term needs `k` rows after an anchor, k = 0 ... RUN - 1: `e^(rate d)`; or `F(d)` and
/// `N(d)`; or `R'(d)` and `R(d)`.
type Table = [[Complex; 2]; RUN];

/// A term by kind and bits of its rates.
type Key = (u8, [u64; 4]);

/// A hash of bits of rates, which are looked up for every term of every segment: nobody chooses them
/// so that they collide, which is what the usual hash guards against at several times the price.
#[derive(Default)]
struct Bits(u64);

impl Hasher for Bits {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    }

    /// Round numbers have zeros at the end of their bits, and their products too.
    fn finish(&self) -> u64 {
        self.0.rotate_left(26)
    }
}

/// How terms grow from row to row.
#[derive(Default)]
pub struct Strides {
    step: f64,
    tables: Vec<Table>,
    known: HashMap<Key, usize, BuildHasherDefault<Bits>>,
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

    /// All terms at the anchor and at the rows after it, whose times since the start of the segment
    /// are given: one row of slots each, and of derivatives if they are wanted.
    pub fn run(
        &self,
        path: &Trajectory,
        anchor: &Point,
        times: &[f64],
        values: &mut Vec<f64>,
        mut slopes: Option<&mut Vec<f64>>,
    ) {
        let (slots, zero) = (path.slots, complex(0.0, 0.0));
        values.resize(slots * times.len(), 0.0);
        if let Some(slopes) = &mut slopes {
            slopes.resize(slots * times.len(), 0.0);
        }
        for (placed, &(table, e)) in path.terms.iter().zip(&self.present) {
            let (s, width) = (placed.slot, placed.width);
            let mut put = |k: usize, f: Complex, slope: Complex| {
                let at = k * slots + s;
                values[at] = f.re;
                if width == 2 {
                    values[at + 1] = f.im;
                }
                if let Some(slopes) = &mut slopes {
                    slopes[at] = slope.re;
                    if width == 2 {
                        slopes[at + 1] = slope.im;
                    }
                }
            };
            let [old, rise] = read(anchor, s, width);
            let rows = times.iter().enumerate();
            match placed.term {
                Term::One => rows.for_each(|(k, _)| put(k, complex(1.0, 0.0), zero)),
                // not a closed form: such segments have no strides
                Term::Numerical { .. } => {}
                Term::Time => rows.for_each(|(k, &t)| put(k, complex(t, 0.0), complex(1.0, 0.0))),
                Term::Exp { rate } => {
                    for (k, [grown, _]) in self.tables[table][..times.len()].iter().enumerate() {
                        let f = old * *grown;
                        put(k, f, rate * f);
                    }
                }
                Term::Near { own, apart, .. } => {
                    for (k, [grown, near]) in self.tables[table][..times.len()].iter().enumerate() {
                        let f = *grown * old + *near * e;
                        put(k, f, *grown * (e + apart * old) + own * f);
                    }
                }
                Term::Ramp { .. } => {
                    for (k, [risen, ramp]) in self.tables[table][..times.len()].iter().enumerate() {
                        let d = k as f64 * self.step;
                        put(k, old + rise.scale(d) + *ramp * e, rise + *risen * e);
                    }
                }
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
    use super::*;
    use crate::modewise::functions::terms::Placed;

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
        let (mut anchor, mut exact) = (Point::default(), Point::default());
        let (mut values, mut slopes) = (Vec::new(), Vec::new());
        for step in [1e-4, 0.02] {
            strides.begin(&path, step);
            for start in [0.0, 0.37] {
                path.at(start, &mut anchor);
                strides.anchor(&path, &anchor);
                let times: [f64; RUN] = std::array::from_fn(|k| start + k as f64 * step);
                strides.run(&path, &anchor, &times, &mut values, Some(&mut slopes));
                for (k, t) in times.into_iter().enumerate() {
                    path.at(t, &mut exact);
                    let pairs = values[k * path.slots..].iter().zip(&exact.value);
                    let slopes = slopes[k * path.slots..].iter().zip(&exact.slope);
                    // a few roundings of numbers of size 1
                    assert!(pairs.chain(slopes).all(|(a, b)| (a - b).abs() < 4e-15), "{k} {t}");
                }
            }
        }
    }
}
