//! Integrals of quadratic forms along the motion of a mode, from its states at both ends.
//!
//! With `y = [x; v; v']` (`v'` where it does not follow from `v`) a motion obeys `y' = F y`.  Rates are
//! *slow* or *fast* beside a segment.  Of slow coordinates the integral is that of the Hermite
//! polynomial of the power: with the first three derivatives at both ends, `p' = y' (F' Q + Q F) y` and
//! so on, its error is `(4!)^2 / (8! 9!) (s h)^8 = 4e-8 (s h)^8` of the power times `h`, `s` the sum of
//! two rates.  What is fast is taken apart from the slow ([`super::apart`]), `F` becoming block
//! diagonal, so that pairs of coordinates one of which is fast have an integral in closed form:
//! `y_f' P y` with `B' P + P F = Q`.

use super::apart::{Apart, Fast};
use super::products::Integral;
use super::spectrum::Pole;
use crate::dense::{complex, Complex, Matrix};

/// Slow rates times the length; two of them make an error of 4e-8 x 0.4^8 = 3e-11.
pub const SLOW: f64 = 0.2;
/// Fast rates times the length at least: closed forms lose digits with its third power.
const FAST: f64 = SLOW / 16.0;

/// A rotation or decay among the inputs: `v[re] + i v[im]` turns with a rate; `re` and `im` are the
/// same if it is real.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    pub re: usize,
    pub im: usize,
    pub rate: Complex,
    /// from the start of the run on
    pub always: bool,
}

/// Equations of motion in the coordinates that count.
pub struct Motion {
    /// states
    n: usize,
    /// inputs that count, by their number in v, and those of them whose rates count
    inputs: Vec<usize>,
    rated: Vec<usize>,
    turns: Vec<Turn>,
    /// `F`
    f: Matrix,
    /// rates with their coordinates; without any those of a block, which cannot be fast
    rates: Vec<(f64, Option<Fast>)>,
}

impl Motion {
    /// The motion `x' = J x + drive v` with the eigenvalues of J, and blocks without eigenvectors;
    /// `counts` tells which inputs count beside those that drive it.
    pub fn new(
        poles: &[Pole],
        blocks: &[(usize, Matrix)],
        drive: &Matrix,
        turns: &[Turn],
        counts: impl Fn(usize) -> bool,
    ) -> Motion {
        let (n, nv) = (drive.rows, drive.cols);
        let mut used: Vec<bool> =
            (0..nv).map(|i| counts(i) || (0..n).any(|r| drive[(r, i)] != 0.0)).collect();
        for turn in turns {
            let both = used[turn.re] || used[turn.im];
            (used[turn.re], used[turn.im]) = (both, both);
        }
        let inputs: Vec<usize> = (0..nv).filter(|&i| used[i]).collect();
        let turning_always = |i: usize| turns.iter().any(|t| t.always && (t.re == i || t.im == i));
        // the first of all is constant
        let rated: Vec<usize> =
            inputs.iter().copied().filter(|&i| i > 0 && !turning_always(i)).collect();
        let first = n + inputs.len();
        let size = first + rated.len();
        let mut f = Matrix::zeros(size, size);
        let mut rates = Vec::new();
        for pole in poles {
            let (width, rate) =
                (if pole.omega == 0.0 { 1 } else { 2 }, complex(pole.alpha, pole.omega));
            let fast = Fast { at: [pole.at, pole.at + 1], width, rate, source: false };
            put(&mut f, fast.places(), &fast.matrix());
            rates.push((rate.abs(), Some(fast)));
        }
        for (at, block) in blocks {
            let places: Vec<usize> = (*at..at + block.rows).collect();
            put(&mut f, &places, block);
            rates.push((super::block::row_norm(block), None));
        }
        for (k, &i) in inputs.iter().enumerate() {
            for r in 0..n {
                f[(r, n + k)] = drive[(r, i)];
            }
            if let Some(at) = rated.iter().position(|&other| other == i) {
                f[(n + k, first + at)] = 1.0;
            }
        }
        for turn in turns {
            let (list, first) = if turn.always { (&inputs, n) } else { (&rated, first) };
            let place = |i: usize| list.iter().position(|&k| k == i).map(|k| first + k);
            if let (Some(re), Some(im)) = (place(turn.re), place(turn.im)) {
                let width = if turn.re == turn.im { 1 } else { 2 };
                let fast = Fast { at: [re, im], width, rate: turn.rate, source: true };
                put(&mut f, fast.places(), &fast.matrix());
                rates.push((turn.rate.abs(), Some(fast)));
            }
        }
        rates.sort_by(|a, b| a.0.total_cmp(&b.0));
        Motion { n, inputs, rated, turns: turns.to_vec(), f, rates }
    }

