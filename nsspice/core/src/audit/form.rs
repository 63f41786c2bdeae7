//! A quadratic form as a sum of squares.

use crate::dense::Matrix;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// Sums of a row that are smaller than this part of its entries are their rounding.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// What is left of the square of a winding without leakage, in parts of it, is rounding.
const LEFT: f64 = 16.0 * f64::EPSILON;

/// Most points of a step.
const MOST: usize = 8;

/// `l`, by unknowns, and `c` of `c (l' x)^2`.
type Square = (Vec<(u32, f64)>, f64);

/// The symmetric part `M` of a matrix as `x' M x = sum c (x_i + s x_j)^2 + sum d x_i^2 + sum r x_i x_j`
/// with `s = 1` or `-1`: one square for each element between two nodes, without the cancellation of the
/// entries that they share.
///
/// What only one of two laws has of the other's unknown is a controlled source.  Its power is a product, of a
/// current and a voltage at another place: as squares it would have the rounding of the larger one's.
///
/// Coupled windings are `sum c (l' x)^2` by elimination: without leakage, the rates of their currents may
/// be beyond all that is stored, and only the ampere turns of all are not.
#[derive(Clone, Debug, Default)]
pub struct Form {
    /// `i`, `j`, `s`, `c`
    pub pairs: Vec<(u32, u32, f64, f64)>,
    /// `i`, `d`
    pub single: Vec<(u32, f64)>,
    /// `l` and `c`
    pub combined: Vec<Square>,
    /// `i`, `j`, `r`
    pub products: Vec<(u32, u32, f64)>,
}

impl Form {
    pub fn new(matrix: &Csc) -> Form {
        // by the place in the upper triangle: entries of the upper and of the lower one
        let mut upper: Vec<(u32, u32, [f64; 2])> = matrix
            .iter()
            .map(|(r, c, v)| {
                (r.min(c) as u32, r.max(c) as u32, if r <= c { [v, 0.0] } else { [0.0, v] })
            })
            .collect();
        upper.sort_by_key(|e| (e.0, e.1));
        let mut pairs: Vec<(u32, u32, f64, f64)> = Vec::new();
        let mut products = Vec::new();
        let mut rest = vec![[0.0f64; 2]; matrix.nrows];
        for group in upper.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (i, j, _) = group[0];
            let [a, b] = [0, 1].map(|side| group.iter().map(|e| e.2[side]).sum::<f64>());
            let size: f64 = group.iter().map(|e| e.2[0].abs() + e.2[1].abs()).sum();
            if i == j {
                let [sum, sizes] = &mut rest[i as usize];
                *sum += a;
                *sizes += size;
                continue;
            }
            let shared = if a * b > 0.0 { a.signum() * a.abs().min(b.abs()) } else { 0.0 };
            if shared != 0.0 {
                pairs.push((i, j, shared.signum(), shared.abs()));
            }
            let own = (a - shared) + (b - shared);
            if own.abs() > ROUNDED * size {
                products.push((i, j, own));
            }
        }
        for &(i, j, _, size) in &pairs {
            for k in [i, j] {
                let [sum, sizes] = &mut rest[k as usize];
                *sum -= size;
                *sizes += size;
            }
        }
        let left = rest.iter().enumerate().filter(|(_, [sum, sizes])| sum.abs() > ROUNDED * sizes);
        let single = left.map(|(k, [sum, _])| (k as u32, *sum)).collect();
        let mut out = Form { pairs, single, combined: Vec::new(), products };
        out.combine(matrix);
        out
    }

    /// Puts combinations in the place of squares of which some are negative, where that leaves none.
    fn combine(&mut self, matrix: &Csc) {
        let mut together = UnionFind::new(matrix.nrows);
        self.pairs.iter().for_each(|p| _ = together.join(p.0 as usize, p.1 as usize));
        let mut negative = vec![false; matrix.nrows];
        let below = self.single.iter().filter(|s| s.1 < 0.0);
        below.for_each(|s| negative[s.0 as usize] = true);
        for rows in together.groups(0..matrix.nrows) {
            if !rows.iter().any(|&row| negative[row]) {
                continue;
            }
            let Some(squares) = eliminated(matrix, &rows) else { continue };
            self.pairs.retain(|p| !rows.contains(&(p.0 as usize)));
            self.single.retain(|s| !rows.contains(&(s.0 as usize)));
            let inside = |k: u32| rows.contains(&(k as usize));
            self.products.retain(|p| !(inside(p.0) && inside(p.1)));
            self.combined.extend(squares);
        }
    }

    /// `x' M x`
    #[inline]
    pub fn at(&self, x: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for &(i, j, sign, c) in &self.pairs {
            let v = x(i as usize) + sign * x(j as usize);
            sum += c * v * v;
        }
        for &(i, c) in &self.single {
            let v = x(i as usize);
            sum += c * v * v;
        }
        for (l, c) in &self.combined {
            let v = combination(l, &x);
            sum += c * v * v;
        }
        for &(i, j, r) in &self.products {
            sum += r * x(i as usize) * x(j as usize);
        }
        sum
    }

    /// `x' M y`
    pub fn between(&self, x: &[f64], y: &[f64]) -> f64 {
        let mut sum = 0.0;
        for &(i, j, sign, c) in &self.pairs {
            let (i, j) = (i as usize, j as usize);
            sum += c * (x[i] + sign * x[j]) * (y[i] + sign * y[j]);
        }
        for &(i, c) in &self.single {
            sum += c * x[i as usize] * y[i as usize];
        }
        for (l, c) in &self.combined {
            sum += c * combination(l, |k| x[k]) * combination(l, |k| y[k]);
        }
        for &(i, j, r) in &self.products {
            let (i, j) = (i as usize, j as usize);
            sum += 0.5 * r * (x[i] * y[j] + x[j] * y[i]);
        }
        sum
    }

    /// `sum w_ij k_i' M k_j` over the points `k` of a step.
    pub fn products(&self, points: &[&[f64]], w: &[f64]) -> f64 {
        let mut sum = 0.0;
        for &(i, j, sign, c) in &self.pairs {
            sum += c * products(points, w, |k| k[i as usize] + sign * k[j as usize]);
        }
        for &(i, c) in &self.single {
            sum += c * products(points, w, |k| k[i as usize]);
        }
        for (l, c) in &self.combined {
            sum += c * products(points, w, |k| combination(l, |j| k[j]));
        }
        for &(i, j, r) in &self.products {
            for (row, a) in w.chunks_exact(points.len()).zip(points) {
                for (w, b) in row.iter().zip(points) {
                    let (i, j) = (i as usize, j as usize);
                    sum += 0.5 * r * w * (a[i] * b[j] + a[j] * b[i]);
                }
            }
        }
        sum
    }
}

