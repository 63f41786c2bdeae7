//! Fast coordinates of a linear motion taken apart from the slow ones, so that its equations become
//! block diagonal.

use crate::dense::{add_scaled, complex, Complex, Matrix};

/// Fast rates differ from those of sources by this part of themselves at least: else the response to
/// such a source is too large to be told from what swings by itself.
const APART: f64 = 1e-3;

/// One complex coordinate, or a real one, with its places in `y`.
#[derive(Clone, Copy, Debug)]
pub struct Fast {
    pub at: [usize; 2],
    pub width: usize,
    pub rate: Complex,
    /// an input, not a state
    pub source: bool,
}

impl Fast {
    pub fn places(&self) -> &[usize] {
        &self.at[..self.width]
    }

    /// Its equations.
    pub fn matrix(&self) -> Matrix {
        turning(self.rate, self.width)
    }
}

/// Multiplication by a rate.
fn turning(rate: Complex, width: usize) -> Matrix {
    let data = match width {
        1 => vec![rate.re],
        _ => vec![rate.re, -rate.im, rate.im, rate.re],
    };
    Matrix { rows: width, cols: width, data }
}

/// Fast coordinates taken apart from the slow ones.
pub struct Apart {
    size: usize,
    pub fast: Vec<Fast>,
    /// places of the slow coordinates
    pub slow: Vec<usize>,
    /// their equations, and the powers 1, 2, 4, ... of `F / unit`
    pub f: Matrix,
    powers: Vec<Matrix>,
    unit: f64,
    /// rows, columns and factors of what is added to the rows
    shears: Vec<(Vec<usize>, Vec<usize>, Matrix)>,
}

pub fn inverse(rate: Complex) -> Complex {
    complex(1.0, 0.0) / rate
}

/// Adds a complex multiple of rows to rows: one row for a real coordinate, two for a complex one.
fn add_multiple(to: &mut Matrix, row: usize, width: usize, factor: Complex, from: &Matrix) {
    add_scaled(to.row_mut(row), factor.re, from.row(row));
    if width == 2 {
        add_scaled(to.row_mut(row), -factor.im, from.row(row + 1));
        add_scaled(to.row_mut(row + 1), factor.im, from.row(row));
        add_scaled(to.row_mut(row + 1), factor.re, from.row(row + 1));
    }
}

/// `B X - X T = C` for a coordinate that another one drives: with `C w = c w + d conj(w)` the rates
/// of the parts are those of `w` and of its conjugate.
pub(super) fn response(b: Complex, w: Complex, c: &Matrix) -> Matrix {
    let at = |r: usize, k: usize| if r < c.rows && k < c.cols { c[(r, k)] } else { 0.0 };
    let straight = complex(at(0, 0) + at(1, 1), at(1, 0) - at(0, 1)).scale(0.5);
    let turned = complex(at(0, 0) - at(1, 1), at(1, 0) + at(0, 1)).scale(0.5);
    let (x, y) = (straight / (b - w), turned / (b - w.conj()));
    let parts = [[(x + y).re, -(x - y).im], [(x + y).im, (x - y).re]];
    Matrix::from_fn(c.rows, c.cols, |r, k| parts[r][k])
}

