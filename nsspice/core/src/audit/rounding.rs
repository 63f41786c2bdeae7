//! How far rounding can take a law: the backward error of solving it.
//!
//! Elimination with pivoting solves `(K + dK) x = b` with `|dK| <= 3 N u |L| |U|`, `N` equations and
//! the unit roundoff `u`; the growth of `|L| |U|` over `|K|` is below 8 as a rule (N. J. Higham,
//! Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, theorem 9.4 and section 9.4).
//! A law then holds to
//!
//! ```text
//! 24 N u  sum_j |K_ij| X_j ,
//! ```
//!
//! `X_j` the largest value of its kind (voltages of nodes; currents of branches and pairs), not that
//! of unknown `j` itself: where one value is small because others cancel, it has the rounding of the
//! others.  `K` contains `E / h`, so that what is stored counts with all of it, however little of it
//! moves.  Measured on the random networks of the tests, laws err by a tenth of the sum with the largest
//! of its kind (below) at most.
//!
//! The current of a conducting pair with a resistance is what that makes of the voltages and the threshold: among its
//! terms are all of them, divided by the resistance, however small the current itself is, in the equations of both
//! ends (`Reach::through_pairs`).
//!
//! A current (voltage) that another law determines brings the rounding of that law along: currents
//! that meet in a node without storage, of a capacitor elsewhere, are known to the rounding of its
//! `C v / h`, and that of a capacitor between two nodes to the rounding of both.  The largest sum of each kind is therefore the least for all laws that add up currents
//! (voltages) themselves.
//!
//! Voltages of zero, across diodes that carry currents, have the rounding of `R i` although no law says
//! so: a voltage that changes the currents of its nodes by no more than their rounding is none
//! (`Auditor::hidden`), nor is it one in the laws of others.

use super::laws::{Auditor, Seen};
use super::matrix::Entries;
use super::TOLERANCE;
use crate::dense::largest_of_kinds;
use crate::rounding::of_elimination;
use crate::structure::Parts;

/// The rounding of elimination with so many equations, in units of the tolerance.
pub(super) fn share(size: usize) -> f64 {
    of_elimination(size) / TOLERANCE
}

/// Sums of the sizes of entries: what the largest voltage and the largest current make of a law.
#[derive(Clone, Debug)]
pub struct Reach {
    /// of each row: of `E`, and of `G` and `A`
    stored: Vec<[f64; 2]>,
    acting: Vec<[f64; 2]>,
    /// of each row: the unknowns of others with which it shares what it stores
    shares: Vec<Vec<usize>>,
    /// of each pair: its multiplier is a voltage (0) or a current (1)
    pairs: Vec<u8>,
    /// pairs with a resistance
    resistive: Vec<Resistive>,
}

/// What the multiplier of a conducting pair consists of, `(B z - q) / D`.
#[derive(Clone, Debug)]
struct Resistive {
    pair: usize,
    /// the sizes of the threshold and of the factors of unknowns, each over `D`
    threshold: f64,
    factors: Vec<(usize, f64)>,
    /// the equations that it enters, and the size of its factor there
    enters: Vec<(usize, f64)>,
}

/// What sums of sizes make of the largest voltage and current.
fn meet(sums: &[f64; 2], largest: &[f64; 2]) -> f64 {
    sums[0] * largest[0] + sums[1] * largest[1]
}

