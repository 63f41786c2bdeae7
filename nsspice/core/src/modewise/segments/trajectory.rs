//! A segment in closed form: modal coordinates and rows of functionals as sums of [`Term`]s.

use crate::dense::{collapse, complex, dot, Complex, Matrix};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::{Placed, Point, Term};
use crate::modewise::modes::mode::{Mode, Rows};
use crate::modewise::modes::outputs::Columns;
use crate::modewise::segments::bundle::Bundle;
use crate::modewise::segments::spread::Spread;
use crate::modewise::spectra::block::Block;

/// A mode's share of a slow or resonant forcing is kept apart while `|difference| horizon` is below:
/// division by a larger difference makes no more of rounding.
const NEAR: f64 = 1.0;

/// Whether a rate is slow against the horizon; asked for every term of every segment, where a square
/// root would be felt.
fn is_near(rate: Complex, horizon: f64) -> bool {
    let (re, im) = (rate.re * horizon, rate.im * horizon);
    re * re + im * im < NEAR * NEAR
}

/// A term that belongs to one pole.
#[derive(Clone, Copy, Debug)]
struct Own {
    /// place of the modal coordinate
    at: usize,
    /// the coordinate is complex
    pair: bool,
    slot: usize,
    /// the term is complex
    wide: bool,
    factor: Complex,
}

/// The state with which a segment begins, entered from energy coordinates `a`, damaged.
#[cfg(feature = "faults")]
fn damage(mode: &Mode, a: &[f64], start: &mut [f64]) {
    let Some(first) = start.first_mut() else { return };
    fault!("state_off_1e-3" => *first *= 1.0 + 1e-3);
    fault!("state_off_1e-5" => *first *= 1.0 + 1e-5);
    fault!("state_off_1e-6" => *first *= 1.0 + 1e-6);
    if mode.impulses.is_none() {
        return;
    }
    let square = |list: &[f64]| list.iter().map(|v| v * v).sum::<f64>();
    let largest = (0..start.len()).max_by(|&i, &j| start[i].abs().total_cmp(&start[j].abs()));
    let largest = largest.unwrap_or(0);
    if square(start) < square(a) * (1.0 - 1e-9) {
        fault!("jump_scaled" => start.iter_mut().for_each(|v| *v *= 0.9));
        fault!("jump_zeroes_largest" => start[largest] = 0.0);
        fault!("jump_off_1e-4" => start[largest] *= 1.0 + 1e-4);
        fault!("jump_reversed" => start.iter_mut().for_each(|v| *v *= -1.0));
    } else {
        fault!("needless_jump" => start[largest] = 0.0);
    }
}

/// A segment's motion.
#[derive(Default)]
pub struct Trajectory {
    /// all terms with their slots
    pub terms: Vec<Placed>,
    /// number of slots
    pub slots: usize,
    /// number of slots and terms that all coordinates share
    shared: usize,
    own: Vec<Own>,
    /// n x shared: the coordinates' parts in shared slots
    common: Vec<f64>,
    n: usize,
    start: Vec<f64>,
    /// work space: `common` by slot, factors of the coordinates' own terms
    by_slot: Vec<f64>,
    amounts: Vec<f64>,
    /// each coordinate has one term of its own, a real exponential
    plainly: bool,
    /// coordinates without a closed form
    blocks: Vec<Block>,
}

impl Trajectory {
    fn clear(&mut self) {
        self.terms.clear();
        self.own.clear();
        self.slots = 0;
        self.plainly = false;
        self.blocks.clear();
    }

    fn place(&mut self, term: Term, width: usize) -> usize {
        let slot = self.slots;
        self.terms.push(Placed { term, slot, width });
        self.slots += width;
        slot
    }

    fn add_own(&mut self, at: usize, pair: bool, term: Term, wide: bool, factor: Complex) {
        let slot = self.place(term, if wide { 2 } else { 1 });
        self.own.push(Own { at, pair, slot, wide, factor });
    }

