//! The elements of a network, read from the equations that they have been assembled into.
//!
//! Capacitors and resistors between nodes come as they are: in the sum `1 F + 1 pF` the matrix keeps four digits
//! of the second.  Every other element has a row of its own, in which nothing is lost.

use super::coordinates::{Coordinates, Edge};
use super::coupled::Coupled;
use crate::descriptor::Linear;
use crate::sparse::Csc;

/// A branch between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branch {
    /// the current flows from the first to the second
    pub ends: [usize; 2],
    /// capacitance, conductance, inductance; series resistance of a pair
    pub value: f64,
    /// unknown of its current, or number of the pair; none for those that come between nodes
    pub index: Option<usize>,
}

/// Capacitors, resistors, inductors, sources and pairs between nodes.
#[derive(Clone, Debug, Default)]
pub struct Elements {
    /// number of nodes with those of the cores and ground, which is the last one
    pub nodes: usize,
    /// the voltages that are unknowns
    pub coordinates: Coordinates,
    /// the unknown of each of the first nodes, which are those of the network
    pub unknowns: Vec<usize>,
    /// between nodes
    pub capacitors: Vec<Branch>,
    /// conductances
    pub resistors: Vec<Branch>,
    /// without couplings
    pub inductors: Vec<Branch>,
    /// branches whose voltage is `-S u` of their row
    pub voltages: Vec<Branch>,
    /// coupled inductors
    pub groups: Vec<Coupled>,
    /// one-way branches and switches
    pub pairs: Vec<Branch>,
}

/// Rows and columns of the nodes.
struct Nodes<'a> {
    coordinates: &'a Coordinates,
    /// node of each unknown
    of: Vec<Option<usize>>,
    ground: usize,
}

impl Nodes<'_> {
    /// The two ends of a list that has +1 at one of them and -1 at the other; ground takes what is missing.
    fn ends(&self, list: impl Iterator<Item = (usize, f64)>) -> Option<[usize; 2]> {
        let (mut plus, mut minus) = (None, None);
        let list: Vec<_> = list.filter(|e| e.1 != 0.0).collect();
        for (unknown, value) in self.coordinates.list_at_nodes(&list) {
            let end = match value {
                1.0 => &mut plus,
                -1.0 => &mut minus,
                _ => return None,
            };
            if end.replace(self.of[unknown]?).is_some() {
                return None;
            }
        }
        Some([plus.unwrap_or(self.ground), minus.unwrap_or(self.ground)])
    }

    fn between(&self, list: &[Edge]) -> Option<Vec<Branch>> {
        let node = |j: isize| if j < 0 { Some(self.ground) } else { self.of[j as usize] };
        let one = |&(a, b, value): &Edge| {
            (value > 0.0 && value.is_finite()).then_some(Branch {
                ends: [node(a)?, node(b)?],
                value,
                index: None,
            })
        };
        list.iter().map(one).collect()
    }
}

impl Elements {
    /// Reads them; nothing if the network holds anything else (controlled sources, laws of several branches,
    /// negative values).
    pub fn read(
        linear: &Linear,
        capacitors: &[Edge],
        resistors: &[Edge],
        coordinates: &Coordinates,
    ) -> Option<Elements> {
        let n = linear.g.nrows;
        let unknowns: Vec<usize> = (0..n).filter(|&j| linear.row_kind[j] == 0).collect();
        let mut nodes = Nodes { coordinates, of: vec![None; n], ground: unknowns.len() };
        unknowns.iter().enumerate().for_each(|(k, &j)| nodes.of[j] = Some(k));
        let mut found = Elements {
            nodes: unknowns.len() + 1,
            capacitors: nodes.between(capacitors)?,
            resistors: nodes.between(resistors)?,
            ..Elements::default()
        };
        let is_sum_of = |matrix: &Csc, edges: &[Edge]| {
            let rest = coordinates.remainder(matrix, edges);
            let between =
                |e: (usize, usize, f64)| nodes.of[e.0].is_some() && nodes.of[e.1].is_some();
            let left = rest.iter().any(between);
            !left
        };
        if !is_sum_of(&linear.e, capacitors) || !is_sum_of(&linear.g, resistors) {
            return None;
        }
        found.read_branches(linear, &nodes)?;
        found.read_pairs(linear, &nodes)?;
        found.unknowns = unknowns;
        found.coordinates = coordinates.clone();
        found.place_cores();
        Some(found)
    }

    /// Gives each core a node between those of the network and ground.
    fn place_cores(&mut self) {
        let (first, cores) =
            (self.nodes - 1, self.groups.iter().map(Coupled::cores).sum::<usize>());
        if cores == 0 {
            return;
        }
        self.nodes += cores;
        let (ground, mut next) = (self.nodes - 1, first);
        let lists = [&mut self.capacitors, &mut self.resistors, &mut self.inductors]
            .into_iter()
            .chain([&mut self.voltages, &mut self.pairs])
            .chain(self.groups.iter_mut().map(|group| &mut group.windings));
        for end in lists.flatten().flat_map(|branch| &mut branch.ends) {
            *end = if *end == first { ground } else { *end };
        }
        for group in &mut self.groups {
            group.first = next;
            next += group.cores();
        }
    }

