//! Coordinates that have no eigenvectors of their own (double rates), by the exponential of a matrix.

use crate::dense::{complex, dot, Complex, Lu, Matrix};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;

/// Forcing this much faster or slower than the block is taken apart from it: then no difference of rates loses a digit.
/// No test distinguishes 10 from 1.6.
const APART: f64 = 4.0;

/// Largest sum of absolute values of a row.
pub(in crate::modewise) fn row_norm(m: &Matrix) -> f64 {
    (0..m.rows).map(|r| m.row(r).iter().map(|v| v.abs()).sum()).fold(0.0f64, f64::max)
}

/// `x' = B x + drive`: parts that respond in closed form are kept apart, and the rest is
/// `y' = M y` for `y = [x; what drives it]`.
pub(in crate::modewise) struct Block {
    /// number of coordinates
    pub width: usize,
    /// first slot, and place among the terms
    pub slot: usize,
    pub term: usize,
    matrix: Matrix,
    y0: Vec<f64>,
    norm: f64,
}

/// Something that drives a block.
struct Forcing {
    /// columns of `M` that it takes, and its own equations in them
    own: Matrix,
    /// its values at the start
    start: Vec<f64>,
    /// what it does to the coordinates, by column
    drive: Matrix,
}

/// `(r - B) P = beta` for complex r and beta.
fn particular(b: &Matrix, r: Complex, beta: &[Complex]) -> Vec<Complex> {
    let w = b.rows;
    let joint = Matrix::from_fn(2 * w, 2 * w, |i, k| {
        let unit = if i % w == k % w { 1.0 } else { 0.0 };
        match (i < w, k < w) {
            (true, true) | (false, false) => r.re * unit - b[(i % w, k % w)],
            (true, false) => -r.im * unit,
            (false, true) => r.im * unit,
        }
    });
    let right = Matrix::from_fn(2 * w, 1, |i, _| if i < w { beta[i].re } else { beta[i - w].im });
    let found = Lu::new(&joint).solve_refined(&joint, &right);
    (0..w).map(|i| complex(found[(i, 0)], found[(w + i, 0)])).collect()
}