    /// The motion of a mode from energy coordinates `a` under the inputs of a segment of at most the
    /// length `horizon`.
    pub fn begin(&mut self, mode: &Mode, a: &[f64], segment: &Segment, horizon: f64) {
        self.clear();
        let n = mode.n;
        self.n = n;
        self.place(Term::One, 1);
        if segment.sloped {
            self.place(Term::Time, 1);
        }
        for tone in &segment.tones {
            self.place(Term::Exp { rate: tone.rate }, 2);
        }
        for decay in &segment.decays {
            self.place(Term::Exp { rate: complex(decay.rate, 0.0) }, 1);
        }
        let shared = self.slots;
        self.shared = shared;
        self.common.clear();
        self.common.resize(n * shared, 0.0);
        self.start.clear();
        self.start.resize(n, 0.0);
        let mut start = std::mem::take(&mut self.start);
        mode.enter(a, &mut start);
        #[cfg(feature = "faults")]
        damage(mode, a, &mut start);
        self.start = start;
        for pole in &mode.poles {
            let at = pole.at;
            if pole.omega == 0.0 {
                let rate = pole.alpha;
                #[cfg(feature = "faults")]
                let rate = fault!("rate_off_1e-4", rate, rate * (1.0 + 1e-4));
                self.real_pole(mode, at, rate, segment, horizon);
            } else {
                let omega = fault!("frequency_off_1e-5", pole.omega, pole.omega * (1.0 + 1e-5));
                self.pair(mode, at, complex(pole.alpha, omega), segment, horizon);
            }
        }
        for (at, matrix) in &mode.blocks {
            let end = at + matrix.rows;
            let drive =
                Matrix::from_fn(matrix.rows, mode.drive.cols, |r, c| mode.drive[(at + r, c)]);
            let common = &mut self.common[at * shared..end * shared];
            let start = self.start[*at..end].to_vec();
            let mut block = Block::new(matrix, &drive, start, segment, horizon, common);
            (block.slot, block.term) = (self.slots, self.terms.len());
            let term = Term::Numerical { rate: block.rate() };
            for at in *at..end {
                self.add_own(at, false, term, false, complex(1.0, 0.0));
            }
            self.blocks.push(block);
        }
        self.plainly = self.own.len() == n
            && self.own.iter().enumerate().all(|(i, own)| own.at == i && !own.wide && !own.pair);
    }

    fn real_pole(&mut self, mode: &Mode, at: usize, lambda: f64, seg: &Segment, horizon: f64) {
        let shared = self.shared;
        let drive = mode.drive.row(at);
        let own = complex(lambda, 0.0);
        let mut h = self.start[at];
        let slow = is_near(own, horizon);
        let mut slot = 1;
        let level = dot(drive, &seg.level);
        #[cfg(feature = "faults")]
        let level = fault!("response_off_1e-3", level, level * (1.0 + 1e-3));
        if level != 0.0 {
            if slow {
                let near = Term::Near { own, apart: -own, size: lambda.abs() };
                self.add_own(at, false, near, false, complex(level, 0.0));
            } else {
                self.common[at * shared] -= level / lambda;
                h += level / lambda;
            }
        }
        if seg.sloped {
            let slope = dot(drive, &seg.slope);
            if slope != 0.0 {
                if slow {
                    self.add_own(at, false, Term::Ramp { own }, false, complex(slope, 0.0));
                } else {
                    let p = slope / lambda;
                    self.common[at * shared + slot] -= p;
                    self.common[at * shared] -= p / lambda;
                    h += p / lambda;
                }
            }
            slot += 1;
        }
        for tone in &seg.tones {
            let beta = complex(drive[tone.index + 1], -drive[tone.index]) * tone.start;
            let apart = tone.rate - own;
            if beta.re != 0.0 || beta.im != 0.0 {
                if is_near(apart, horizon) {
                    let size = tone.rate.abs().max(lambda.abs());
                    self.add_own(at, false, Term::Near { own, apart, size }, true, beta);
                } else {
                    let p = beta / apart;
                    self.common[at * shared + slot] += p.re;
                    self.common[at * shared + slot + 1] -= p.im;
                    h -= p.re;
                }
            }
            slot += 2;
        }
        for decay in &seg.decays {
            let beta = drive[decay.index] * decay.start;
            let apart = decay.rate - lambda;
            if beta != 0.0 {
                if apart.abs() * horizon < NEAR {
                    let size = decay.rate.abs().max(lambda.abs());
                    let near = Term::Near { own, apart: complex(apart, 0.0), size };
                    self.add_own(at, false, near, false, complex(beta, 0.0));
                } else {
                    self.common[at * shared + slot] += beta / apart;
                    h -= beta / apart;
                }
            }
            slot += 1;
        }
        self.add_own(at, false, Term::Exp { rate: own }, false, complex(h, 0.0));
    }