    /// Number of coordinates.
    pub fn size(&self) -> usize {
        self.f.rows
    }

    /// The largest rate [1/s].
    pub fn fastest(&self) -> f64 {
        self.rates.last().map_or(0.0, |r| r.0)
    }

    /// States, inputs and their rates at which one coordinate is 1 and the others vanish.
    pub fn unit(&self, coordinate: usize, [x, v, d]: [&mut [f64]; 3]) {
        for list in [&mut *x, &mut *v, &mut *d] {
            list.fill(0.0);
        }
        let (n, count) = (self.n, self.inputs.len());
        match coordinate.checked_sub(n) {
            None => x[coordinate] = 1.0,
            Some(k) if k < count => v[self.inputs[k]] = 1.0,
            Some(k) => d[self.rated[k - count]] = 1.0,
        }
        for turn in self.turns.iter().filter(|t| t.always) {
            let im = if turn.re == turn.im { 0.0 } else { v[turn.im] };
            let change = turn.rate * complex(v[turn.re], im);
            d[turn.im] = change.im;
            d[turn.re] = change.re;
        }
    }

    /// Adds the coordinates of a point to a list.
    #[inline]
    pub fn gather(&self, [x, v, d]: [&[f64]; 3], y: &mut Vec<f64>) {
        y.extend_from_slice(&x[..self.n]);
        y.extend(self.inputs.iter().map(|&i| v[i]));
        y.extend(self.rated.iter().map(|&i| d[i]));
    }

    /// How many of the rates are slow in segments of a length: up to the widest gap.
    fn slow_rates(&self, length: f64) -> Option<usize> {
        let (limit, floor) = (SLOW / length, FAST / length);
        let count = self.rates.len();
        if self.fastest() <= limit {
            return Some(count);
        }
        let mut best = (1.0, None);
        for k in 0..count {
            let below = if k > 0 { self.rates[k - 1].0 } else { 0.0 };
            let above = self.rates[k].0;
            if below > limit {
                break;
            }
            if above >= floor && above > best.0 * below {
                best = (above / below.max(f64::MIN_POSITIVE), Some(k));
            }
        }
        best.1.filter(|&k| self.rates[k..].iter().all(|r| r.1.is_some()))
    }

    /// Integrals for segments of about a length of `sum y_i y_j form(i, j)`, the form being given by
    /// `forms` for columns of the coordinates: combinations of the coordinates' own, one per row.
    /// None if some rates can be told neither slow nor fast.
    pub fn integral(
        &self,
        length: f64,
        forms: impl FnOnce(&Matrix) -> [Matrix; 2],
    ) -> Option<Integral> {
        let slow = self.slow_rates(length)?;
        let fast: Vec<Fast> = self.rates[slow..].iter().filter_map(|r| r.1).collect();
        let below = if slow > 0 { self.rates[slow - 1].0 } else { 0.0 };
        let above = self.rates.get(slow).map_or(f64::INFINITY, |r| r.0);
        let shortest = if fast.is_empty() { 0.0 } else { 0.999 * FAST / above };
        let apart = Apart::new(&self.f, fast, below, above)?;
        let mut shears = Vec::new();
        let [lost, given] = forms(&apart.columns(&mut shears));
        let range = [shortest, 1.001 * SLOW / below];
        Some(Integral::new(&apart, shears, [&lost, &given], length, range))
    }
}

