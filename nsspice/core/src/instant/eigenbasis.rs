//! Coordinates in which perfectly coupled inductors store something or nothing.
//!
//! The inductances of coupled windings, scaled to a unit diagonal, are a positive semidefinite matrix.  Along its
//! eigenvectors without an eigenvalue no flux depends on the currents: there `E` is zero, exactly, and the law is one
//! of voltages alone.  With `z = T y` the laws are `T' E T y' + T' G T y + T' A l = T' S u`, as symmetric as before.

use crate::dense::{eigen_symmetric, Matrix};
use crate::descriptor::{stored_groups, Linear};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;

/// Windings that are looked at together.
const MOST: usize = 64;

/// A network in such coordinates.
pub struct Eigenbasis {
    /// T
    pub to: Csc,
    /// its inverse
    pub from: Csc,
    /// the equations
    pub laws: Linear,
    /// unknowns that are not the same in both
    pub moved: Vec<bool>,
}

/// `left' matrix right`; none of both is the identity.
fn product(left: Option<&Csc>, matrix: &Csc, right: Option<&Csc>) -> Csc {
    let rows = left.map(Csc::transpose);
    let (mut entries, mut size) = (Vec::new(), [matrix.nrows, matrix.ncols]);
    let columns = right.map(Csc::transpose);
    for (r, c, v) in matrix.iter().filter(|e| e.2 != 0.0) {
        let list = |of: &Option<Csc>, at: usize| match of {
            Some(of) => of.nonzeros(at),
            None => vec![(at, 1.0)],
        };
        for (row, a) in list(&rows, r) {
            for (column, b) in list(&columns, c) {
                entries.push((row, column, a * v * b));
            }
        }
    }
    rows.iter().for_each(|rows| size[0] = rows.nrows);
    columns.iter().for_each(|columns| size[1] = columns.nrows);
    Csc::from_triplets(size[0], size[1], &entries)
}

impl Eigenbasis {
    /// Nothing where no inductors are perfectly coupled.
    pub fn new(linear: &Linear) -> Option<Eigenbasis> {
        let n = linear.e.nrows;
        let (mut moved, mut lost) = (vec![false; n], vec![false; n]);
        let (mut to, mut from, mut stores) = (Vec::new(), Vec::new(), Vec::new());
        let [_, groups] = stored_groups(&linear.e);
        let coupled = |group: &&Vec<usize>| {
            (2..=MOST).contains(&group.len()) && group.iter().all(|&j| linear.row_kind[j] != 0)
        };
        for group in groups.iter().filter(coupled) {
            let k = group.len();
            let own = Matrix::from_fn(k, k, |r, c| {
                let entries = linear.e.nonzeros(group[c]);
                entries.iter().find(|e| e.0 == group[r]).map_or(0.0, |e| e.1)
            });
            let scale: Vec<f64> = (0..k).map(|j| own[(j, j)].sqrt()).collect();
            let even = Matrix::from_fn(k, k, |r, c| own[(r, c)] / (scale[r] * scale[c]));
            let (values, vectors) = eigen_symmetric(&even)?;
            if values.iter().all(|value| *value > OF_SOLUTION) {
                continue;
            }
            for c in 0..k {
                (moved[group[c]], lost[group[c]]) = (true, values[c] <= OF_SOLUTION);
                if !lost[group[c]] {
                    stores.push((group[c], group[c], values[c]));
                }
                for r in 0..k {
                    to.push((group[r], group[c], vectors[(r, c)] / scale[r]));
                    from.push((group[c], group[r], vectors[(r, c)] * scale[r]));
                }
            }
        }
        if !lost.contains(&true) {
            return None;
        }
        for j in (0..n).filter(|&j| !moved[j]) {
            to.push((j, j, 1.0));
            from.push((j, j, 1.0));
        }
        stores.extend(linear.e.iter().filter(|e| !moved[e.1]));
        let [to, from] = [to, from].map(|list| Csc::from_triplets(n, n, &list));
        let t = Some(&to);
        let laws = Linear {
            e: Csc::from_triplets(n, n, &stores),
            g: product(t, &linear.g, t),
            a: product(t, &linear.a, None),
            b: product(None, &linear.b, t),
            s: product(t, &linear.s, None),
            d: linear.d.clone(),
            q: linear.q.clone(),
            row_kind: linear.row_kind.clone(),
        };
        Some(Eigenbasis { to, from, laws, moved })
    }

    /// Unknowns by their coordinates, in place.
    pub fn back(&self, list: &mut [f64]) {
        let y = list.to_vec();
        list.fill(0.0);
        self.to.mul_add(1.0, &y, list);
    }

    /// Coordinates of unknowns.
    pub fn coordinates(&self, z: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; z.len()];
        self.from.mul_add(1.0, z, &mut y);
        y
    }
}