    fn pair(&mut self, mode: &Mode, at: usize, own: Complex, seg: &Segment, horizon: f64) {
        let shared = self.shared;
        let (re, im) = (mode.drive.row(at), mode.drive.row(at + 1));
        let mut h = complex(self.start[at], self.start[at + 1]);
        let slow = is_near(own, horizon);
        let zero = complex(0.0, 0.0);
        let (row, next) = (at * shared, (at + 1) * shared);
        let mut slot = 1;
        let level = complex(dot(re, &seg.level), dot(im, &seg.level));
        if level != zero {
            if slow {
                let near = Term::Near { own, apart: -own, size: own.abs() };
                self.add_own(at, true, near, true, level);
            } else {
                let p = level / own;
                self.common[row] -= p.re;
                self.common[next] -= p.im;
                h = h + p;
            }
        }
        if seg.sloped {
            let slope = complex(dot(re, &seg.slope), dot(im, &seg.slope));
            if slope != zero {
                if slow {
                    self.add_own(at, true, Term::Ramp { own }, true, slope);
                } else {
                    let p = slope / own;
                    let q = p / own;
                    self.common[row + slot] -= p.re;
                    self.common[next + slot] -= p.im;
                    self.common[row] -= q.re;
                    self.common[next] -= q.im;
                    h = h + q;
                }
            }
            slot += 1;
        }
        for tone in &seg.tones {
            let (s, c) = (tone.index, tone.index + 1);
            let (bs, bc) = (complex(re[s], im[s]), complex(re[c], im[c]));
            let turned = complex(-bs.im, bs.re); // i bs
            let plus = ((bc - turned) * tone.start).scale(0.5);
            let minus = ((bc + turned) * tone.start.conj()).scale(0.5);
            for (beta, rate, sign) in [(plus, tone.rate, 1.0), (minus, tone.rate.conj(), -1.0)] {
                if beta == zero {
                    continue;
                }
                let apart = rate - own;
                if is_near(apart, horizon) {
                    let size = rate.abs().max(own.abs());
                    self.add_own(at, true, Term::Near { own, apart, size }, true, beta);
                } else {
                    let p = beta / apart;
                    self.common[row + slot] += p.re;
                    self.common[row + slot + 1] -= sign * p.im;
                    self.common[next + slot] += p.im;
                    self.common[next + slot + 1] += sign * p.re;
                    h = h - p;
                }
            }
            slot += 2;
        }
        for decay in &seg.decays {
            let beta = complex(re[decay.index], im[decay.index]).scale(decay.start);
            let apart = complex(decay.rate, 0.0) - own;
            if beta != zero {
                if is_near(apart, horizon) {
                    let size = decay.rate.abs().max(own.abs());
                    self.add_own(at, true, Term::Near { own, apart, size }, true, beta);
                } else {
                    let p = beta / apart;
                    self.common[row + slot] += p.re;
                    self.common[next + slot] += p.im;
                    h = h - p;
                }
            }
            slot += 1;
        }
        self.add_own(at, true, Term::Exp { rate: own }, true, h);
    }