/// `l' x`
#[inline]
fn combination(l: &[(u32, f64)], x: impl Fn(usize) -> f64) -> f64 {
    l.iter().map(|&(k, factor)| factor * x(k as usize)).sum()
}

/// The squares of some rows of a symmetric matrix by elimination; `None` if it has negative ones.
fn eliminated(matrix: &Csc, rows: &[usize]) -> Option<Vec<Square>> {
    let mut block = Matrix::zeros(rows.len(), rows.len());
    let place = |row: usize| rows.iter().position(|&own| own == row);
    for (r, c, v) in matrix.iter() {
        if let (Some(i), Some(j)) = (place(r), place(c)) {
            block[(i, j)] += 0.5 * v;
            block[(j, i)] += 0.5 * v;
        }
    }
    let size: Vec<f64> = (0..rows.len()).map(|k| block[(k, k)]).collect();
    let mut open: Vec<usize> = (0..rows.len()).collect();
    let mut out = Vec::new();
    while !open.is_empty() {
        let share = |k: usize| block[(k, k)] / size[k];
        let place = (0..open.len()).max_by(|&a, &b| share(open[a]).total_cmp(&share(open[b])))?;
        let pivot = open[place];
        let c = block[(pivot, pivot)];
        let rounding = |i: usize, j: usize| {
            block[(i, j)].abs() <= LEFT * (size[i].abs() * size[j].abs()).sqrt()
        };
        if rounding(pivot, pivot) || c.is_nan() || c < 0.0 {
            let nothing = |&i: &usize| open.iter().all(|&j| rounding(i, j));
            return open.iter().all(nothing).then_some(out);
        }
        let l: Vec<f64> = open.iter().map(|&k| block[(pivot, k)] / c).collect();
        for (&i, a) in open.iter().zip(&l) {
            for (&j, b) in open.iter().zip(&l) {
                block[(i, j)] -= c * a * b;
            }
        }
        let place_of = |k: &usize| rows[*k] as u32;
        out.push((open.iter().map(place_of).zip(l).collect(), c));
        open.swap_remove(place);
    }
    Some(out)
}

