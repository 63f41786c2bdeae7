//! Coupled inductors: ideal transformers between windings and cores of one henry each.
//!
//! `L = N N'` by the Cholesky factor of the correlations, whose rank is the number of cores.  The voltages of the
//! windings are `v = N u`, with the voltages `u` of the cores, and the fluxes of these are `m = N' i`.  Neither `L`
//! nor its inverse has to be regular: perfectly coupled windings have fewer cores than windings.

use super::elements::Branch;
use crate::dense::{Lu, Matrix};
use crate::rounding::of_elimination;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// A group of them.
#[derive(Clone, Debug)]
pub struct Coupled {
    /// the windings, the first ones those that determine the fluxes of the cores
    pub windings: Vec<Branch>,
    /// `N`, windings by cores; its first rows are lower triangular
    turns: Vec<Vec<f64>>,
    /// the node of the first core
    pub first: usize,
}

impl Coupled {
    /// The groups of windings; nothing if a group stores negative energy.
    pub fn groups(e: &Csc, windings: Vec<Branch>) -> Option<Vec<Coupled>> {
        let mut sets = UnionFind::new(e.nrows);
        e.iter().filter(|e| e.2 != 0.0).for_each(|(r, c, _)| _ = sets.join(r, c));
        let rows = windings.iter().filter_map(|w| w.index);
        let groups = sets.groups(rows);
        let of = |row: &usize| windings.iter().find(|w| w.index == Some(*row)).copied();
        groups.iter().map(|rows| Coupled::new(e, rows.iter().filter_map(of).collect())).collect()
    }

    /// The groups of the windings that a matrix of inductances alone gives, wherever they end.
    pub fn of(inductances: &Csc) -> Option<Vec<Coupled>> {
        let own = inductances.iter().filter(|e| e.0 == e.1);
        let winding = |(row, _, value)| Branch { ends: [0; 2], value, index: Some(row) };
        Coupled::groups(inductances, own.map(winding).collect())
    }

    fn new(e: &Csc, mut windings: Vec<Branch>) -> Option<Coupled> {
        let n = windings.len();
        let root: Vec<f64> = windings.iter().map(|w| w.value.sqrt()).collect();
        let place = |row: usize| windings.iter().position(|w| w.index == Some(row));
        let mut left = Matrix::from_fn(n, n, |_, _| 0.0);
        for (k, winding) in windings.iter().enumerate() {
            let (rows, values) = e.col(winding.index?);
            for (&row, &value) in rows.iter().zip(values) {
                let other = place(row)?;
                left[(other, k)] = value / (root[other] * root[k]);
            }
        }
        if !root.iter().all(|root| *root > 0.0) {
            return None;
        }
        // Cholesky with complete pivoting
        let rounding = of_elimination(n);
        let (mut order, mut turns): (Vec<usize>, Vec<Vec<f64>>) =
            ((0..n).collect(), vec![vec![]; n]);
        for step in 0..n {
            let rest = |k: usize| left[(order[k], order[k])];
            let most = (step..n).map(rest).fold(f64::NEG_INFINITY, f64::max);
            // of those alike the largest winding, to whose flux the others are small
            let alike = (step..n).filter(|&k| rest(k) >= most - rounding);
            let value = |k: usize| windings[order[k]].value;
            let pivot = alike.max_by(|&a, &b| value(a).total_cmp(&value(b)))?;
            order.swap(step, pivot);
            let own = left[(order[step], order[step])];
            // the entries are known to some roundings
            if own <= rounding {
                let least = (step..n).map(|k| left[(order[k], order[k])]).fold(0.0, f64::min);
                if least < -rounding {
                    return None;
                }
                break;
            }
            let column: Vec<f64> = (0..n).map(|k| left[(k, order[step])] / own.sqrt()).collect();
            for (k, &a) in order.iter().enumerate() {
                turns[a].push(if k < step { 0.0 } else { root[a] * column[a] });
                for &b in &order[step..] {
                    left[(a, b)] -= if k < step { 0.0 } else { column[a] * column[b] };
                }
            }
        }
        windings = order.iter().map(|&k| windings[k]).collect();
        turns = order.iter().map(|&k| std::mem::take(&mut turns[k])).collect();
        Some(Coupled { windings, turns, first: 0 })
    }

    /// How many cores there are.
    pub fn cores(&self) -> usize {
        self.turns[0].len()
    }

    /// Whether the fluxes determine the currents.
    pub fn leaks(&self) -> bool {
        self.cores() == self.windings.len()
    }

    /// How often a winding goes round a core.
    pub fn turns(&self, winding: usize, core: usize) -> f64 {
        self.turns[winding][core]
    }

    /// The multiples of the laws of the windings that determine the fluxes which leave none in the law of another one.
    pub fn without_flux(&self, winding: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.cores()];
        for core in (0..self.cores()).rev() {
            let later = core + 1..self.cores();
            let sum: f64 = later.map(|k| out[k] * self.turns[k][core]).sum();
            out[core] = -(self.turns[winding][core] + sum) / self.turns[core][core];
        }
        out
    }

    /// `N' i`
    pub fn fluxes(&self, currents: impl Fn(usize) -> f64) -> Vec<f64> {
        let sum = |core| (0..self.windings.len()).map(|k| self.turns[k][core] * currents(k)).sum();
        (0..self.cores()).map(sum).collect()
    }

    /// `m` where `N m` is known.
    pub fn fluxes_of(&self, linked: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut out: Vec<f64> = Vec::new();
        for k in 0..self.cores() {
            let known: f64 = out.iter().zip(&self.turns[k]).map(|(m, t)| m * t).sum();
            out.push((linked(k) - known) / self.turns[k][k]);
        }
        out
    }

    /// The smallest `i` with `N' i = m`, in the norm of the energy of each winding by itself.
    pub fn currents(&self, fluxes: &[f64]) -> Vec<f64> {
        let (r, n) = (self.cores(), self.windings.len());
        let even = |k: usize, core: usize| self.turns[k][core] / self.windings[k].value.sqrt();
        let gram = Matrix::from_fn(r, r, |a, b| (0..n).map(|k| even(k, a) * even(k, b)).sum());
        let right = Matrix::from_fn(r, 1, |core, _| fluxes[core]);
        let x = Lu::new(&gram).solve(&right);
        let current = |k: usize| {
            let sum: f64 = (0..r).map(|core| even(k, core) * x[(core, 0)]).sum();
            sum / self.windings[k].value.sqrt()
        };
        (0..n).map(current).collect()
    }
}