    /// Collapses functionals to factors of the terms.
    pub fn bundle(&mut self, rows: &Rows, segment: &Segment, out: &mut Bundle) {
        let (count, slots, shared) = (rows.v.rows, self.slots, self.shared);
        out.count = count;
        out.factor.clear();
        out.factor.resize(count * slots, 0.0);
        self.by_slot.clear();
        for s in 0..shared {
            self.by_slot.extend(self.common.iter().skip(s).step_by(shared));
        }
        self.amounts.clear();
        if self.plainly {
            self.amounts.extend(self.own.iter().map(|own| own.factor.re));
        }
        for j in 0..count {
            let c = &mut out.factor[j * slots..(j + 1) * slots];
            let (gx, gv, gd) = (rows.x.row(j), rows.v.row(j), rows.d.row(j));
            c[0] = dot(gv, &segment.level);
            let mut slot = 1;
            if segment.sloped {
                c[0] += dot(gd, &segment.slope);
                c[1] = dot(gv, &segment.slope);
                slot = 2;
            }
            for tone in &segment.tones {
                let (s, k) = (tone.index, tone.index + 1);
                let q = (complex(gv[k], -gv[s]) + tone.rate * complex(gd[k], -gd[s])) * tone.start;
                c[slot] = q.re;
                c[slot + 1] = -q.im;
                slot += 2;
            }
            for decay in &segment.decays {
                c[slot] = (gv[decay.index] + decay.rate * gd[decay.index]) * decay.start;
                slot += 1;
            }
            if self.plainly {
                // one real term per coordinate, in their order
                collapse(gx, &self.by_slot, &self.amounts, c);
                continue;
            }
            for (c, common) in c[..shared].iter_mut().zip(self.by_slot.chunks_exact(self.n.max(1)))
            {
                *c += dot(gx, common);
            }
            for own in &self.own {
                let w = gx[own.at];
                let (hr, hi) = (own.factor.re, own.factor.im);
                if own.pair {
                    let v = gx[own.at + 1];
                    c[own.slot] = w * hr + v * hi;
                    c[own.slot + 1] = v * hr - w * hi;
                } else {
                    c[own.slot] = w * hr;
                    if own.wide {
                        c[own.slot + 1] = -w * hi;
                    }
                }
            }
        }
    }

    /// The same of outputs that are kept column by column.
    pub fn spread(&self, rows: &Columns, segment: &Segment, out: &mut Spread) {
        out.clear(rows.count(), self.slots);
        let (v, d) = (|k: usize| rows.v.row(k), |k: usize| rows.d.row(k));
        for (k, (level, slope)) in segment.level.iter().zip(&segment.slope).enumerate() {
            out.add(0, *level, v(k));
            if *slope != 0.0 {
                out.add(0, *slope, d(k));
                out.add(1, *slope, v(k));
            }
        }
        let mut slot = if segment.sloped { 2 } else { 1 };
        for tone in &segment.tones {
            let (s, c) = (tone.index, tone.index + 1);
            let (begin, change) = (tone.start, tone.rate * tone.start);
            for (turn, sin, cos) in [(begin, v(s), v(c)), (change, d(s), d(c))] {
                out.add(slot, turn.re, cos);
                out.add(slot, turn.im, sin);
                out.add(slot + 1, -turn.im, cos);
                out.add(slot + 1, turn.re, sin);
            }
            slot += 2;
        }
        for decay in &segment.decays {
            out.add(slot, decay.start, v(decay.index));
            out.add(slot, decay.rate * decay.start, d(decay.index));
            slot += 1;
        }
        for (k, common) in self.common.chunks_exact(self.shared.max(1)).enumerate() {
            for (slot, &c) in common.iter().enumerate() {
                out.add(slot, c, rows.x.row(k));
            }
        }
        for own in &self.own {
            let (x, (hr, hi)) = (rows.x.row(own.at), (own.factor.re, own.factor.im));
            out.add(own.slot, hr, x);
            if own.pair {
                let y = rows.x.row(own.at + 1);
                out.add(own.slot, hi, y);
                out.add(own.slot + 1, hr, y);
            }
            if own.wide {
                out.add(own.slot + 1, -hi, x);
            }
        }
    }