/// Adds a block to a matrix.
fn put(f: &mut Matrix, places: &[usize], block: &Matrix) {
    for (r, &i) in places.iter().enumerate() {
        for (c, &j) in places.iter().enumerate() {
            f[(i, j)] += block[(r, c)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::dot;

    /// `y(t)` by the series of the exponential over short pieces.
    fn moved(f: &Matrix, y: &[f64], t: f64) -> Vec<f64> {
        let pieces = (t * super::super::block::row_norm(f) / 0.5).ceil().max(1.0);
        let mut y = y.to_vec();
        for _ in 0..pieces as usize {
            let mut term = y.clone();
            for k in 1..24 {
                let mut next = vec![0.0; y.len()];
                f.apply(&term, &mut next);
                term = next.iter().map(|v| v * t / pieces / f64::from(k)).collect();
                y.iter_mut().zip(&term).for_each(|(y, t)| *y += t);
            }
        }
        y
    }

    /// The integral of `y' Q y` by the rule of Simpson in pieces, twice as many for each halving, with
    /// the corrections of Romberg.
    fn by_quadrature(f: &Matrix, q: &Matrix, y0: &[f64], h: f64) -> f64 {
        let power = |y: &[f64]| {
            let mut image = vec![0.0; y.len()];
            q.apply(y, &mut image);
            dot(y, &image)
        };
        let most = 1usize << 12;
        let mut values = Vec::with_capacity(most + 1);
        let mut y = y0.to_vec();
        for k in 0..=most {
            values.push(power(&y));
            if k < most {
                y = moved(f, &y, h / most as f64);
            }
        }
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for level in 0..=12 {
            let step = most >> level;
            let inner: f64 = (1..(1 << level)).map(|k| values[k * step]).sum();
            let trapezoid = h / f64::from(1 << level) * (0.5 * (values[0] + values[most]) + inner);
            let mut row = vec![trapezoid];
            if let Some(last) = rows.last() {
                for (k, old) in last.iter().enumerate() {
                    let four = 4f64.powi(k as i32 + 1);
                    row.push((four * row[k] - old) / (four - 1.0));
                }
            }
            rows.push(row);
        }
        rows[12][6]
    }

    #[test]
    fn integrals_are_those_of_a_quadrature_whatever_is_fast() {
        compare(true);
        compare(false);
    }

    fn compare(always: bool) {
        // a decay, a swinging pair, a slow and a resting state, driven by a constant, a line, a tone
        // and a decay
        let poles =
            [(0, -3.0, 0.0), (1, -0.2, 5.0), (3, -0.01, 0.0), (4, 0.0, 0.0), (5, -40.0, 0.0)]
                .map(|(at, alpha, omega)| Pole { at, alpha, omega });
        let drive = Matrix::from_fn(6, 5, |r, c| ((3 * r + 5 * c) % 7) as f64 - 2.5);
        let turns = [
            Turn { re: 3, im: 2, rate: complex(-0.1, 9.0), always },
            Turn { re: 4, im: 4, rate: complex(-1.5, 0.0), always },
        ];
        let motion = Motion::new(&poles, &[], &drive, &turns, |_| true);
        let size = motion.size();
        assert_eq!(size, if always { 12 } else { 15 });
        let [first, second] = [1usize, 4].map(|by| {
            let entry = |i: usize, j: usize| ((by * (i + j) + i * j) % 11) as f64 - 4.6;
            Matrix::from_fn(size, size, entry)
        });
        let v = [1.0, 0.4, -0.6, 0.8, 1.3];
        let mut d = vec![0.0, 0.7, 0.0, 0.0, -1.5 * 1.3];
        let change = complex(-0.1, 9.0) * complex(v[3], v[2]);
        (d[2], d[3]) = (change.im, change.re);
        let mut y0 = Vec::new();
        motion.gather([&[0.5, -1.0, 0.3, 2.0, 0.9, -0.2], &v, &d], &mut y0);
        let mut shears = Vec::new();
        for h in [1e-6, 1e-3, 0.02, 0.07, 0.3, 1.0] {
            let forms = |columns: &Matrix| {
                [&first, &second].map(|q| columns.times(q).times(&columns.transpose()))
            };
            let integral = motion.integral(h, forms).unwrap_or_else(|| unreachable!());
            assert!(integral.shortest <= h && h <= integral.longest);
            shears.push(integral.sheared());
            let (mut a, mut b) = (y0.clone(), moved(&motion.f, &y0, h));
            let found = integral.over(h, &mut a, &mut b);
            for (found, q) in found.into_iter().zip([&first, &second]) {
                let expected = by_quadrature(&motion.f, q, &y0, h);
                assert!(
                    (found - expected).abs() < 3e-10 * expected.abs(),
                    "{h} {found} {expected}"
                );
            }
        }
        // nothing is fast in short segments, sources are in long ones
        assert_eq!(shears[..2], [0, 0]);
        assert!(shears.windows(2).all(|w| w[0] <= w[1]) && shears[5] > 0);
    }

    #[test]
    fn what_cannot_be_taken_apart_is_refused() {
        let turn = Turn { re: 2, im: 1, rate: complex(0.0, 5.0), always: true };
        let drive = Matrix::from_fn(2, 3, |r, c| (r + c) as f64);
        let form = |columns: &Matrix| [0, 1].map(|_| columns.times(&columns.transpose()));
        // a swing at resonance, in segments of one turn and of a tenth of it
        for (alpha, resonant) in [(0.0, true), (-0.2, false)] {
            let pole = Pole { at: 0, alpha, omega: 5.0 };
            let motion = Motion::new(&[pole], &[], &drive, &[turn], |_| true);
            assert_eq!(motion.integral(1.0, form).is_none(), resonant);
            assert!(motion.integral(0.01, form).is_some());
        }
        // a double rate
        let block = Matrix { rows: 2, cols: 2, data: vec![-5.0, 1.0, 0.0, -5.0] };
        let motion = Motion::new(&[], &[(0, block)], &drive, &[turn], |_| true);
        assert!(motion.integral(1.0, form).is_none());
        assert!(motion.integral(0.01, form).is_some());
    }
}
