//! Integrals of products of two coordinates over a segment, from their values at both ends.

use super::apart::{inverse, Apart};
use super::integral::SLOW;
use crate::dense::{complex, dot, Complex, Matrix};

/// Derivatives of the power at both ends, and their weights: `h / 2`, `3 h^2 / 28` and so on.
pub const ORDER: usize = 4;
const WEIGHTS: [f64; ORDER] = [0.5, 3.0 / 28.0, 1.0 / 84.0, 1.0 / 1680.0];

/// Two quantities: what is dissipated, and what is delivered.
pub type Two = [f64; 2];

/// Products of two coordinates, with factors for both quantities and all orders.
#[derive(Clone, Debug)]
struct Products<const N: usize> {
    list: Vec<(u32, u32, [Two; N])>,
}

/// Integrals for segments of similar length.
pub struct Integral {
    /// lengths for which it is made [s]
    pub shortest: f64,
    /// see `shortest`
    pub longest: f64,
    /// `y[row] += factor y[column]`, one after the other
    shears: Vec<(u32, u32, f64)>,
    slow: Products<ORDER>,
    closed: Products<1>,
}

impl<const N: usize> Products<N> {
    fn add(&mut self, i: usize, j: usize, factor: [Two; N]) {
        if factor.iter().flatten().any(|f| *f != 0.0) {
            self.list.push((i as u32, j as u32, factor));
        }
    }
}

impl Integral {
    /// The integrals of two forms, in the coordinates that are taken apart, for segments of about a
    /// length; `range` of lengths for which these coordinates are right.
    pub fn new(
        apart: &Apart,
        shears: Vec<(u32, u32, f64)>,
        forms: [&Matrix; 2],
        length: f64,
        [shortest, longest]: [f64; 2],
    ) -> Integral {
        let (slow, closed) = (Products { list: Vec::new() }, Products { list: Vec::new() });
        let mut out = Integral { shortest, longest, shears, slow, closed };
        out.slow_pairs(apart, forms);
        out.mixed_pairs(apart, forms);
        out.fast_pairs(apart, forms, length);
        out
    }

    /// Pairs of slow coordinates.
    fn slow_pairs(&mut self, apart: &Apart, forms: [&Matrix; 2]) {
        let mut rows = Vec::with_capacity(ORDER);
        let mut q = forms.map(|q| q.select_rows(&apart.slow).select_cols(&apart.slow));
        for weight in WEIGHTS {
            let next = q.each_ref().map(|q| {
                let right = q.times(&apart.f);
                let mut both = right.transpose();
                both.add_scaled(1.0, &right);
                both
            });
            rows.push((weight, std::mem::replace(&mut q, next)));
        }
        for (r, &i) in apart.slow.iter().enumerate() {
            for (c, &j) in apart.slow.iter().enumerate().skip(r) {
                let twice = if r == c { 1.0 } else { 2.0 };
                let factor = |k: usize| {
                    let (weight, q) = &rows[k];
                    [0, 1].map(|what: usize| weight * twice * q[what][(r, c)])
                };
                self.slow.add(i, j, std::array::from_fn(factor));
            }
        }
    }

    /// Pairs of a fast and a slow coordinate: `B' P + P F = 2 Q`.
    fn mixed_pairs(&mut self, apart: &Apart, forms: [&Matrix; 2]) {
        let p = forms.map(|q| apart.mixed(q));
        let places = apart.fast.iter().flat_map(|b| b.places());
        for (r, &i) in places.enumerate() {
            for (c, &j) in apart.slow.iter().enumerate() {
                self.closed.add(i, j, [[0, 1].map(|what: usize| p[what][(r, c)])]);
            }
        }
    }