impl Block {
    /// The block `b` from coordinates `x`, driven by rows over v; responses kept apart are added to
    /// `common`, the rows of the block's coordinates over all shared slots.
    pub fn new(
        b: &Matrix,
        drive: &Matrix,
        mut x: Vec<f64>,
        seg: &Segment,
        horizon: f64,
        common: &mut [f64],
    ) -> Block {
        let w = b.rows;
        let shared = common.len() / w;
        let most = row_norm(b);
        // a rate of its own size: what drives it is measured in units by which it shows no larger ones
        let own = [most, 1.0 / horizon].into_iter().find(|rate| *rate > 0.0 && rate.is_finite());
        let pace = own.unwrap_or(1.0).log2().ceil().exp2();
        let factor = Lu::new(b);
        let least = match factor.ratio > 0.0 {
            true => 1.0 / row_norm(&factor.solve(&Matrix::identity(w))),
            false => 0.0,
        };
        let column = |values: Vec<f64>| Matrix { rows: w, cols: 1, data: values };
        let over = |input: &[f64]| column((0..w).map(|r| dot(drive.row(r), input)).collect());
        let mut forcings: Vec<Forcing> = Vec::new();
        let (level, slope) = (over(&seg.level), over(&seg.slope));
        let zero = |m: &Matrix| m.data.iter().all(|v| *v == 0.0);
        if !(zero(&level) && zero(&slope)) {
            if least * horizon >= 1.0 {
                // p0 + p1 t: p1 = B p0 + level, 0 = B p1 + slope
                let mut first = factor.solve_refined(b, &slope);
                first.data.iter_mut().for_each(|v| *v = -*v);
                let mut rest = first.clone();
                rest.add_scaled(-1.0, &level);
                let constant = factor.solve_refined(b, &rest);
                for r in 0..w {
                    common[r * shared] += constant[(r, 0)];
                    if seg.sloped {
                        common[r * shared + 1] += first[(r, 0)];
                    }
                    x[r] -= constant[(r, 0)];
                }
            } else {
                let mut own = Matrix::zeros(2, 2);
                own[(1, 0)] = pace;
                let mut steep = slope;
                steep.data.iter_mut().for_each(|v| *v /= pace);
                forcings.push(Forcing { own, start: vec![1.0, 0.0], drive: level.beside(&steep) });
            }
        }
        let apart = |rate: f64| rate > APART * most || rate * APART < least;
        let mut slot = if seg.sloped { 2 } else { 1 };
        for tone in &seg.tones {
            let (s, c) = (tone.index, tone.index + 1);
            let beta: Vec<Complex> =
                (0..w).map(|r| complex(drive[(r, c)], -drive[(r, s)]) * tone.start).collect();
            if apart(tone.rate.abs()) {
                for (r, p) in particular(b, tone.rate, &beta).into_iter().enumerate() {
                    common[r * shared + slot] += p.re;
                    common[r * shared + slot + 1] -= p.im;
                    x[r] -= p.re;
                }
            } else if beta.iter().any(|b| b.abs() > 0.0) {
                let (re, im) = (tone.rate.re, tone.rate.im);
                forcings.push(Forcing {
                    own: Matrix { rows: 2, cols: 2, data: vec![re, -im, im, re] },
                    start: vec![1.0, 0.0],
                    drive: Matrix::from_fn(
                        w,
                        2,
                        |r, k| if k == 0 { beta[r].re } else { -beta[r].im },
                    ),
                });
            }
            slot += 2;
        }
        for decay in &seg.decays {
            let beta: Vec<f64> = (0..w).map(|r| drive[(r, decay.index)] * decay.start).collect();
            if apart(decay.rate.abs()) {
                let complex_beta: Vec<Complex> = beta.iter().map(|v| complex(*v, 0.0)).collect();
                let found = particular(b, complex(decay.rate, 0.0), &complex_beta);
                for (r, p) in found.into_iter().enumerate() {
                    common[r * shared + slot] += p.re;
                    x[r] -= p.re;
                }
            } else if beta.iter().any(|b| *b != 0.0) {
                forcings.push(Forcing {
                    own: Matrix { rows: 1, cols: 1, data: vec![decay.rate] },
                    start: vec![1.0],
                    drive: column(beta),
                });
            }
            slot += 1;
        }
        // columns of the drive no larger than the block itself
        let largest = forcings.iter().map(|f| f.drive.max_abs()).fold(0.0, f64::max);
        let unit = if largest > 0.0 { (largest / pace).log2().ceil().exp2() } else { 1.0 };
        let size = w + forcings.iter().map(|f| f.start.len()).sum::<usize>();
        let mut matrix = Matrix::zeros(size, size);
        for r in 0..w {
            matrix.row_mut(r)[..w].copy_from_slice(b.row(r));
        }
        let mut y0 = x;
        for f in &forcings {
            let first = y0.len();
            for k in 0..f.start.len() {
                for r in 0..w {
                    matrix[(r, first + k)] = f.drive[(r, k)] / unit;
                }
                for i in 0..f.start.len() {
                    matrix[(first + i, first + k)] = f.own[(i, k)];
                }
            }
            y0.extend(f.start.iter().map(|v| v * unit));
        }
        let norm = row_norm(&matrix);
        Block { width: w, slot: 0, term: 0, matrix, y0, norm }
    }

    /// A rate that bounds those of the coordinates.
    pub fn rate(&self) -> f64 {
        self.norm
    }

    /// What the coordinate of a slot begins with, without its sign; none if it is not of this block.
    pub fn start(&self, slot: usize) -> Option<f64> {
        let k = slot.checked_sub(self.slot).filter(|&k| k < self.width)?;
        Some(self.y0[k].abs())
    }

