//! A quadratic form, element by element: energies and powers without the cancellation of assembled entries.

use crate::sparse::Csc;
use crate::structure::{Coordinates, Coupled, Edge};
use std::collections::{BTreeMap, BTreeSet};

/// Most points of a step.
const MOST: usize = 8;

/// `l`, by unknowns, and `c` of `c (l' x)^2`.
type Square = (Vec<(usize, f64)>, f64);

/// The symmetric part `M` of a matrix as a sum of squares: `c v^2` for each element between two nodes, whose voltage
/// `v` is one unknown, the sum or difference of two, or a sum along a path of the tree; one for each branch with a row
/// of its own; and `(N' i)^2` for the cores of coupled inductors: without leakage the rates of their currents may be
/// beyond all that is stored, and only the ampere turns of all are not.
///
/// What only one of two rows has of the other's unknown is a controlled source.  Its power is a product, of a
/// current and a voltage at another place: as squares it would have the rounding of the larger one's.
#[derive(Clone, Debug, Default)]
pub struct Form {
    /// of each square: the end of its terms and `c`
    squares: Vec<(usize, f64)>,
    /// terms of all `l`
    terms: Vec<(u32, f64)>,
    /// `i`, `j`, `r` of `r x_i x_j`
    products: Vec<(u32, u32, f64)>,
}

impl Form {
    /// Takes a matrix and the elements between nodes that it is the sum of, with others.
    pub fn new(matrix: &Csc, edges: &[Edge], coordinates: &Coordinates) -> Form {
        // a static form of the system has left its capacitors out
        let edges = if matrix.values.is_empty() { &[][..] } else { edges };
        let mut out = Form::default();
        for (path, edge) in coordinates.rows(edges).iter().zip(edges) {
            out.add(path, edge.2);
        }
        // by the place in the upper triangle: entries of the upper and of the lower one
        let mut rest: BTreeMap<(usize, usize), [f64; 2]> = BTreeMap::new();
        for (r, c, v) in coordinates.remainder(matrix, edges).iter() {
            rest.entry((r.min(c), r.max(c))).or_default()[usize::from(r > c)] += v;
        }
        let mut own: BTreeMap<usize, f64> = BTreeMap::new();
        let mut mutual = Vec::new();
        for ((i, j), [a, b]) in rest {
            if i == j {
                own.insert(i, a);
                continue;
            }
            let shared = if a * b > 0.0 { a.signum() * a.abs().min(b.abs()) } else { 0.0 };
            mutual.extend((shared != 0.0).then_some((i, j, shared)));
            let alone = (a - shared) + (b - shared);
            out.products.extend((alone != 0.0).then_some((i as u32, j as u32, alone)));
        }
        match cores(matrix.nrows, &own, &mutual) {
            Some(squares) => {
                mutual.iter().flat_map(|e| [e.0, e.1]).for_each(|row| _ = own.remove(&row));
                squares.iter().for_each(|(l, c)| out.add(l, *c));
            }
            None => {
                let products = mutual.iter().map(|&(i, j, v)| (i as u32, j as u32, 2.0 * v));
                out.products.extend(products);
            }
        }
        own.into_iter().for_each(|(k, v)| out.add(&[(k, 1.0)], v));
        out
    }

    /// Adds `c (l' x)^2`.
    fn add(&mut self, l: &[(usize, f64)], c: f64) {
        if !l.is_empty() {
            self.terms.extend(l.iter().map(|&(k, factor)| (k as u32, factor)));
            self.squares.push((self.terms.len(), c));
        }
    }

    /// The sum of the squares, each of which is found from its `l`.
    #[inline]
    fn sum(&self, square: impl Fn(&[(u32, f64)]) -> f64) -> f64 {
        let (mut sum, mut begin) = (0.0, 0);
        for &(end, c) in &self.squares {
            sum += c * square(&self.terms[begin..end]);
            begin = end;
        }
        sum
    }

    /// `x' M x`
    #[inline]
    pub fn at(&self, x: impl Fn(usize) -> f64) -> f64 {
        let mut sum = self.sum(|l| {
            let v = combination(l, &x);
            v * v
        });
        for &(i, j, r) in &self.products {
            sum += r * x(i as usize) * x(j as usize);
        }
        sum
    }