impl Apart {
    /// Takes fast coordinates apart; slow rates are `below` a size, fast ones `above` another.  None if
    /// a source drives them at their own rate.
    pub fn new(f: &Matrix, fast: Vec<Fast>, below: f64, above: f64) -> Option<Apart> {
        let size = f.rows;
        let mut is_fast = vec![false; size];
        fast.iter().for_each(|b| b.places().iter().for_each(|&i| is_fast[i] = true));
        let slow: Vec<usize> = (0..size).filter(|&i| !is_fast[i]).collect();
        let own = f.select_rows(&slow).select_cols(&slow);
        let (mut powers, mut unit) = (Vec::new(), 1.0);
        if !fast.is_empty() {
            unit = (above * below.max(1e-3 * above)).sqrt();
            let ratio = (below / above).max(1e-9);
            let count = ((45.0 / -ratio.ln()).log2().ceil().max(2.0) + 1.0) as usize;
            let mut power = own.clone();
            power.data.iter_mut().for_each(|v| *v /= unit);
            for _ in 1..count {
                let next = power.times(&power);
                powers.push(power);
                power = next;
            }
            powers.push(power);
        }
        let mut out = Apart { size, fast, slow, f: own, powers, unit, shears: Vec::new() };
        let (sources, states): (Vec<Fast>, Vec<Fast>) = out.fast.iter().partition(|b| b.source);
        let places = |list: &[Fast]| -> Vec<usize> {
            list.iter().flat_map(|b| b.places().to_vec()).collect()
        };
        let (at_sources, at_states) = (places(&sources), places(&states));
        let part = |rows: &[usize], cols: &[usize]| f.select_rows(rows).select_cols(cols);
        let mut driven = part(&at_states, &at_sources);
        if !sources.is_empty() {
            // what fast sources do to slow coordinates: F Y - Y T = F_w
            let right = part(&out.slow, &at_sources).transpose();
            let turned: Vec<Matrix> = out.powers.iter().map(Matrix::transpose).collect();
            let y = out.series(&sources, [-1.0, 1.0], Complex::conj, right, &turned).transpose();
            // y_slow = y~ - Y w reaches the fast states as well
            driven.add_scaled(-1.0, &part(&at_states, &out.slow).times(&y));
            out.shears.push((out.slow.clone(), at_sources.clone(), y));
        }
        if !states.is_empty() {
            // what slow coordinates do to fast states: B Z - Z F = F_b
            let right = part(&at_states, &out.slow);
            let z = out.series(&states, [1.0, 1.0], |rate| rate, right, &out.powers);
            out.shears.push((at_states, out.slow.clone(), z));
        }
        // what fast sources do to fast states: B X - X T = C
        let mut row = 0;
        for b in &states {
            let mut column = 0;
            for w in &sources {
                let c = Matrix::from_fn(b.width, w.width, |r, k| driven[(row + r, column + k)]);
                column += w.width;
                if c.max_abs() == 0.0 {
                    continue;
                }
                let near = |rate: Complex| (b.rate - rate).abs() < APART * b.rate.abs();
                if near(w.rate) || near(w.rate.conj()) {
                    return None;
                }
                let x = response(b.rate, w.rate, &c);
                out.shears.push((b.places().to_vec(), w.places().to_vec(), x));
            }
            row += b.width;
        }
        Some(out)
    }

    /// `sum (s B^-1)^k (r B^-1 R) F^k` for the rows of some fast coordinates, whose rates are turned
    /// first; with the signs `r`, `s` it solves `B X - s X F = r R`.
    fn series(
        &self,
        fast: &[Fast],
        [first, step]: [f64; 2],
        turn: impl Fn(Complex) -> Complex,
        right: Matrix,
        powers: &[Matrix],
    ) -> Matrix {
        let mut factors: Vec<Complex> = fast.iter().map(|b| turn(inverse(b.rate))).collect();
        let mut sum = Matrix::zeros(right.rows, right.cols);
        let add = |to: &mut Matrix, factors: &[Complex], from: &Matrix| {
            let mut row = 0;
            for (b, &factor) in fast.iter().zip(factors) {
                add_multiple(to, row, b.width, factor, from);
                row += b.width;
            }
        };
        let begin: Vec<Complex> = factors.iter().map(|f| f.scale(first)).collect();
        add(&mut sum, &begin, &right);
        factors.iter_mut().for_each(|f| *f = f.scale(step * self.unit));
        for power in powers {
            let more = sum.times(power);
            add(&mut sum, &factors, &more);
            factors.iter_mut().for_each(|f| *f = *f * *f);
        }
        sum
    }

    /// The new coordinates as combinations of the old ones' columns, one per row; and the shears that
    /// lead from old coordinates to new ones.
    pub fn columns(&self, shears: &mut Vec<(u32, u32, f64)>) -> Matrix {
        // y~ = S3 S2 S1 y, so that y = S1^-1 S2^-1 S3^-1 y~
        let mut columns = Matrix::identity(self.size);
        for (rows, cols, m) in &self.shears {
            for (r, &i) in rows.iter().enumerate() {
                let row = columns.row(i).to_vec();
                for (c, &j) in cols.iter().enumerate() {
                    let value = m[(r, c)];
                    if value != 0.0 {
                        shears.push((i as u32, j as u32, value));
                        add_scaled(columns.row_mut(j), -value, &row);
                    }
                }
            }
        }
        columns
    }

    /// Forms of a fast and a slow coordinate whose change is `2 Q`: `B' P + P F = 2 Q`, a row for each
    /// real fast coordinate, in their order.
    pub fn mixed(&self, q: &Matrix) -> Matrix {
        let rows: Vec<usize> = self.fast.iter().flat_map(|b| b.places().to_vec()).collect();
        let mut right = q.select_rows(&rows).select_cols(&self.slow);
        right.data.iter_mut().for_each(|v| *v *= 2.0);
        self.series(&self.fast, [1.0, -1.0], Complex::conj, right, &self.powers)
    }
}
