//! The exponential of a matrix, for the few modes without a basis of eigenvectors.

use super::inputs::Segment;
use super::terms::Point;
use crate::dense::{complex, dot, Matrix};

/// `y' = M y` for `y = [x; shared terms]`, by the exponential of the matrix.
pub(super) struct Plain {
    matrix: Matrix,
    y0: Vec<f64>,
    pub norm: f64,
}

impl Plain {
    pub fn new(j: &Matrix, jv: &Matrix, x: &[f64], seg: &Segment, shared: usize) -> Plain {
        let n = x.len();
        let size = n + shared;
        let mut m = Matrix::zeros(size, size);
        let mut y0 = x.to_vec();
        y0.resize(size, 0.0);
        y0[n] = 1.0;
        for r in 0..n {
            m.row_mut(r)[..n].copy_from_slice(j.row(r));
            m[(r, n)] = dot(jv.row(r), &seg.level);
        }
        let mut slot = n + 1;
        if seg.sloped {
            for r in 0..n {
                m[(r, slot)] = dot(jv.row(r), &seg.slope);
            }
            m[(slot, n)] = 1.0;
            slot += 1;
        }
        for tone in &seg.tones {
            // slots: real and imaginary part of e^(rate t)
            for r in 0..n {
                let beta = complex(jv[(r, tone.index + 1)], -jv[(r, tone.index)]) * tone.start;
                m[(r, slot)] = beta.re;
                m[(r, slot + 1)] = -beta.im;
            }
            m[(slot, slot)] = tone.rate.re;
            m[(slot, slot + 1)] = -tone.rate.im;
            m[(slot + 1, slot)] = tone.rate.im;
            m[(slot + 1, slot + 1)] = tone.rate.re;
            y0[slot] = 1.0;
            slot += 2;
        }
        for decay in &seg.decays {
            for r in 0..n {
                m[(r, slot)] = jv[(r, decay.index)] * decay.start;
            }
            m[(slot, slot)] = decay.rate;
            y0[slot] = 1.0;
            slot += 1;
        }
        let norm =
            (0..size).map(|r| m.row(r).iter().map(|v| v.abs()).sum::<f64>()).fold(0.0f64, f64::max);
        Plain { matrix: m, y0, norm }
    }

    /// `e^(M t) y0` by scaling and squaring of the Taylor series.
    pub fn at(&self, t: f64, n: usize, shared: usize, out: &mut Point) {
        let size = n + shared;
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
        out.value[shared..].copy_from_slice(&y[..n]);
        out.slope[shared..].copy_from_slice(&rate[..n]);
    }
}