    /// Fills the slots of the coordinates: `e^(M t) y0` by scaling and squaring of the Taylor series.
    pub fn at(&self, t: f64, out: &mut Point) {
        let size = self.matrix.rows;
        let reach = self.norm * t;
        let halvings = if reach > 0.5 { (reach / 0.5).log2().ceil() as i32 } else { 0 };
        let step = t / f64::from(halvings).exp2();
        let mut term = Matrix::identity(size);
        let mut sum = term.clone();
        for k in 1..=18 {
            term = term.times(&self.matrix);
            let f = step / f64::from(k);
            term.data.iter_mut().for_each(|v| *v *= f);
            sum.add_scaled(1.0, &term);
        }
        for _ in 0..halvings {
            sum = sum.times(&sum);
        }
        let mut y = vec![0.0; size];
        sum.apply(&self.y0, &mut y);
        let mut rate = vec![0.0; size];
        self.matrix.apply(&y, &mut rate);
        let slots = self.slot..self.slot + self.width;
        out.value[slots.clone()].copy_from_slice(&y[..self.width]);
        out.slope[slots].copy_from_slice(&rate[..self.width]);
        let long = |v: &[f64]| v[..self.width].iter().fold(0.0f64, |m, v| m.hypot(*v));
        let envelope = 2.0 * (long(&y) + long(&rate) / self.norm.max(f64::MIN_POSITIVE));
        out.envelope[self.term..self.term + self.width].fill(envelope);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modewise::functions::inputs::{Decay, Tone};

    /// `x' = B x + b (2 + 3 t) + c cos(w t) + d e^(-t)` with a double rate, far apart and near.
    #[test]
    fn the_equations_hold_whatever_is_kept_apart() {
        let b = Matrix { rows: 2, cols: 2, data: vec![-1.0, 1.0, 0.0, -1.0] };
        for (rate, decay, horizon) in [(100.0, -50.0, 9.0), (1.0, -1.0, 0.1), (1e-3, -1e-3, 9.0)] {
            let drive = Matrix::from_fn(2, 5, |r, c| (1 + r + 2 * c) as f64 * 0.5);
            let seg = Segment {
                level: vec![2.0, 1.0, 0.0, 0.0, 0.0],
                slope: vec![0.0, 3.0, 0.0, 0.0, 0.0],
                sloped: true,
                tones: vec![Tone { index: 2, rate: complex(0.0, rate), start: complex(0.6, 0.8) }],
                decays: vec![Decay { index: 4, rate: decay, start: 1.5 }],
                ..Segment::default()
            };
            let shared = 5;
            let mut common = vec![0.0; 2 * shared];
            let start = vec![0.3, -0.7];
            let block = Block::new(&b, &drive, start.clone(), &seg, horizon, &mut common);
            let at = |t: f64| {
                let mut out = Point {
                    value: vec![0.0; 2],
                    slope: vec![0.0; 2],
                    envelope: vec![0.0; 2],
                    ..Point::default()
                };
                block.at(t, &mut out);
                let tone = (complex(0.0, rate).scale(t)).exp();
                let terms = [1.0, t, tone.re, tone.im, (decay * t).exp()];
                [0, 1].map(|r| out.value[r] + dot(&common[r * shared..(r + 1) * shared], &terms))
            };
            let (x, h) = (at(0.0), 1e-5);
            assert!((x[0] - start[0]).abs() < 1e-12 && (x[1] - start[1]).abs() < 1e-12);
            for t in [0.01, 0.07] {
                let (x, more, less) = (at(t), at(t + h), at(t - h));
                let tone = complex(0.6, 0.8) * complex(0.0, rate).scale(t).exp();
                let v = [2.0, 1.0 + 3.0 * t, tone.im, tone.re, 1.5 * (decay * t).exp()];
                for r in 0..2 {
                    let rate = dot(b.row(r), &x) + dot(drive.row(r), &v);
                    assert!(
                        ((more[r] - less[r]) / (2.0 * h) - rate).abs() < 1e-5 * (1.0 + rate.abs())
                    );
                }
            }
        }
    }
}