impl Reach {
    pub fn new(
        kinds: &[u8],
        pairs: usize,
        e: &Entries,
        g: &Entries,
        a: &Entries,
        averaging: Option<&Entries>,
    ) -> Reach {
        let n = kinds.len();
        let (mut stored, mut acting) = (vec![[0.0; 2]; n], vec![[0.0; 2]; n]);
        let add = |matrix: &Entries, sums: &mut Vec<[f64; 2]>| {
            for (row, column, value) in matrix.entries() {
                sums[row][usize::from(kinds[column])] += value.abs();
            }
        };
        add(e, &mut stored);
        let mut shares = vec![Vec::new(); n];
        let others = e.entries().filter(|(r, c, v)| r != c && *v != 0.0);
        others.for_each(|(row, other, _)| shares[row].push(other));
        add(g, &mut acting);
        averaging.iter().for_each(|h| add(h, &mut acting));
        let mut carried = vec![0; pairs];
        for (_, pair, _) in a.entries().filter(|e| kinds[e.0] == 0) {
            carried[pair] = 1;
        }
        for (row, pair, value) in a.entries() {
            acting[row][usize::from(carried[pair])] += value.abs();
        }
        Reach { stored, acting, shares, pairs: carried, resistive: Vec::new() }
    }

    /// Takes the characteristics of the pairs, `w = q - B z + D lambda`, and where their multipliers enter.
    pub fn know_pairs(&mut self, [a, b, d]: [&Entries; 3], q: &[f64]) {
        let resistive = d.entries().filter(|&(row, column, value)| row == column && value > 0.0);
        let terms = |(pair, _, resistance): (usize, usize, f64)| {
            let factors = b.entries().filter(|e| e.0 == pair);
            let factors = factors.map(|(_, column, v)| (column, v.abs() / resistance)).collect();
            let enters = a.entries().filter(|e| e.1 == pair).map(|(row, _, v)| (row, v.abs()));
            let threshold = q[pair].abs() / resistance;
            Resistive { pair, threshold, factors, enters: enters.collect() }
        };
        self.resistive = resistive.map(terms).collect();
    }

    /// Adds to each equation the sizes of the terms of the pairs in it that conduct, for unknowns of these sizes and
    /// thresholds times a weight.
    pub fn through_pairs(
        &self,
        conducts: impl Fn(usize) -> bool,
        weight: f64,
        unknown: impl Fn(usize) -> f64,
        sizes: &mut [f64],
    ) {
        for pair in self.resistive.iter().filter(|pair| conducts(pair.pair)) {
            let terms = pair.factors.iter().map(|&(j, factor)| factor * unknown(j));
            let size = weight * pair.threshold + terms.sum::<f64>();
            pair.enters.iter().for_each(|&(row, factor)| sizes[row] += factor * size);
        }
    }

    /// Whether the multiplier of a pair is a voltage (0) or a current (1).
    pub fn kind(&self, pair: usize) -> u8 {
        self.pairs[pair]
    }

    /// Charge or flux in a row that the largest voltage and current would store.
    pub fn content(&self, row: usize, largest: &[f64; 2]) -> f64 {
        meet(&self.stored[row], largest)
    }

    /// What each volt (kind 0) of all its nodes, or each ampere of its branches, makes in a row; `rate` is that of what
    /// is stored.
    pub fn slope(&self, row: usize, kind: u8, rate: f64) -> f64 {
        let own = usize::from(kind);
        self.acting[row][own] + rate * self.stored[row][own]
    }

    /// Charge or flux that an energy would be in the element of a row alone.
    pub fn holding(&self, row: usize, kind: u8, energy: f64) -> f64 {
        (2.0 * energy * self.stored[row][usize::from(kind)]).sqrt()
    }

    /// Energy of a charge or flux in the element of a row alone.
    pub fn energy(&self, row: usize, kind: u8, charge: f64) -> f64 {
        let stored = self.stored[row][usize::from(kind)];
        if stored > 0.0 {
            0.5 * charge * charge / stored
        } else {
            0.0
        }
    }

    /// Currents or voltages that the largest voltage and current would bring to a law.
    pub fn acting(&self, row: usize, largest: &[f64; 2]) -> f64 {
        meet(&self.acting[row], largest)
    }