    /// Pairs of fast coordinates: complex products `x y` and `x conj(y)`, each with a rate of its own.
    fn fast_pairs(&mut self, apart: &Apart, forms: [&Matrix; 2], length: f64) {
        for (k, b) in apart.fast.iter().enumerate() {
            for other in &apart.fast[k..] {
                let twice = if b.at == other.at { 1.0 } else { 2.0 };
                let kinds = if b.width == 2 && other.width == 2 { 2 } else { 1 };
                for kind in 0..kinds {
                    let second = if kind == 0 { other.rate } else { other.rate.conj() };
                    let rate = b.rate + second;
                    // below, products are as slow as those with a series
                    let closed = rate.abs() * length > SLOW;
                    if !closed {
                        self.longest = self.longest.min(2.0 * SLOW / rate.abs());
                    }
                    // the form is the real part of `factor x y` (or `x conj(y)`)
                    let factor = forms.map(|q| {
                        let at = |r: usize, c: usize| match (
                            b.at[..b.width].get(r),
                            other.at[..other.width].get(c),
                        ) {
                            (Some(&i), Some(&j)) => twice * q[(i, j)],
                            _ => 0.0,
                        };
                        match (kinds, kind) {
                            (2, 0) => {
                                complex(0.5 * (at(0, 0) - at(1, 1)), -0.5 * (at(0, 1) + at(1, 0)))
                            }
                            (2, _) => {
                                complex(0.5 * (at(0, 0) + at(1, 1)), -0.5 * (at(1, 0) - at(0, 1)))
                            }
                            // one of them is real
                            _ => complex(at(0, 0), -(at(0, 1) + at(1, 0))),
                        }
                    });
                    let spread = |factor: [Complex; 2]| {
                        // of re re, re im, im re, im im
                        let sign = if kind == 0 { 1.0 } else { -1.0 };
                        let parts = [
                            (0, 0, factor.map(|f| f.re)),
                            (0, 1, factor.map(|f| -sign * f.im)),
                            (1, 0, factor.map(|f| -f.im)),
                            (1, 1, factor.map(|f| -sign * f.re)),
                        ];
                        parts.map(|(r, c, f)| {
                            let inside = r < b.width && c < other.width;
                            inside.then(|| (b.at[r], other.at[c], f))
                        })
                    };
                    if closed {
                        let found = factor.map(|f| f * inverse(rate));
                        for (i, j, f) in spread(found).into_iter().flatten() {
                            self.closed.add(i, j, [f]);
                        }
                        continue;
                    }
                    let mut power = complex(1.0, 0.0);
                    for (order, weight) in WEIGHTS.into_iter().enumerate() {
                        let found = factor.map(|f| (f * power).scale(weight));
                        for (i, j, f) in spread(found).into_iter().flatten() {
                            let mut all = [[0.0; 2]; ORDER];
                            all[order] = f;
                            self.slow.add(i, j, all);
                        }
                        power = power * rate;
                    }
                }
            }
        }
    }

    /// Numbers held.
    pub fn size(&self) -> usize {
        3 * self.shears.len() + (1 + 2 * ORDER) * self.slow.list.len() + 3 * self.closed.list.len()
    }

    /// Products that it adds up.
    pub fn work(&self) -> usize {
        ORDER * self.slow.list.len() + self.closed.list.len()
    }

    /// Changes of coordinates.
    #[cfg(test)]
    pub fn sheared(&self) -> usize {
        self.shears.len()
    }

    /// The integrals over a segment of the length `h` from `a` to `b`, in the coordinates of the
    /// motion, which are changed here.
    pub fn over(&self, h: f64, a: &mut [f64], b: &mut [f64]) -> Two {
        for &(row, column, factor) in &self.shears {
            let (row, column) = (row as usize, column as usize);
            a[row] += factor * a[column];
            b[row] += factor * b[column];
        }
        let mut sums = [[0.0; 2]; ORDER];
        for (i, j, factor) in &self.slow.list {
            let (i, j) = (*i as usize, *j as usize);
            let (begin, end) = (a[i] * a[j], b[i] * b[j]);
            let both = [begin + end, begin - end];
            for (k, (sum, factor)) in sums.iter_mut().zip(factor).enumerate() {
                sum[0] += factor[0] * both[k % 2];
                sum[1] += factor[1] * both[k % 2];
            }
        }
        let mut out = [0.0; 2];
        for (i, j, [factor]) in &self.closed.list {
            let (i, j) = (*i as usize, *j as usize);
            let change = b[i] * b[j] - a[i] * a[j];
            out[0] += factor[0] * change;
            out[1] += factor[1] * change;
        }
        let powers = [h, h * h, h * h * h, h * h * (h * h)];
        for (what, out) in out.iter_mut().enumerate() {
            *out += dot(&sums.map(|sum| sum[what]), &powers);
        }
        out
    }
}
