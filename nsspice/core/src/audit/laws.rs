//! The checks at points.

use super::energy::Ledger;
use super::matrix::Entries;
use super::points::Block;
use super::{ratio, worse};
use crate::sparse::Csc;
use crate::tape::{Linearisation, Tape};

/// The arrays of a system, as assembled.
pub struct Arrays {
    /// storage matrix
    pub e: Csc,
    /// conductance-like matrix
    pub g: Csc,
    /// multiplier columns
    pub a: Csc,
    /// slack rows
    pub b: Csc,
    /// series resistance of the pairs
    pub d: Csc,
    /// constant slack
    pub q: Vec<f64>,
    /// source columns
    pub s: Csc,
    /// 0 for laws of currents, 1 for laws of voltages
    pub row_kind: Vec<u8>,
    /// averaging terms of a theta scheme, if there are any: by unknowns and by sources
    pub averaging: Option<(Csc, Csc)>,
    /// functions, and the matrices of those that act and those that are stored
    pub smooth: Option<(Tape, Csc, Csc)>,
}

pub(super) struct Functions {
    pub tape: Tape,
    pub f: Entries,
    pub q: Entries,
}

impl Functions {
    /// Values at a point.
    pub fn values(&mut self, z: &[f64], u: &[f64], t: f64, out: &mut Vec<f64>) {
        self.tape.evaluate(z, u, t, Linearisation::Exact);
        out.clear();
        out.extend((0..self.tape.program().len()).map(|k| self.tape.value(k)));
    }
}

/// Checks the points of one island.
pub struct Auditor {
    pub(super) n: usize,
    pub(super) m: usize,
    pub(super) p: usize,
    pub(super) e: Entries,
    pub(super) g: Entries,
    pub(super) a: Entries,
    pub(super) b: Entries,
    pub(super) d: Entries,
    pub(super) s: Entries,
    pub(super) q: Vec<f64>,
    pub(super) kinds: Vec<u8>,
    pub(super) averaging: Option<(Entries, Entries)>,
    pub(super) smooth: Option<Functions>,
    /// rows that hold at every instant: no charge or flux in them
    pub(super) algebraic: Vec<bool>,
    /// of each pair, the laws of currents that it feeds
    pub(super) touched: Vec<Vec<usize>>,
    /// largest current and voltage so far
    pub(super) largest: [f64; 2],
    /// largest charge and flux so far
    pub(super) stored: [f64; 2],
    /// of each row, the largest charge or flux in stretches so far
    pub(super) contents: Vec<f64>,
    /// longest step [s]
    pub(super) length: f64,
    pub(super) block: Block,
    /// worst relative error of a law
    pub laws: f64,
    /// worst relative error of a pair
    pub complementarity: f64,
    /// where
    pub worst_row: Option<usize>,
    /// where
    pub worst_pair: Option<usize>,
    /// points checked
    pub checks: u64,
    /// energies; none where nothing is stored
    pub ledger: Option<Ledger>,
}

impl Auditor {
    /// Takes the arrays of a system.
    pub fn new(arrays: &Arrays) -> Auditor {
        let (n, m, p) = (arrays.g.nrows, arrays.a.ncols, arrays.s.ncols);
        let e = Entries::new(&arrays.e);
        let smooth = arrays.smooth.as_ref().map(|(tape, f, q)| Functions {
            tape: tape.clone(),
            f: Entries::new(f),
            q: Entries::new(q),
        });
        let mut algebraic = vec![true; n];
        let stored = smooth.iter().flat_map(|s| s.q.places());
        for (row, _) in e.places().chain(stored) {
            algebraic[row] = false;
        }
        let a = Entries::new(&arrays.a);
        let mut touched = vec![Vec::new(); m];
        for (row, pair) in a.places().filter(|e| arrays.row_kind[e.0] == 0) {
            touched[pair].push(row);
        }
        let stores = !algebraic.iter().all(|v| *v);
        let full = |(h, hs): &(Csc, Csc)| (Entries::new(h), Entries::new(hs));
        Auditor {
            n,
            m,
            p,
            g: Entries::new(&arrays.g),
            b: Entries::new(&arrays.b),
            d: Entries::new(&arrays.d),
            s: Entries::new(&arrays.s),
            q: arrays.q.clone(),
            kinds: arrays.row_kind.clone(),
            averaging: arrays.averaging.as_ref().map(full),
            smooth,
            algebraic,
            touched,
            largest: [0.0; 2],
            stored: [0.0; 2],
            contents: vec![0.0; n],
            length: 0.0,
            block: Block::default(),
            laws: 0.0,
            complementarity: 0.0,
            worst_row: None,
            worst_pair: None,
            checks: 0,
            ledger: stores.then(Ledger::default),
            e,
            a,
        }
    }

    /// Numbers of unknowns, pairs and sources.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.n, self.m, self.p)
    }

    pub(super) fn note_law(&mut self, found: f64, row: usize) {
        if worse(found, self.laws) {
            self.laws = found;
            self.worst_row = Some(row);
        }
    }

    /// The relative error of the balance of charge and flux over a jump: what moved into each row,
    /// plus what impulses brought there, vanishes; `stored` is the size of what was there.
    pub fn jump_error(
        &mut self,
        moved: &[f64],
        stored: &[f64],
        after: &[f64],
        unknowns: &[f64],
        multipliers: &[f64],
    ) -> f64 {
        let mut error = moved.to_vec();
        let mut sizes: Vec<f64> = stored.iter().zip(moved).map(|(s, m)| s + m.abs()).collect();
        self.g.add_both(1.0, unknowns, &mut error, &mut sizes);
        self.a.add_both(1.0, multipliers, &mut error, &mut sizes);
        self.e.add_sizes(1.0, after, &mut sizes);
        for (size, &kind) in sizes.iter().zip(&self.kinds) {
            // what ordinary currents and voltages carry in a step is no impulse
            let k = usize::from(kind);
            self.stored[k] = self.stored[k].max(size + self.length * self.largest[k]);
        }
        let errors = error.iter().zip(&self.kinds);
        let found = errors.map(|(e, &k)| ratio(e.abs(), self.stored[usize::from(k)]));
        found.fold(0.0, |worst, new| if worse(new, worst) { new } else { worst })
    }
}