    /// The rows `L i' + R i - (va - vb) = S u`.
    fn read_branches(&mut self, linear: &Linear, nodes: &Nodes) -> Option<()> {
        let (e_rows, g_rows) = (linear.e.transpose(), linear.g.transpose());
        let mut coupled = Vec::new();
        for row in (0..linear.g.nrows).filter(|&j| nodes.of[j].is_none()) {
            let own = |list: &[(usize, f64)]| -> Option<f64> {
                let mut inside = list.iter().filter(|e| nodes.of[e.0].is_none());
                match (inside.next(), inside.next()) {
                    (None, _) => Some(0.0),
                    (Some(&(k, v)), None) if k == row => Some(v),
                    _ => None,
                }
            };
            let law = g_rows.nonzeros(row);
            let flow = linear.g.nonzeros(row);
            let stored = e_rows.nonzeros(row);
            let resistance = own(&law)?;
            let inductance = stored.iter().find(|e| e.0 == row).map_or(0.0, |e| e.1);
            let at_nodes = |list: Vec<(usize, f64)>, factor: f64| {
                list.into_iter()
                    .filter(|e| nodes.of[e.0].is_some())
                    .map(move |(k, v)| (k, factor * v))
            };
            // a source may read a rate
            let stores = inductance != 0.0;
            let inside = stored.iter().all(|e| nodes.of[e.0].is_none() && stores);
            let alike = stored == linear.e.nonzeros(row);
            let ends = nodes.ends(at_nodes(law, -1.0))?;
            if !(inside && alike)
                || own(&flow).is_none()
                || nodes.ends(at_nodes(flow, 1.0))? != ends
            {
                return None;
            }
            let driven = linear.s.iter().any(|e| e.0 == row && e.2 != 0.0);
            let branch = |value: f64| Branch { ends, value, index: Some(row) };
            if stored.len() > 1 {
                if resistance != 0.0 || driven {
                    return None;
                }
                coupled.push(branch(inductance));
                continue;
            }
            match (inductance, resistance) {
                (0.0, 0.0) => self.voltages.push(branch(0.0)),
                (l, 0.0) if l > 0.0 && !driven => self.inductors.push(branch(l)),
                (0.0, r) if r > 0.0 && !driven => self.resistors.push(branch(1.0 / r)),
                _ => return None,
            }
        }
        self.groups = Coupled::groups(&linear.e, coupled)?;
        Some(())
    }

    fn read_pairs(&mut self, linear: &Linear, nodes: &Nodes) -> Option<()> {
        let b_rows = linear.b.transpose();
        for pair in 0..linear.a.ncols {
            let (flow, across, series) =
                (linear.a.nonzeros(pair), b_rows.nonzeros(pair), linear.d.nonzeros(pair));
            let ends = nodes.ends(flow.iter().copied())?;
            let value = match series[..] {
                [] => 0.0,
                [(own, value)] if own == pair && value > 0.0 => value,
                _ => return None,
            };
            if flow != across || linear.d.iter().any(|e| e.0 == pair && e.1 != pair && e.2 != 0.0) {
                return None;
            }
            self.pairs.push(Branch { ends, value, index: Some(pair) });
        }
        Some(())
    }

    /// Potentials of all nodes from the unknowns.
    pub fn potentials(&self, z: &[f64]) -> Vec<f64> {
        let v = self.coordinates.potentials(z);
        let mut out: Vec<f64> = self.unknowns.iter().map(|&j| v[j]).collect();
        out.resize(self.nodes, 0.0);
        out
    }

    /// The voltage between two nodes from the unknowns, which add up along the tree.
    pub fn voltage(&self, z: &[f64], ends: [usize; 2]) -> f64 {
        let [a, b] = ends.map(|end| self.unknowns.get(end).map_or(-1, |&j| j as isize));
        self.coordinates.path(a, b).iter().map(|&(k, sign)| sign * z[k]).sum()
    }

    /// Writes potentials of all nodes into the unknowns.
    pub fn put(&self, potentials: &[f64], z: &mut [f64]) {
        let mut of = vec![0; z.len()];
        self.unknowns.iter().enumerate().for_each(|(node, &j)| of[j] = node);
        for (node, &j) in self.unknowns.iter().enumerate() {
            let before = self.coordinates.before(j);
            let other = if before < 0 { self.nodes - 1 } else { of[before as usize] };
            z[j] = potentials[node] - potentials[other];
        }
    }

    /// What enters each node of a list of all unknowns' laws.
    pub fn entering(&self, list: &[f64]) -> Vec<f64> {
        let at = self.coordinates.at_nodes(list);
        self.unknowns.iter().map(|&j| at[j]).collect()
    }
}
