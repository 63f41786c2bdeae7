//! Laws of currents that connect inductors alone, right after a jump: so are their rates.
//!
//! With `L di/dt = e`, `e` the voltages that the other terms of the laws of the inductors leave, a law `k' i = 0` asks
//! for `k' L^-1 e = 0`.  It tells potentials that no current depends on otherwise, and that a step shows as the
//! rounding of fluxes over its length.

use super::matrix::Entries;
use super::points::Point;
use super::{ratio, worse, TOLERANCE};
use crate::dense::{Lu, Matrix};
use crate::descriptor::{cut_sets_of_inductors, stored_columns, sums_that_store_nothing, Linear};
use crate::sparse::Csc;

/// Part of its terms to which a rate has to be known, and part of the largest that counts: potentials are limits of
/// short steps there.
const KNOWN: f64 = 0.1;
const LEAST: f64 = 1e-3;
/// A pivot of the inductances below this part of the first is none.
const SINGULAR: f64 = 1e-9;
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
    /// does not tell their currents.
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
        let groups = sums_that_store_nothing(&linear.e, &Csc::zeros(stores.len(), 0));
        let tied = cut_sets_of_inductors(linear, &groups, &[&linear.a, &linear.s]);
        let several = groups.iter().zip(tied).filter(|(_, own)| own.len() > 1);
        let cut_sets: Vec<CutSet> = several
            .map(|(rows, own)| {
                let inductors = own.into_iter().filter_map(|(c, k)| Some((place(c)?, k))).collect();
                CutSet { row: rows[0], inductors }
            })
            .collect();
        let factor = Lu::new(&inductances);
        if cut_sets.is_empty() || factor.ratio <= SINGULAR {
            return None;
        }
        Some(CutSets {
            inverse: factor.solve(&Matrix::identity(inductors.len())),
            inductors,
            cut_sets,
        })
    }

    /// The worst of the laws at a point, in units in which [`TOLERANCE`] is allowed, and its row.
    pub fn worst(&self, [g, a, s]: [&Entries; 3], at: &Point) -> Option<(f64, usize)> {
        let (mut rest, mut sizes) = (vec![0.0; at.z.len()], vec![0.0; at.z.len()]);
        s.add_both(1.0, at.u, &mut rest, &mut sizes);
        g.add_both(-1.0, at.z, &mut rest, &mut sizes);
        a.add_both(-1.0, at.l, &mut rest, &mut sizes);
        // what is known of a law beside the largest of its kind
        let least = self.inductors.iter().fold(0.0, |most, &row| f64::max(most, sizes[row]));
        let least = LEAST * least;
        let rate = |k: usize| {
            let terms = self.inverse.row(k).iter().zip(&self.inductors);
            terms.fold((0.0, 0.0), |(sum, size), (m, &row)| {
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
            let error = ratio(f64::abs(error), size) * TOLERANCE / KNOWN;
            if found.is_none_or(|(worst, _)| worse(error, worst)) {
                found = Some((error, cut_set.row));
            }
        }
        found
    }
}
