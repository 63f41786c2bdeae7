//! Laws of currents that connect inductors alone, right after a jump: so are their rates.
//!
//! With `L di/dt = e`, `e` the voltages that the other terms of the laws of the inductors leave, a law `k' i = 0` asks
//! for `k' L^-1 e = 0`.  It determines potentials that no current depends on otherwise, and that a step shows as the
//! rounding of fluxes over its length.

use super::judge::Point;
use super::matrix::Entries;
use super::{ratio, worse, TOLERANCE};
use crate::dense::{Lu, Matrix};
use crate::descriptor::{stored_columns, sums_that_store_nothing, Linear};
use crate::rounding::{of_elimination, of_entries};
use crate::sparse::Csc;
use crate::tolerances::{CLEARLY, FLOOR};
use std::collections::BTreeMap;

/// Inductors that are looked at together.
const MOST: usize = 64;

/// A law of currents, one of its rows, and the inductors in it by their places.
struct CutSet {
    row: usize,
    inductors: Vec<(usize, f64)>,
}

/// All such laws of a network.
pub(super) struct CutSets {
    /// unknowns of the inductors
    inductors: Vec<usize>,
    inverse: Matrix,
    cut_sets: Vec<CutSet>,
}

impl CutSets {
    /// Those of a linear network without sources and pairs in them; None if there are none, or if what inductors store
    /// does not determine their currents.
    pub fn new(linear: &Linear) -> Option<CutSets> {
        let stores = stored_columns(&linear.e);
        let inductors: Vec<usize> =
            (0..stores.len()).filter(|&c| linear.row_kind[c] == 1 && stores[c]).collect();
        if inductors.len() < 2 || inductors.len() > MOST {
            return None;
        }
        let place = |c: usize| inductors.binary_search(&c).ok();
        let mut inductances = Matrix::zeros(inductors.len(), inductors.len());
        for (row, c, v) in linear.e.iter() {
            if let (Some(row), Some(c)) = (place(row), place(c)) {
                inductances[(row, c)] += v;
            }
        }
        let (n, m, _) = linear.sizes();
        let groups = sums_that_store_nothing(&linear.e, &Csc::zeros(n, 0));
        let mut of = vec![None; n];
        for (k, group) in groups.iter().enumerate().filter(|e| linear.row_kind[e.1[0]] == 0) {
            group.iter().for_each(|&row| of[row] = Some(k));
        }
        // by group and column, unknowns first: the sum of the group's laws, and the sizes of its terms
        let mut sums: BTreeMap<(usize, usize), [f64; 2]> = BTreeMap::new();
        for (first, matrix) in [(0, &linear.g), (n, &linear.a), (n + m, &linear.s)] {
            for (group, c, v) in matrix.iter().filter_map(|(r, c, v)| Some((of[r]?, c, v))) {
                let [sum, size] = sums.entry((group, first + c)).or_default();
                (*sum, *size) = (*sum + v, *size + v.abs());
            }
        }
        sums.retain(|_, [sum, size]| sum.abs() > of_entries(n) * *size);
        let own = |k: usize| {
            let terms = sums.range((k, 0)..(k + 1, 0));
            terms.map(|(at, sum)| Some((place(at.1)?, sum[0]))).collect::<Option<Vec<_>>>()
        };
        let several = (0..groups.len()).filter_map(|k| {
            let inductors = own(k).filter(|own| own.len() > 1)?;
            Some(CutSet { row: groups[k][0], inductors })
        });
        let cut_sets: Vec<CutSet> = several.collect();
        let factor = Lu::new(&inductances);
        if cut_sets.is_empty() || factor.ratio <= of_elimination(inductors.len()) {
            return None;
        }
        Some(CutSets {
            inverse: factor.solve(&Matrix::identity(inductors.len())),
            inductors,
            cut_sets,
        })
    }

    /// The worst of the laws at a point, in units in which [`TOLERANCE`] is allowed, and its row; the rounding of the
    /// voltages of each inductor is allowed for, also where all of them have come to rest.
    pub fn worst(
        &self,
        [g, a, s]: [&Entries; 3],
        at: &Point,
        rounding: impl Fn(usize) -> f64,
    ) -> Option<(f64, usize)> {
        let (mut rest, mut sizes) = (vec![0.0; at.z.len()], vec![0.0; at.z.len()]);
        s.add_both(1.0, at.u, &mut rest, &mut sizes);
        g.add_both(-1.0, at.z, &mut rest, &mut sizes);
        a.add_both(-1.0, at.l, &mut rest, &mut sizes);
        // what is known of a law relative to the largest of its kind
        let largest = self.inductors.iter().fold(0.0, |most, &row| f64::max(most, sizes[row]));
        let rate = |k: usize| {
            let terms = self.inverse.row(k).iter().zip(&self.inductors);
            terms.fold((0.0, 0.0), |(sum, size), (m, &row)| {
                let least = (FLOOR * largest).max(rounding(row) / CLEARLY);
                (sum + m * rest[row], size + m.abs() * sizes[row].max(least))
            })
        };
        let rates: Vec<(f64, f64)> = (0..self.inductors.len()).map(rate).collect();
        let mut found: Option<(f64, usize)> = None;
        for cut_set in &self.cut_sets {
            let (mut error, mut size) = (0.0, 0.0);
            for &(place, k) in &cut_set.inductors {
                error += k * rates[place].0;
                size += k.abs() * rates[place].1;
            }
            let error = ratio(f64::abs(error), size) * TOLERANCE / CLEARLY; // potentials are limits of short steps there
            if found.is_none_or(|(worst, _)| worse(error, worst)) {
                found = Some((error, cut_set.row));
            }
        }
        found
    }
}