    /// Evaluates all terms.
    pub fn at(&self, t: f64, out: &mut Point) {
        out.t = t;
        out.value.resize(self.slots, 0.0);
        out.slope.resize(self.slots, 0.0);
        out.envelope.resize(self.terms.len(), 0.0);
        for (k, placed) in self.terms.iter().enumerate() {
            self.one(k, placed, t, out);
        }
        for block in &self.blocks {
            block.at(t, out);
        }
    }

    #[inline]
    fn one(&self, k: usize, placed: &Placed, t: f64, out: &mut Point) {
        let (f, d, size) = placed.term.at(t);
        out.value[placed.slot] = f.re;
        out.slope[placed.slot] = d.re;
        if placed.width == 2 {
            out.value[placed.slot + 1] = f.im;
            out.slope[placed.slot + 1] = d.im;
        }
        out.envelope[k] = size;
    }

    /// Modal coordinates at the start.
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// True if the motion is known in closed form.
    pub fn closed(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Modal coordinates at a point.
    pub fn state(&self, point: &Point, out: &mut [f64]) {
        self.combine(&point.value, out);
    }

    /// Rates of the modal coordinates at a point.
    pub fn state_rate(&self, point: &Point, out: &mut [f64]) {
        self.combine(&point.slope, out);
    }

    fn combine(&self, terms: &[f64], out: &mut [f64]) {
        for (x, common) in out.iter_mut().zip(self.common.chunks_exact(self.shared)) {
            *x = dot(common, terms);
        }
        for own in &self.own {
            let (fr, (hr, hi)) = (terms[own.slot], (own.factor.re, own.factor.im));
            if own.pair {
                let fi = terms[own.slot + 1];
                out[own.at] += hr * fr - hi * fi;
                out[own.at + 1] += hr * fi + hi * fr;
            } else if own.wide {
                out[own.at] += hr * fr - hi * terms[own.slot + 1];
            } else {
                out[own.at] += hr * fr;
            }
        }
    }

    /// The sum of the sizes of all terms of each modal coordinate within a time; `reach` is work space.
    pub fn sizes(&self, time: f64, reach: &mut Vec<f64>, out: &mut [f64]) {
        self.reaches(time, reach);
        for (x, common) in out.iter_mut().zip(self.common.chunks_exact(self.shared)) {
            *x = common.iter().zip(&*reach).map(|(c, r)| (c * r).abs()).sum();
        }
        for own in &self.own {
            let numerical = self.blocks.iter().find_map(|block| block.start(own.slot));
            let size = numerical.unwrap_or(own.factor.abs() * reach[own.slot]);
            out[own.at] += size;
            if own.pair {
                out[own.at + 1] += size;
            }
        }
    }

    /// Values of `[1; inputs]` at a point.
    pub fn inputs(&self, segment: &Segment, point: &Point, out: &mut [f64]) {
        for ((v, level), slope) in out.iter_mut().zip(&segment.level).zip(&segment.slope) {
            *v = level + slope * point.t;
        }
        let mut slot = if segment.sloped { 2 } else { 1 };
        for tone in &segment.tones {
            let f = complex(point.value[slot], point.value[slot + 1]) * tone.start;
            out[tone.index] = f.im;
            out[tone.index + 1] = f.re;
            slot += 2;
        }
        for decay in &segment.decays {
            out[decay.index] = decay.start * point.value[slot];
            slot += 1;
        }
    }

    /// Bounds of second and fourth derivatives of each slot between two points.
    pub fn bounds(&self, from: &Point, to: &Point, second: &mut Vec<f64>, fourth: &mut Vec<f64>) {
        second.clear();
        fourth.clear();
        for ((placed, a), b) in self.terms.iter().zip(&from.envelope).zip(&to.envelope) {
            let size = a.max(*b);
            let (two, four) = placed.term.bounds(to.t);
            for _ in 0..placed.width {
                second.push(two * size);
                fourth.push(four * size);
            }
        }
    }

    /// Largest values of each slot within a time, but for exponential growth.
    pub fn reaches(&self, time: f64, out: &mut Vec<f64>) {
        out.clear();
        for placed in &self.terms {
            (0..placed.width).for_each(|_| out.push(placed.term.reach(time)));
        }
    }
}
