//! The arrays of a system as they are checked, and what they say of each law.

use super::flows::Flows;
use super::form::Form;
use super::matrix::Entries;
use crate::descriptor::{stored_groups, Linear};
use crate::sparse::Csc;
use crate::structure::{Coordinates, Edge};

/// The arrays of a system in node voltages.
pub(super) struct Arrays {
    pub n: usize,
    pub m: usize,
    pub p: usize,
    pub e: Flows,
    pub g: Flows,
    /// the part of `E` that stores, see `Linear::storage_and_controls`
    pub storage: Form,
    /// entries of `G`
    pub conductances: Entries,
    pub a: Entries,
    pub b: Entries,
    pub d: Entries,
    pub s: Entries,
    pub q: Vec<f64>,
    pub kinds: Vec<u8>,
    /// of a theta scheme, by unknowns and by sources
    pub averaging: Option<(Entries, Entries)>,
}

impl Arrays {
    pub fn new(
        linear: &Linear,
        [capacitors, conductors]: [&[Edge]; 2],
        averaging: Option<&(Csc, Csc)>,
    ) -> Arrays {
        let (n, m, p) = linear.sizes();
        let [storage, _] = linear.storage_and_controls();
        Arrays {
            n,
            m,
            p,
            e: Flows::new(&linear.e, capacitors),
            g: Flows::new(&linear.g, conductors),
            storage: Form::new(&storage, capacitors, &Coordinates::of_nodes(n)),
            conductances: Entries::new(&linear.g),
            a: Entries::new(&linear.a),
            b: Entries::new(&linear.b),
            d: Entries::new(&linear.d),
            s: Entries::new(&linear.s),
            q: linear.q.clone(),
            kinds: linear.row_kind.clone(),
            averaging: averaging.map(|(h, hs)| (Entries::new(h), Entries::new(hs))),
        }
    }
}

/// Where charges and fluxes are, and pairs.
pub(super) struct Places {
    /// rows that hold at every instant: no charge or flux in them
    pub algebraic: Vec<bool>,
    /// laws of currents whose sum holds at every instant: of nodes that capacitors cut_set together
    pub groups: Vec<Vec<usize>>,
    /// of each pair, the laws of currents that it feeds
    pub touched: Vec<Vec<usize>>,
}

impl Places {
    /// `functions` are the places of functions that are stored.
    pub fn new(linear: &Linear, functions: Option<&Entries>) -> Places {
        let (n, m, _) = linear.sizes();
        let mut varying = vec![false; n];
        functions.iter().flat_map(|q| q.places()).for_each(|(row, _)| varying[row] = true);
        let mut algebraic: Vec<bool> = varying.iter().map(|varying| !varying).collect();
        Entries::new(&linear.e).places().for_each(|(row, _)| algebraic[row] = false);
        let [mut groups, _] = stored_groups(&linear.e);
        groups.retain(|group| group.iter().all(|&row| !varying[row]));
        let mut touched = vec![Vec::new(); m];
        let a = Entries::new(&linear.a);
        for (row, pair) in a.places().filter(|e| linear.row_kind[e.0] == 0) {
            touched[pair].push(row);
        }
        Places { algebraic, groups, touched }
    }
}
