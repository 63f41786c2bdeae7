//! One segment as a linear map of small perturbations, in the modal coordinates of its mode.

use super::exponentials::exponential;
use super::linear::CMatrix;
use crate::dense::{complex, divided, Complex, Matrix};
use crate::modewise::modes::mode::Mode;

/// `J X` for rows of modal coordinates.
pub fn rates(mode: &Mode, x: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(x.rows, x.cols);
    for pole in &mode.poles {
        for c in 0..x.cols {
            let re = x[(pole.at, c)];
            if pole.omega == 0.0 {
                out[(pole.at, c)] = pole.alpha * re;
                continue;
            }
            let im = x[(pole.at + 1, c)];
            out[(pole.at, c)] = pole.alpha * re - pole.omega * im;
            out[(pole.at + 1, c)] = pole.omega * re + pole.alpha * im;
        }
    }
    for (at, block) in &mode.blocks {
        for r in 0..block.rows {
            for c in 0..x.cols {
                out[(at + r, c)] = (0..block.cols).map(|k| block[(r, k)] * x[(at + k, c)]).sum();
            }
        }
    }
    out
}

/// `X J` for columns of modal coordinates.
pub fn rates_of_columns(mode: &Mode, x: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(x.rows, x.cols);
    for r in 0..x.rows {
        for pole in &mode.poles {
            let re = x[(r, pole.at)];
            if pole.omega == 0.0 {
                out[(r, pole.at)] = pole.alpha * re;
                continue;
            }
            let im = x[(r, pole.at + 1)];
            out[(r, pole.at)] = pole.alpha * re + pole.omega * im;
            out[(r, pole.at + 1)] = pole.alpha * im - pole.omega * re;
        }
        for (at, block) in &mode.blocks {
            for c in 0..block.cols {
                out[(r, at + c)] = (0..block.rows).map(|k| x[(r, at + k)] * block[(k, c)]).sum();
            }
        }
    }
    out
}

/// `e^(J d) X` in place.
pub fn carry(mode: &Mode, d: f64, x: &mut Matrix) {
    for pole in &mode.poles {
        let grown = complex(pole.alpha, pole.omega).scale(d).exp();
        for c in 0..x.cols {
            if pole.omega == 0.0 {
                x[(pole.at, c)] *= grown.re;
            } else {
                let value = grown * complex(x[(pole.at, c)], x[(pole.at + 1, c)]);
                (x[(pole.at, c)], x[(pole.at + 1, c)]) = (value.re, value.im);
            }
        }
    }
    for (at, block) in &mode.blocks {
        let w = block.rows;
        let mut scaled = CMatrix::zeros(w, w);
        for (to, from) in scaled.data.iter_mut().zip(&block.data) {
            *to = complex(from * d, 0.0);
        }
        let grown = exponential(&scaled);
        for c in 0..x.cols {
            let old: Vec<f64> = (0..w).map(|r| x[(at + r, c)]).collect();
            for r in 0..w {
                x[(at + r, c)] = grown.row(r).iter().zip(&old).map(|(g, o)| g.re * o).sum();
            }
        }
    }
}

/// A perturbation `e^(s t) x(t)` within a segment, `x' = (J - s) x + b`: its end, and its integrals with the
/// weights `e^(-shift t)`.
pub struct Course {
    /// modal coordinates at the end
    pub end: CMatrix,
    /// one per shift
    pub integrals: Vec<CMatrix>,
}

