//! The system as arrays: one pattern for the Jacobians of all modes, points and step lengths.

use super::combined::Combined;
use crate::descriptor::Smooth;
use crate::linear::ordering;
use crate::sparse::{Csc, Ordering};
use crate::structure::Coordinates;
use crate::tape::Linearisation;
use crate::tolerances::FLOOR;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where no resistor shows what a usual conductance is [S]: that of a kilohm.  With a decade more a static
/// problem without a solution is taken for solved; no test distinguishes one less.
const CONDUCTANCE: f64 = 1e-3;

/// Rows that are balanced at a time.
pub(super) const FOUR: usize = 4;

/// Where something counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Part {
    /// in a law, and in the equation that it is
    Both,
    /// in a law to which others are added
    Law,
    /// in the equation that replaces it
    Sum,
}

/// A derivative `df_k/dz_j` in one entry of the Jacobian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub row: u32,
    /// index into the values of the pattern
    pub at: u32,
    /// variable, and slot of the derivative
    pub column: u32,
    pub slot: u32,
    /// coefficients of the function and of its rate
    pub f: f64,
    pub q: f64,
    pub part: Part,
}

/// A function in one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub row: u32,
    pub function: u32,
    /// where the value of the function is
    pub register: u32,
    pub f: f64,
    pub q: f64,
    pub part: Part,
}

/// What counts in each row, in fours.
pub(super) struct Fours {
    /// one for rows of unknowns, zero for slacks
    pub laws: Vec<[f64; FOUR]>,
    /// one for current rows in which nothing is stored
    pub currents: Vec<[f64; FOUR]>,
    /// sums of the sizes of entries in each four rows: of voltages, of currents; what is stored would be
    /// neither in a short step
    pub reach: Vec<[[f64; FOUR]; 2]>,
}

/// Rows and unknowns of a kind.
pub(super) struct Places {
    /// current rows that contain only functions that store nothing
    pub leaks: Vec<usize>,
    /// unknowns of current rows, and of voltage rows
    pub nodes: Vec<u32>,
    /// those on which some law depends: a voltage that none does may be any, and measures nothing
    pub potentials: Vec<u32>,
    pub branches: Vec<u32>,
    /// multipliers, and unknowns of voltage rows that store nothing
    pub bare: Vec<bool>,
    /// current rows in which a multiplier appears
    pub touched: Vec<usize>,
}

/// The matrices of a complementarity descriptor system with smooth terms.
pub struct Equations {
    pub(super) n: usize,
    pub(super) m: usize,
    /// `[[G, A], [-B, D]]` in the pattern of all Jacobians, with a full diagonal
    pub(super) pattern: Csc,
    /// entries of E: row, column, place in the same pattern, value
    pub(super) stored: Vec<(u32, u32, u32, f64)>,
    pub(super) entries: Vec<Entry>,
    pub(super) terms: Vec<Term>,
    pub(super) row_kind: Vec<u8>,
    pub(super) ordering: Arc<Ordering>,
    /// index of each diagonal entry
    pub(super) diagonal: Vec<u32>,
    /// a usual conductance in current rows, a usual resistance in voltage rows
    pub(super) reference: Vec<f64>,
    /// scaling by which usual conductances and resistances become about one
    pub(super) unit: Vec<f64>,
    pub(super) fours: Fours,
    pub(super) places: Places,
    pub(super) a: Csc,
    pub(super) b: Csc,
    pub(super) d: Csc,
    /// laws to which others are added
    pub(super) combined: Combined,
    /// along which voltages are the unknowns, if they are no potentials
    pub(super) tree: Option<Coordinates>,
}

/// The least slope around zero of a current that is a function of voltages [S], where that is a leakage relative to
/// the usual conductance; else 0.
fn weakest_slope(smooth: &Smooth, n: usize, terms: &[Term], row_kind: &[u8], usual: f64) -> f64 {
    let mut tape = smooth.tape.clone();
    let sources = tape.program().sources();
    tape.evaluate(&vec![0.0; n], &vec![0.0; sources], 0.0, Linearisation::Exact);
    let mut weakest = f64::INFINITY;
    for t in terms.iter().filter(|t| t.f != 0.0 && row_kind[t.row as usize] == 0) {
        for (j, slot) in tape.derivatives(t.function as usize) {
            let slope = (t.f * tape.slopes()[slot]).abs();
            if j < n && row_kind[j] == 0 && slope > 0.0 {
                weakest = weakest.min(slope);
            }
        }
    }
    if weakest < usual {
        weakest
    } else {
        0.0
    }
}