    /// Takes unknowns and multipliers into the largest current of each part.
    pub fn see_parts(&self, kinds: &[u8], parts: &Parts, [z, l]: [&[f64]; 2], most: &mut [f64]) {
        let unknowns = z.iter().enumerate().filter(|e| kinds[e.0] == 1);
        let unknowns = unknowns.filter_map(|(j, v)| Some((parts.of(j)?, v)));
        let pairs = l.iter().enumerate().filter(|e| self.pairs[e.0] == 1);
        let pairs = pairs.map(|(pair, v)| (parts.of_pair(pair), v));
        unknowns.chain(pairs).for_each(|(part, v)| most[part] = most[part].max(v.abs()));
    }

    /// Takes unknowns and multipliers into the largest voltage and current.
    pub fn see(&self, kinds: &[u8], z: &[f64], l: &[f64], largest: &mut [f64; 2]) {
        for (list, kinds) in [(z, kinds), (l, &self.pairs)] {
            let most = largest_of_kinds(list, kinds);
            largest.iter_mut().zip(most).for_each(|(largest, most)| *largest = largest.max(most));
        }
    }
}

/// What rounding is measured by at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoundingUnit {
    /// largest voltage and current
    pub largest: [f64; 2],
    /// `1 / h` of the step, or of the shortest time that rates stand for
    pub rate: f64,
    /// the same if rates are quotients of increments, 0 for those of a closed form
    pub quotients: f64,
    /// the part of the sums that is rounding, in units of the tolerance
    pub share: f64,
    /// the part of the sums without what is stored that is not known, in the same units
    pub settled: f64,
    /// energy of the terms of a closed form if none of them cancelled: it could all be in one element [J]
    pub swing: f64,
}

impl Auditor {
    /// Turns `floor`, which holds the sizes of sources and functions in each law, into what the law
    /// is measured by at least; returns the same for the currents and voltages of pairs of each part.
    pub(super) fn floor(&self, unit: &RoundingUnit, floor: &mut [f64]) -> Vec<[f64; 2]> {
        let (reach, kinds, Seen { parts, currents, .. }) =
            (&self.reach, &self.arrays.kinds, &self.seen);
        let RoundingUnit { largest, rate, share, settled, .. } = *unit;
        // what underflows, a value or a product with it, is off by the rounding of the smallest
        // number (section 2.1 there)
        let largest = largest.map(|v| v.max(f64::MIN_POSITIVE));
        let of_part = |part: usize| [largest[0], largest[1].min(currents[part])];
        // a pair's current is the rest of others, its voltage a difference of some
        let part = share.max(settled);
        let own = (0..parts.count()).map(of_part);
        let mut least: Vec<_> =
            own.map(|[volts, amperes]| [part * amperes, part * volts]).collect();
        for (row, (own, &kind)) in floor.iter_mut().zip(kinds).enumerate() {
            let largest = parts.of(row).map_or(largest, of_part);
            let acting = *own + reach.acting(row, &largest) + f64::MIN_POSITIVE;
            let content = reach.content(row, &largest).max(reach.holding(row, kind, unit.swing));
            let stored = 2.0 * rate * content;
            // times the tolerance, far below all ranges of values: regardless of smaller ones
            let none = f64::EPSILON * unit.largest[usize::from(1 - kind)];
            *own = (share * (acting + stored)).max(settled * acting).max(none);
            if let Some(part) = parts.of(row) {
                let least = &mut least[part][usize::from(kind)];
                *least = least.max(*own);
            }
        }
        let rows = reach.acting.iter().zip(&reach.shares).zip(kinds);
        for (row, (own, ((acting, shares), &kind))) in floor.iter_mut().zip(rows).enumerate() {
            let shared = !shares.is_empty();
            let added = if shared { 1.0 } else { acting[usize::from(1 - kind)].min(1.0) };
            // what a source fixes has no part: capacitors hand the currents of others on to it
            let own_part = parts.of(row);
            let others = shares.iter().filter(|_| own_part.is_none());
            for part in own_part.into_iter().chain(others.filter_map(|&j| parts.of(j))) {
                *own = own.max(added * least[part][usize::from(kind)]);
            }
        }
        least
    }
}