/// The course of columns of perturbations from `x`, driven by columns `b`, over a segment of length `d`.
pub fn course(
    mode: &Mode,
    d: f64,
    s: Complex,
    shifts: &[Complex],
    x: &CMatrix,
    b: &CMatrix,
) -> Course {
    let (n, cols, zero) = (x.rows, x.cols, Complex::default());
    let mut end = CMatrix::zeros(n, cols);
    let mut integrals = vec![CMatrix::zeros(n, cols); shifts.len()];
    let half = |p: Complex, q: Complex| (p + q).scale(0.5);
    let turned = |p: Complex, q: Complex| {
        let apart = (p - q).scale(0.5);
        complex(apart.im, -apart.re) // divided by i
    };
    for pole in &mode.poles {
        let own = complex(pole.alpha, pole.omega);
        let at = pole.at;
        let sides: &[Complex] = &if pole.omega == 0.0 { vec![own] } else { vec![own, own.conj()] };
        // the coordinate and its conjugate, column by column
        let mut parts = vec![vec![[zero; 2]; cols]; 1 + shifts.len()];
        for (side, &rate) in sides.iter().enumerate() {
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let of = |m: &CMatrix, c: usize| {
                if pole.omega == 0.0 {
                    return m.row(at)[c];
                }
                let im = m.row(at + 1)[c].scale(sign);
                m.row(at)[c] + complex(-im.im, im.re)
            };
            let z = (rate - s).scale(d);
            let (grown, driven) = (z.exp(), divided(&[z, zero]).scale(d));
            for (c, part) in parts[0].iter_mut().enumerate() {
                part[side] = grown * of(x, c) + driven * of(b, c);
            }
            for (k, &shift) in shifts.iter().enumerate() {
                let (u, w) = ((rate - s - shift).scale(d), -shift.scale(d));
                let of_x = divided(&[u, zero]).scale(d);
                let of_b = divided(&[u, w, zero]).scale(d * d);
                for (c, part) in parts[1 + k].iter_mut().enumerate() {
                    part[side] = of_x * of(x, c) + of_b * of(b, c);
                }
            }
        }
        for (part, out) in parts.iter().zip(std::iter::once(&mut end).chain(&mut integrals)) {
            for (c, &[one, other]) in part.iter().enumerate() {
                if pole.omega == 0.0 {
                    out.row_mut(at)[c] = one;
                } else {
                    out.row_mut(at)[c] = half(one, other);
                    out.row_mut(at + 1)[c] = turned(one, other);
                }
            }
        }
    }
    for (at, block) in &mode.blocks {
        block_course(*at, block, d, s, shifts, [x, b], &mut end, &mut integrals);
    }
    Course { end, integrals }
}

/// The same for coordinates without eigenvectors: `y = e^(-shift t) x` with its drive and its integral is
/// the solution of one linear equation.
#[allow(clippy::too_many_arguments)] // those of `course`, and where to put the result
fn block_course(
    at: usize,
    block: &Matrix,
    d: f64,
    s: Complex,
    shifts: &[Complex],
    [x, b]: [&CMatrix; 2],
    end: &mut CMatrix,
    integrals: &mut [CMatrix],
) {
    let (w, cols) = (block.rows, x.cols);
    let size = w + cols;
    for k in 0..=shifts.len() {
        let shift = if k == 0 { Complex::default() } else { shifts[k - 1] };
        let mut m = CMatrix::zeros(size + w, size + w);
        for r in 0..w {
            for c in 0..w {
                m.row_mut(r)[c] = complex(block[(r, c)] * d, 0.0);
            }
            m.row_mut(r)[r] = m.row(r)[r] - (s + shift).scale(d);
            for c in 0..cols {
                m.row_mut(r)[w + c] = b.row(at + r)[c].scale(d);
            }
            m.row_mut(size + r)[r] = complex(d, 0.0);
        }
        for c in 0..cols {
            m.row_mut(w + c)[w + c] = -shift.scale(d);
        }
        let grown = exponential(&m);
        let out = if k == 0 { &mut *end } else { &mut integrals[k - 1] };
        let first = if k == 0 { 0 } else { size };
        for r in 0..w {
            for c in 0..cols {
                let from = grown.row(first + r);
                let own = (0..w).fold(from[w + c], |sum, j| sum + from[j] * x.row(at + j)[c]);
                out.row_mut(at + r)[c] = own;
            }
        }
    }
}