impl Equations {
    /// Joins the patterns.
    #[allow(clippy::too_many_arguments)] // one per matrix
    pub fn new(
        e: &Csc,
        g: &Csc,
        a: &Csc,
        b: &Csc,
        d: &Csc,
        row_kind: &[u8],
        smooth: &Smooth,
        tree: Option<&Coordinates>,
    ) -> Equations {
        let (n, m) = (g.nrows, a.ncols);
        let size = n + m;
        let mut functional = vec![false; n];
        smooth.f.iter().chain(smooth.q.iter()).for_each(|e| functional[e.0] = true);
        let combined = Combined::new([e, g], row_kind, &functional, tree);
        let a = &Csc::from_triplets(n, m, &combined.matrix(a));
        let mut terms: Vec<Term> = Vec::new();
        for (matrix, rate) in [(&smooth.f, false), (&smooth.q, true)] {
            for (row, k, v) in matrix.iter() {
                let (f, q) = if rate { (0.0, v) } else { (v, 0.0) };
                let same = |t: &&mut Term| t.row as usize == row && t.function as usize == k;
                match terms.iter_mut().rev().find(same).filter(|_| rate) {
                    Some(term) => term.q += q,
                    None => {
                        let register = smooth.tape.register(k) as u32;
                        let part = if combined.changes(row) { Part::Law } else { Part::Both };
                        let (row, function) = (row as u32, k as u32);
                        terms.push(Term { row, function, register, f, q, part });
                    }
                }
            }
        }
        let mut sums: BTreeMap<(u32, u32), Term> = BTreeMap::new();
        for t in &terms {
            let own = combined.changes(t.row as usize).then_some((t.row as usize, 1.0));
            for (row, factor) in own.into_iter().chain(combined.with(t.row as usize)) {
                let row = row as u32;
                let sum = sums.entry((row, t.function)).or_insert(Term {
                    row,
                    f: 0.0,
                    q: 0.0,
                    part: Part::Sum,
                    ..*t
                });
                sum.f += factor * t.f;
                sum.q += factor * t.q;
            }
        }
        terms.extend(sums.into_values().filter(|t| t.f != 0.0 || t.q != 0.0));
        let mut positions = Vec::new();
        for term in &terms {
            for (variable, slot) in smooth.tape.derivatives(term.function as usize) {
                if variable < n {
                    positions.push((term, variable, slot));
                }
            }
        }
        let stored = combined.matrix(e);
        let mut all = combined.matrix(g);
        all.extend(stored.iter().map(|&(r, c, _)| (r, c, 0.0)));
        all.extend(positions.iter().map(|&(t, j, _)| (t.row as usize, j, 0.0)));
        all.extend(a.iter().map(|(r, c, v)| (r, n + c, v)));
        all.extend(b.iter().map(|(r, c, v)| (n + r, c, -v)));
        all.extend(d.iter().map(|(r, c, v)| (n + r, n + c, v)));
        all.extend((0..size).map(|i| (i, i, 0.0)));
        let pattern = Csc::from_triplets(size, size, &all);
        let place = |r: usize, c: usize| {
            let rows = pattern.col(c).0;
            let k = rows.binary_search(&r).unwrap_or_else(|_| unreachable!("in the pattern"));
            (pattern.colptr[c] + k) as u32
        };
        let mut storage = vec![0.0; pattern.values.len()];
        for (r, c, v) in stored {
            storage[place(r, c) as usize] += v;
        }
        let stored = pattern.iter().zip(storage).enumerate().filter(|(_, (_, v))| *v != 0.0);
        let stored: Vec<(u32, u32, u32, f64)> =
            stored.map(|(at, ((r, c, _), v))| (r as u32, c as u32, at as u32, v)).collect();
        let entries: Vec<Entry> = positions
            .iter()
            .map(|&(t, j, slot)| Entry {
                row: t.row,
                at: place(t.row as usize, j),
                column: j as u32,
                slot: slot as u32,
                f: t.f,
                q: t.q,
                part: t.part,
            })
            .collect();
        let diagonals = g.iter().filter(|&(r, c, v)| r == c && v > 0.0 && row_kind[r] == 0);
        let logs: Vec<f64> = diagonals.map(|(_, _, v)| v.ln()).collect();
        let usual = if logs.is_empty() {
            CONDUCTANCE
        } else {
            (logs.iter().sum::<f64>() / logs.len() as f64).exp()
        };
        let mut touched: Vec<_> = a.iter().map(|(r, _, _)| r).collect();
        touched.retain(|&r| row_kind[r] == 0);
        touched.sort_unstable();
        touched.dedup();
        let mut stores = vec![false; n];
        e.iter().chain(smooth.q.iter()).filter(|e| e.2 != 0.0).for_each(|e| stores[e.0] = true);
        let mut kept = vec![false; size];
        e.iter().filter(|e| e.2 != 0.0).for_each(|e| kept[e.1] = true);
        positions.iter().filter(|p| p.0.q != 0.0).for_each(|p| kept[p.1] = true);
        let bare = (0..size).map(|c| !kept[c] && row_kind.get(c) != Some(&0)).collect();
        let mut felt = vec![false; size];
        pattern.iter().filter(|e| e.2 != 0.0).for_each(|e| felt[e.1] = true);
        stored.iter().for_each(|e| felt[e.1 as usize] = true);
        positions.iter().for_each(|p| felt[p.1] = true);
        let nodes: Vec<u32> = (0..n as u32).filter(|&i| row_kind[i as usize] == 0).collect();
        let mask = |counts: &dyn Fn(usize) -> bool| -> Vec<[f64; FOUR]> {
            let four = |b| std::array::from_fn(|i| f64::from(counts(FOUR * b + i)));
            (0..size.div_ceil(FOUR)).map(four).collect()
        };
        let mut leaks: Vec<bool> = row_kind.iter().map(|&kind| kind == 0).collect();
        let linear = pattern.iter().filter(|e| e.2 != 0.0).map(|e| e.0);
        let kept = stored.iter().map(|e| e.0 as usize);
        let charges = terms.iter().filter(|t| t.q != 0.0 && t.part != Part::Law);
        let others = linear.chain(kept).chain(charges.map(|t| t.row as usize));
        others.filter(|&row| row < n).for_each(|row| leaks[row] = false);
        let leaks: Vec<usize> = (0..n).filter(|&row| leaks[row]).collect();
        let mut reach = vec![[[0.0; FOUR]; 2]; size.div_ceil(FOUR)];
        for (r, c, v) in pattern.iter() {
            if let Some(&kind) = row_kind.get(c) {
                reach[r / FOUR][usize::from(kind != 0)][r % FOUR] += v.abs();
            }
        }
        // what rounding of the largest voltage lets the weakest junction carry is no current
        let weakest = weakest_slope(smooth, n, &terms, row_kind, usual);
        for &row in &nodes {
            let row = row as usize;
            reach[row / FOUR][0][row % FOUR] += weakest * f64::EPSILON / FLOOR;
        }
        // the order is to serve Jacobians in which every derivative is there
        let mut full = pattern.clone();
        for t in &positions {
            full.values[place(t.0.row as usize, t.1) as usize] += 1.0;
        }
        Equations {
            n,
            m,
            reference: row_kind.iter().map(|&k| if k == 0 { usual } else { 1.0 / usual }).collect(),
            unit: (0..size)
                .map(
                    |i| if i < n && row_kind[i] == 0 { usual.sqrt().recip() } else { usual.sqrt() },
                )
                .collect(),
            fours: Fours {
                laws: mask(&|row| row < n),
                currents: mask(&|row| row < n && row_kind[row] == 0 && !stores[row]),
                reach,
            },
            places: Places {
                leaks,
                potentials: nodes.iter().copied().filter(|&i| felt[i as usize]).collect(),
                nodes,
                branches: (0..n as u32).filter(|&i| row_kind[i as usize] != 0).collect(),
                bare,
                touched,
            },
            diagonal: (0..size).map(|i| place(i, i)).collect(),
            ordering: Arc::new(ordering(&full, m)),
            stored,
            pattern,
            entries,
            terms,
            row_kind: row_kind.to_vec(),
            a: a.clone(),
            b: b.clone(),
            d: d.clone(),
            combined,
            tree: tree.cloned(),
        }
    }

    /// Length of vectors of which loops take four numbers at a time.
    pub(super) fn padded(&self) -> usize {
        self.size().next_multiple_of(FOUR)
    }

    /// Number of unknowns and multipliers together.
    pub fn size(&self) -> usize {
        self.n + self.m
    }

    /// 0 for a current row, 1 for a voltage row.
    pub(super) fn kind(&self, row: usize) -> usize {
        usize::from(self.row_kind[row] != 0)
    }
}