/// `sum w_ij v_i v_j` over values `v` at points.
#[inline]
fn products(points: &[&[f64]], w: &[f64], value: impl Fn(&[f64]) -> f64) -> f64 {
    let mut values = [0.0; MOST];
    let values = &mut values[..points.len()];
    values.iter_mut().zip(points).for_each(|(v, point)| *v = value(point));
    let rows = w.chunks_exact(values.len()).zip(&*values);
    rows.map(|(row, a)| a * row.iter().zip(&*values).map(|(w, b)| w * b).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windings_without_leakage_are_one_square() {
        // 1, 4 and 9 H, beside a leakage of 0.1 H in the second case
        for leakage in [0.0, 0.1] {
            let turns = [1.0, 2.0, -3.0];
            let mut entries: Vec<_> =
                (0..9).map(|k| (k / 3, k % 3, turns[k / 3] * turns[k % 3])).collect();
            entries.push((1, 1, leakage));
            let form = Form::new(&Csc::from_triplets(3, 3, &entries));
            assert!(form.pairs.is_empty() && form.single.is_empty());
            assert_eq!(form.combined.len(), if leakage > 0.0 { 2 } else { 1 });
            // of currents whose ampere turns cancel nothing is stored
            let x = [3e16, 3e16, 3e16];
            let stored = 0.5 * form.at(|k| x[k]);
            assert!((stored - 0.5 * leakage * 9e32).abs() < 1e-14 * 9e32 * leakage.max(1e-16));
            let y = [1.0, 0.0, 0.0];
            assert!((form.between(&y, &y) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_power_of_a_controlled_source_is_a_product() {
        // 2 S between two nodes, and a source in the law of a branch that a voltage of 1 kV controls
        let entries = [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0), (2, 1, -1e6)];
        let form = Form::new(&Csc::from_triplets(3, 3, &entries));
        assert_eq!((&form.pairs[..], &form.single[..]), (&[(0, 1, -1.0, 2.0)][..], &[][..]));
        assert_eq!(form.products, [(1, 2, -1e6)]);
        // as squares: 1e12 W, of which a pico would be lost in rounding
        let x = [1e3, 1e3, 1e-12];
        assert_eq!(form.at(|k| x[k]), -1e6 * 1e3 * 1e-12);
        assert_eq!(form.between(&x, &x), form.at(|k| x[k]));
        assert_eq!(form.products(&[&x, &x], &[1.0, 0.5, 0.5, -3.0]), -form.at(|k| x[k]));
    }

    #[test]
    fn what_is_no_sum_of_squares_stays_as_it_is() {
        for diagonal in [0.0, 1.0] {
            let entries = [(0, 0, diagonal), (0, 1, 2.0), (1, 0, 2.0), (1, 1, diagonal)];
            let form = Form::new(&Csc::from_triplets(2, 2, &entries));
            assert!(form.combined.is_empty());
            let x = [1.0, -3.0];
            assert!((form.at(|k| x[k]) - (10.0 * diagonal - 12.0)).abs() < 1e-14);
        }
    }

    #[test]
    fn squares_give_the_form_of_the_symmetric_part() {
        // two capacitors, one of them between nodes, coupled inductors, a gyrator
        let entries = [
            (0, 0, 3.0),
            (0, 1, -1.0),
            (1, 0, -1.0),
            (1, 1, 1.0),
            (2, 2, 2.0),
            (2, 3, 1.5),
            (3, 2, 1.5),
            (3, 3, 4.0),
            (0, 3, 7.0),
            (3, 0, -7.0),
        ];
        let matrix = Csc::from_triplets(4, 4, &entries);
        let form = Form::new(&matrix);
        assert_eq!((form.pairs.len(), form.single.len()), (2, 3));
        let x = [1.0, -2.0, 3.0, 0.5];
        let direct: f64 = entries.iter().map(|&(r, c, v)| x[r] * v * x[c]).sum();
        assert!((form.at(|k| x[k]) - direct).abs() < 1e-14 * direct.abs());
        let (y, w) = ([2.0, 1.0, 0.0, -1.0], [1.0, 0.5, 0.5, -3.0]);
        let symmetric = entries.iter().filter(|e| e.2.abs() < 7.0);
        let direct: f64 = symmetric.map(|&(r, c, v)| x[r] * v * y[c]).sum();
        assert!((form.between(&x, &y) - direct).abs() < 1e-14 * direct.abs());
        let points = [x, y];
        let mut expected = 0.0;
        for (i, a) in points.iter().enumerate() {
            for (j, b) in points.iter().enumerate() {
                let all = entries.iter().filter(|e| e.2.abs() < 7.0);
                expected += w[2 * i + j] * all.map(|&(r, c, v)| a[r] * v * b[c]).sum::<f64>();
            }
        }
        let found = form.products(&points.each_ref().map(|x| &x[..]), &w);
        assert!((found - expected).abs() < 1e-13 * expected.abs());
    }
}
