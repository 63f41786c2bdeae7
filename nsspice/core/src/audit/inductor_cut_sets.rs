//! Laws of currents that tie coils alone, right after a jump: their rates are tied, too.
//!
//! With `L di/dt = e`, `e` the voltages that the other terms of the laws of the coils leave, a law `k' i = 0` asks
//! for `k' L^-1 e = 0`.  It tells potentials that no current depends on otherwise, and that a step shows as the
//! rounding of fluxes over its length.

use super::matrix::Entries;
use super::points::Point;
use super::{ratio, worse, TOLERANCE};
use crate::dense::{Lu, Matrix};
use crate::descriptor::{stored_columns, sums_that_store_nothing, ties_of_coils, Linear};
use crate::sparse::Csc;

/// Part of its terms to which a rate has to be known, and part of the largest that counts: potentials are limits of
/// short steps there.
const KNOWN: f64 = 0.1;
const LEAST: f64 = 1e-3;
/// A pivot of the inductances below this part of the first is none.
const SINGULAR: f64 = 1e-9;
/// Coils that are looked at together.
const MOST: usize = 64;

/// A law of currents, one of its rows, and the coils in it by their places.
struct Tie {
    row: usize,
    coils: Vec<(usize, f64)>,
}

/// All such laws of a network.
pub(super) struct Ties {
    /// unknowns of the coils
    coils: Vec<usize>,
    inverse: Matrix,
    ties: Vec<Tie>,
}

impl Ties {
    /// Those of a linear network without sources and pairs in them; None if there are none, or if what coils store
    /// does not tell their currents.
    pub fn new(linear: &Linear) -> Option<Ties> {
        let stores = stored_columns(&linear.e);
        let coils: Vec<usize> =
            (0..stores.len()).filter(|&c| linear.row_kind[c] == 1 && stores[c]).collect();
        if coils.len() < 2 || coils.len() > MOST {
            return None;
        }
        let place = |c: usize| coils.binary_search(&c).ok();
        let mut inductances = Matrix::zeros(coils.len(), coils.len());
        for (row, c, v) in linear.e.iter() {
            if let (Some(row), Some(c)) = (place(row), place(c)) {
                inductances[(row, c)] += v;
            }
        }
        let groups = sums_that_store_nothing(&linear.e, &Csc::zeros(stores.len(), 0));
        let tied = ties_of_coils(linear, &groups, &[&linear.a, &linear.s]);
        let several = groups.iter().zip(tied).filter(|(_, own)| own.len() > 1);
        let ties: Vec<Tie> = several
            .map(|(rows, own)| {
                let coils = own.into_iter().filter_map(|(c, k)| Some((place(c)?, k))).collect();
                Tie { row: rows[0], coils }
            })
            .collect();
        let factor = Lu::new(&inductances);
        if ties.is_empty() || factor.ratio <= SINGULAR {
            return None;
        }
        Some(Ties { inverse: factor.solve(&Matrix::identity(coils.len())), coils, ties })
    }

    /// The worst of the laws at a point, in units in which [`TOLERANCE`] is allowed, and its row.
    pub fn worst(&self, [g, a, s]: [&Entries; 3], at: &Point) -> Option<(f64, usize)> {
        let (mut rest, mut sizes) = (vec![0.0; at.z.len()], vec![0.0; at.z.len()]);
        s.add_both(1.0, at.u, &mut rest, &mut sizes);
        g.add_both(-1.0, at.z, &mut rest, &mut sizes);
        a.add_both(-1.0, at.l, &mut rest, &mut sizes);
        // what is known of a law beside the largest of its kind
        let least = self.coils.iter().fold(0.0, |most, &row| f64::max(most, sizes[row]));
        let least = LEAST * least;
        let rate = |k: usize| {
            let terms = self.inverse.row(k).iter().zip(&self.coils);
            terms.fold((0.0, 0.0), |(sum, size), (m, &row)| {
                (sum + m * rest[row], size + m.abs() * sizes[row].max(least))
            })
        };
        let rates: Vec<(f64, f64)> = (0..self.coils.len()).map(rate).collect();
        let mut found: Option<(f64, usize)> = None;
        for tie in &self.ties {
            let (mut error, mut size) = (0.0, 0.0);
            for &(place, k) in &tie.coils {
                error += k * rates[place].0;
                size += k.abs() * rates[place].1;
            }
            let error = ratio(f64::abs(error), size) * TOLERANCE / KNOWN;
            if found.is_none_or(|(worst, _)| worse(error, worst)) {
                found = Some((error, tie.row));
            }
        }
        found
    }
}