    /// `sum w_ij k_i' M k_j` over the points `k` of a step.
    pub fn products(&self, points: &[&[f64]], w: &[f64]) -> f64 {
        let mut sum = self.sum(|l| products(points, w, |k| combination(l, |j| k[j])));
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

/// The squares of coupled inductors, of which the inductances are known and half of what couples two of them; `None`
/// if they store negative energy.
fn cores(
    size: usize,
    own: &BTreeMap<usize, f64>,
    mutual: &[(usize, usize, f64)],
) -> Option<Vec<Square>> {
    let rows: BTreeSet<usize> = mutual.iter().flat_map(|e| [e.0, e.1]).collect();
    let diagonal = rows.iter().map(|row| Some((*row, *row, *own.get(row)?)));
    let mut entries: Vec<_> = diagonal.collect::<Option<_>>()?;
    entries.extend(mutual.iter().flat_map(|&(i, j, v)| [(i, j, v), (j, i, v)]));
    let groups = Coupled::of(&Csc::from_triplets(size, size, &entries))?;
    let square = |group: &Coupled, core: usize| {
        let rows = group.windings.iter().enumerate();
        let turns = rows.filter_map(|(k, w)| Some((w.index?, group.turns(k, core))));
        (turns.filter(|e| e.1 != 0.0).collect(), 1.0)
    };
    let squares = groups.iter().flat_map(|g| (0..g.cores()).map(move |core| square(g, core)));
    Some(squares.collect())
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

    /// The form of a matrix in node voltages.
    fn form(n: usize, entries: &[(usize, usize, f64)], edges: &[Edge]) -> Form {
        Form::new(&Csc::from_triplets(n, n, entries), edges, &Coordinates::of_nodes(n))
    }

    #[test]
    fn windings_without_leakage_are_one_square() {
        // 1, 4 and 9 H, with a leakage of 0.1 H in the second case
        for leakage in [0.0, 0.1] {
            let turns = [1.0, 2.0, -3.0];
            let mut entries: Vec<_> =
                (0..9).map(|k| (k / 3, k % 3, turns[k / 3] * turns[k % 3])).collect();
            entries.push((1, 1, leakage));
            let form = form(3, &entries, &[]);
            assert_eq!(form.squares.len(), if leakage > 0.0 { 2 } else { 1 });
            // of currents whose ampere turns cancel nothing is stored
            let x = [3e16, 3e16, 3e16];
            let stored = 0.5 * form.at(|k| x[k]);
            assert!((stored - 0.5 * leakage * 9e32).abs() < 1e-14 * 9e32 * leakage.max(1e-16));
            let y = [1.0, 0.0, 0.0];
            assert!((form.at(|k| y[k]) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn the_power_of_a_controlled_source_is_a_product() {
        // 2 S between two nodes, and a source in the law of a branch that a voltage of 1 kV controls
        let entries = [(0, 0, 2.0), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0), (2, 1, -1e6)];
        let form = form(3, &entries, &[(0, 1, 2.0)]);
        assert_eq!(
            (&form.squares[..], &form.terms[..]),
            (&[(2, 2.0)][..], &[(0, 1.0), (1, -1.0)][..])
        );
        assert_eq!(form.products, [(1, 2, -1e6)]);
        // as squares: 1e12 W, of which a pico would be lost to cancellation
        let x = [1e3, 1e3, 1e-12];
        assert_eq!(form.at(|k| x[k]), -1e6 * 1e3 * 1e-12);
        assert_eq!(form.products(&[&x, &x], &[1.0, 0.5, 0.5, -3.0]), -form.at(|k| x[k]));
    }

    #[test]
    fn what_is_no_sum_of_squares_stays_as_it_is() {
        for diagonal in [0.0, 1.0] {
            let entries = [(0, 0, diagonal), (0, 1, 2.0), (1, 0, 2.0), (1, 1, diagonal)];
            let form = form(2, &entries, &[]);
            assert_eq!(form.squares.len(), if diagonal > 0.0 { 2 } else { 0 });
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
        let form = form(4, &entries, &[(0, 1, 1.0), (0, -1, 2.0)]);
        assert_eq!(form.squares.len(), 4);
        assert!(form.products.is_empty());
        let x = [1.0, -2.0, 3.0, 0.5];
        let direct: f64 = entries.iter().map(|&(r, c, v)| x[r] * v * x[c]).sum();
        assert!((form.at(|k| x[k]) - direct).abs() < 1e-14 * direct.abs());
        let (y, w) = ([2.0, 1.0, 0.0, -1.0], [1.0, 0.5, 0.5, -3.0]);
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
